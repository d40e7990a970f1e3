"""Where each browser's camera stands in the page's scene, whatever the shape of its window."""

import viser

from gazerig.robot.dashboard.view.views import FACE, View, view
from gazerig.robot.model.types import Snapshot

_FOV_STEP_RAD = 0.01


class Viewpoints:
    """Begins every browser with the face, and fits its field of view to its window."""

    def __init__(self, server: viser.ViserServer) -> None:
        self._server = server
        self._face = view(FACE)
        self._snapshot: Snapshot | None = None
        self._views: dict[int, str] = {}
        self._begin_with(self._face)
        server.on_client_connect(self._greet)
        server.on_client_disconnect(self._forget)

    def fit(self, snapshot: Snapshot) -> None:
        """Fit the view of the face to the rig's measures; who looks at the face sees it so."""
        self._snapshot = snapshot
        face = view(FACE, snapshot)
        if face == self._face:
            return
        self._face = face
        self._begin_with(face)
        for client in self._server.get_clients().values():
            if self._views.get(client.client_id, FACE) == FACE:
                self.take(client, FACE)

    def take(self, client: viser.ClientHandle, name: str) -> None:
        """Move a browser's camera to a view."""
        self._views[client.client_id] = name
        seen = view(name, self._snapshot)
        with client.atomic():
            client.camera.position, client.camera.look_at = seen.position_m, seen.look_at_m
            _fit_field(client.camera, seen)

    def _begin_with(self, face: View) -> None:
        start = self._server.initial_camera
        start.position, start.look_at = face.position_m, face.look_at_m
        if face.vertical_rad is not None:
            start.fov = face.vertical_rad

    def _forget(self, client: viser.ClientHandle) -> None:
        self._views.pop(client.client_id, None)

    def _greet(self, client: viser.ClientHandle) -> None:
        @client.camera.on_update
        def _(camera: viser.CameraHandle) -> None:
            name = self._views.get(client.client_id, FACE)
            _fit_field(camera, view(name, self._snapshot))


def _fit_field(camera: viser.CameraHandle, seen: View) -> None:
    fov_rad = seen.field_rad(camera.aspect)
    if abs(camera.fov - fov_rad) > _FOV_STEP_RAD:
        camera.fov = fov_rad
