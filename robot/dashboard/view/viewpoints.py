"""Cameras of the browsers in the page's scene, for windows of any shape."""

from collections.abc import Callable
from math import atan, cos, radians, sin, tan
from typing import NamedTuple

import viser

from gazerig.gaze.angles import add, sub
from gazerig.gaze.types import Vec3
from gazerig.robot.dashboard.feed.rig_feed import ShownHead
from gazerig.robot.dashboard.view.head_view import head_dimensions, pivot_m
from gazerig.robot.description.parts import CHIN, TOP, HeadMeasures

_FOV_STEP_RAD = 0.01
_KEPT = 64
"""Number of browsers whose requested view is stored until their scene has loaded."""
FACE, BOTH, SHOULDER, ABOVE = "face", "both", "over its shoulder", "from above"
HALF_WIDTH = 0.84
"""Tangent of half the horizontal field of view that shows rig and visitor: 80 deg."""

HEAD_SHARE = 0.64
"""Share of the canvas's height that the head fills in the view of the face."""
_FACE_UP_RAD = radians(4.0)
"""Elevation of the view of the face, almost straight ahead, so that the head faces the viewer."""
_FACE_AWAY = 10.5
"""Distance of the view of the face, in eye distances: near, but without distortion of the nose."""
_FACE_WIDTH = 3.3
"""Smallest visible width, in eye distances."""
_FACE_MIDDLE: Vec3 = (-0.45, 0.0, 0.5 * (TOP + CHIN) - 0.30)
"""Centre of the view: a little below the centre of the head, so that the neck is visible."""


class View(NamedTuple):
    """Position of the camera and the point in the centre of its view.

    vertical_rad: vertical field of view, None if the horizontal one is given
    least_width: tangent of half the horizontal field that must be visible
    """

    position_m: Vec3
    look_at_m: Vec3
    vertical_rad: float | None = None
    least_width: float = HALF_WIDTH

    def field_rad(self, aspect: float) -> float:
        """Return the vertical field of view for an aspect ratio of the canvas, rad."""
        across = self.least_width / max(aspect, 1e-3)
        if self.vertical_rad is None:
            return 2.0 * atan(across)
        return 2.0 * atan(max(tan(0.5 * self.vertical_rad), across))


_FIXED = {
    BOTH: View((0.95, -1.42, 0.56), (0.76, 0.0, 0.16)),
    SHOULDER: View((-0.56, -0.20, 0.42), (0.60, 0.06, 0.20)),
    # Above the walls of a room.
    ABOVE: View((-1.5, -2.9, 2.5), (1.0, 0.05, -0.35), least_width=0.62),
}
NAMES = (FACE, *_FIXED)


def named_view(name: str, head: ShownHead | None = None) -> View:
    """Return a view by its name; the view of the face is fitted to the head."""
    if name in _FIXED:
        return _FIXED[name]
    # A close-up of the head with its neck straight.
    measures, eyes_m = HeadMeasures(), (0.038, 0.0, 0.125)
    if head is not None:
        measures = head_dimensions(head)
        eyes_m = sub(pivot_m(head), measures.pivot_m)
    unit = measures.interocular_m
    middle = add(eyes_m, measures.scaled(_FACE_MIDDLE))
    away = _FACE_AWAY * unit
    off = (away * cos(_FACE_UP_RAD), 0.0, away * sin(_FACE_UP_RAD))
    half_height = 0.5 * measures.height_m / HEAD_SHARE
    return View(
        add(middle, off), middle, 2.0 * atan(half_height / away), 0.5 * _FACE_WIDTH * unit / away
    )


class Viewpoints:
    """Shows the face in every new browser, and fits the field of view to its window."""

    def __init__(self, server: viser.ViserServer, browser_of: Callable[[int], str]) -> None:
        """Set the view of browsers that connect.

        browser_of: the name of a client's browser by the client's number
        """
        self._server, self._browser_of = server, browser_of
        self._face = named_view(FACE)
        self._head: ShownHead | None = None
        self._names: dict[str, str] = {}
        self._begin_with(self._face)
        server.on_client_connect(self._greet)

    def fit(self, head: ShownHead) -> None:
        """Fit the view of the face to the rig's dimensions, in all browsers that show it."""
        self._head = head
        face = named_view(FACE, head)
        if face == self._face:
            return
        self._face = face
        self._begin_with(face)
        for client in self._server.get_clients().values():
            if self._name(client) == FACE:
                self._take(client)

    def choose(self, browser: str, name: str) -> None:
        """Move the cameras of a browser's tabs to a view, now or when its scene has loaded."""
        # Stored first: the scene may finish loading before the next line.
        self._names[browser] = name
        while len(self._names) > _KEPT:
            self._names.pop(next(iter(self._names)), None)
        for number, client in self._server.get_clients().items():
            if self._browser_of(number) == browser:
                self._take(client)

    def _name(self, client: viser.ClientHandle) -> str:
        return self._names.get(self._browser_of(client.client_id), FACE)

    def _take(self, client: viser.ClientHandle) -> None:
        seen = named_view(self._name(client), self._head)
        with client.atomic():
            client.camera.position, client.camera.look_at = seen.position_m, seen.look_at_m
            _fit_field(client.camera, seen)

    def _begin_with(self, face: View) -> None:
        start = self._server.initial_camera
        start.position, start.look_at = face.position_m, face.look_at_m
        if face.vertical_rad is not None:
            start.fov = face.vertical_rad

    def _greet(self, client: viser.ClientHandle) -> None:
        @client.camera.on_update
        def fit_field(camera: viser.CameraHandle) -> None:
            _fit_field(camera, named_view(self._name(client), self._head))

        # Viser lists a client only after its scene has loaded; the buttons work before that.
        if self._name(client) != FACE:
            self._take(client)


def _fit_field(camera: viser.CameraHandle, seen: View) -> None:
    fov_rad = seen.field_rad(camera.aspect)
    if abs(camera.fov - fov_rad) > _FOV_STEP_RAD:
        camera.fov = fov_rad
