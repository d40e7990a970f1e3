"""Conversion of a pointer over the view, or a click in the image, to a gaze target.

The target of a pointer is between viewer and head. The eyes seem to look at the pointer because
they look at a point on the viewer's line of sight to it. A pointer controls the gaze only while its
points arrive; one second after the last point the gaze models regain control.
"""

from collections.abc import Callable
from math import isfinite, tan
from typing import NamedTuple

from gazerig.gaze.angles import add, dot, norm, scale, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.model.commands import OPPONENT_BOX_M
from gazerig.robot.perception.pixel_to_world import PixelToWorld
from gazerig.robot.remote.excess import TokenBucket

PER_S, BURST = 40.0, 40.0
"""Rate limit of points of all browsers together; one sends 20 a second."""
TOWARDS_HEAD = 0.6
"""Distance of the pointer's plane, as a fraction of the distance to the head."""
_NEAREST_M = 0.02
_GUARD_M: Vec3 = (0.7, 0.0, 0.0)
_WIDEST, _NARROWEST = 10.0, 0.1  # aspect ratios of the view


class ViewCamera(NamedTuple):
    """Camera of a browser's view of the scene.

    R_world_camera: rotation; x right, y down, z ahead; fov_rad: vertical field of view
    """

    p_world_m: Vec3
    R_world_camera: Mat3
    fov_rad: float


class Pointer(NamedTuple):
    """Pointer over the view: 0..1 from the left and from the top, and the view's aspect ratio."""

    x: float
    y: float
    aspect: float


def parse_pointer(asked: object) -> Pointer | None:
    """Return the pointer that a browser sent, None if it is not valid."""
    match asked:
        case {"x": int() | float() as x, "y": int() | float() as y, "aspect": int() | float() as a}:
            pointer = Pointer(float(x), float(y), float(a))
        case _:
            return None
    inside = 0.0 <= pointer.x <= 1.0 and 0.0 <= pointer.y <= 1.0
    return pointer if inside and _NARROWEST <= pointer.aspect <= _WIDEST else None


def gaze_target(pointer: Pointer, camera: ViewCamera, p_world_eyes_m: Vec3) -> Vec3 | None:
    """Return the point in the world, None if the viewer is inside the head.

    Args:
        pointer: pointer over the view.
        camera: camera of the view.
        p_world_eyes_m: midpoint between the eyes, world frame.
    """
    to_head = sub(p_world_eyes_m, camera.p_world_m)
    if norm(to_head) < _NEAREST_M:
        return None
    return _intersect_plane(pointer, camera, to_head, TOWARDS_HEAD * dot(to_head, to_head))


def opponent_target(pointer: Pointer, camera: ViewCamera) -> Vec3 | None:
    """Return the point at a pointer for the opponent's fist, None if that is behind the viewer.

    The point is in the plane through the fist's guard position parallel to the screen, and within
    the fist's box.
    """
    ahead = tuple(row[2] for row in camera.R_world_camera)
    normal = (ahead[0], ahead[1], ahead[2])
    away = dot(normal, sub(_GUARD_M, camera.p_world_m))
    point = _intersect_plane(pointer, camera, normal, away) if away > _NEAREST_M else None
    if point is None:
        return None
    x, y, z = (
        min(max(one, least), most) for one, (least, most) in zip(point, OPPONENT_BOX_M, strict=True)
    )
    return x, y, z


def _intersect_plane(
    pointer: Pointer, camera: ViewCamera, normal: Vec3, away: float
) -> Vec3 | None:
    """Return the intersection of a pointer's line of sight with a plane, None if there is none."""
    half = tan(0.5 * camera.fov_rad)
    right, down, ahead = zip(*camera.R_world_camera, strict=True)
    across = scale(right, (2.0 * pointer.x - 1.0) * half * pointer.aspect)
    ray = add(ahead, add(across, scale(down, (2.0 * pointer.y - 1.0) * half)))
    towards = dot(ray, normal)
    if towards <= 0.0:  # the intersection is behind the viewer
        return None
    point = add(camera.p_world_m, scale(ray, away / towards))
    return point if all(map(isfinite, point)) else None


class PointerToLook:
    """Converts pointers to gaze targets; safe to call from any thread.

    p_world_eyes_m: midpoint between the eyes, world frame; None before it is known
    """

    def __init__(
        self,
        camera: Callable[[str], ViewCamera | None],
        look: Callable[[Vec3, str], object],
        clock: Clock | None = None,
        move_opponent: Callable[[Vec3], object] = lambda point: None,
    ) -> None:
        self._camera, self._look, self._move_opponent = camera, look, move_opponent
        self._clock = clock if clock is not None else RealClock()
        self._rate = TokenBucket(PER_S, BURST)
        self.p_world_eyes_m: Vec3 | None = None

    def look_at_pointer(self, asked: object, who: str) -> bool:
        """Send the target of a browser's pointer; return False if there is none.

        A pointer with "opponent" moves the opponent of a boxing world instead of the gaze.
        """
        pointer, eyes_m = parse_pointer(asked), self.p_world_eyes_m
        if pointer is None or eyes_m is None or not self._rate.take(self._clock.now_s()):
            return False
        camera = self._camera(who)
        if camera is None:
            return False
        if isinstance(asked, dict) and asked.get("opponent") is True:
            if (to := opponent_target(pointer, camera)) is not None:
                self._move_opponent(to)
            return to is not None
        point = gaze_target(pointer, camera, eyes_m)
        if point is None:
            return False
        self._look(point, who)
        return True


class ClickToLook:
    """Stores the newest frame and the pose of the camera at its capture.

    newest: the newest tick, written by the loop
    """

    def __init__(self, pixels: PixelToWorld) -> None:
        self._pixels = pixels
        self.newest: Tick | None = None

    def point(self, x: float, y: float) -> Vec3 | None:
        """Return the world point at a position in the newest frame, None without one.

        x, y: 0..1 from the left and from the top
        """
        tick = self.newest
        if tick is None or tick.detections is None:
            return None
        found = tick.detections
        pixel = (
            min(max(x, 0.0), 1.0) * (found.width_px - 1),
            min(max(y, 0.0), 1.0) * (found.height_px - 1),
        )
        return self._pixels.point(pixel, found, tick.percept)
