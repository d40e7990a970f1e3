"""Cameras of the browsers in the page's scene, for windows of any shape."""

from collections.abc import Callable

import viser

from gazerig.robot.dashboard.view.views import FACE, View, view
from gazerig.robot.model.types import Snapshot

_FOV_STEP_RAD = 0.01
_KEPT = 64
"""Number of browsers whose requested view is stored until their scene has loaded."""


class Viewpoints:
    """Shows the face in every new browser, and fits the field of view to its window."""

    def __init__(self, server: viser.ViserServer, browser_of: Callable[[int], str]) -> None:
        """Set the view of browsers that connect.

        browser_of: the name of a client's browser by the client's number
        """
        self._server, self._browser_of = server, browser_of
        self._face = view(FACE)
        self._snapshot: Snapshot | None = None
        self._views: dict[int, str] = {}
        self._asked_early: dict[str, str] = {}
        self._begin_with(self._face)
        server.on_client_connect(self._greet)
        server.on_client_disconnect(self._forget)

    def fit(self, snapshot: Snapshot) -> None:
        """Fit the view of the face to the rig's dimensions, in all browsers that show it."""
        self._snapshot = snapshot
        face = view(FACE, snapshot)
        if face == self._face:
            return
        self._face = face
        self._begin_with(face)
        for client in self._server.get_clients().values():
            if self._views.get(client.client_id, FACE) == FACE:
                self._take(client, FACE)

    def choose(self, browser: str, name: str) -> None:
        """Move the cameras of a browser's tabs to a view, now or when its scene has loaded."""
        if not browser:  # it has disconnected
            return
        # Stored first: the scene may finish loading in between.
        self._asked_early[browser] = name
        while len(self._asked_early) > _KEPT:
            self._asked_early.pop(next(iter(self._asked_early)), None)
        for number, client in self._server.get_clients().items():
            if self._browser_of(number) == browser:
                self._asked_early.pop(browser, None)
                self._take(client, name)

    def _take(self, client: viser.ClientHandle, name: str) -> None:
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

        # Viser knows a client after its scene has loaded; the buttons work before.
        early = self._asked_early.pop(self._browser_of(client.client_id), None)
        if early is not None:
            self._take(client, early)


def _fit_field(camera: viser.CameraHandle, seen: View) -> None:
    fov_rad = seen.field_rad(camera.aspect)
    if abs(camera.fov - fov_rad) > _FOV_STEP_RAD:
        camera.fov = fov_rad
