"""Conversion of a pixel of a camera frame to a point in the world."""

from collections.abc import Callable
from math import hypot, radians

from gazerig.drivers.camera.depth_roi import depth_at
from gazerig.drivers.types import Detections
from gazerig.gaze.angles import add, angle_between, norm, rotate, scale, sub, unit
from gazerig.gaze.types import Percept, Vec3, vec
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.intrinsics import intrinsics_of_lens, rays

NEAR_RAD = 0.12
"""A pixel within this angle (7 deg) of a person gets the person's distance."""
USUAL_M = 1.5
"""Assumed distance of an unknown thing: across a desk, plus one step."""

_PATCH = 0.03  # side of the square whose depth is read, as a fraction of the frame's width


class PixelToWorld:
    """Locates pixels by the lens, the camera's mount and the head's pose at the exposure.

    Args:
        mount: position and orientation of the camera on the head.
        poses: history of the head's pose.
        camera: returns the present lens.
    """

    def __init__(
        self, mount: CameraMount, poses: PoseHistory, camera: Callable[[], CameraParams]
    ) -> None:
        self._mount, self._poses, self._camera = mount, poses, camera

    def point(
        self,
        pixel: tuple[float, float],
        found: Detections,
        percept: Percept | None,
        distance_m: float | None = None,
        captured_s: float | None = None,
    ) -> Vec3:
        """Return the point of the world at a pixel, in metres.

        Args:
            pixel: (x, y) relative to the centre of the upper left pixel, x right, y down.
            found: the newest frame, whose size and lens are used.
            percept: its percept, for the distance of a pixel next to a person.
            distance_m: distance from the camera; None: the measured depth at the pixel, or that of
                a nearby person or thing.
            captured_s: exposure of the frame with the pixel; None: that of the newest frame.
        """
        at_s = found.captured_s if captured_s is None else captured_s
        R, p = self._mount.pose(*self._poses.head_pose(at_s))
        camera, size_px = self._camera(), (found.width_px, found.height_px)
        field_rad = radians(camera.horizontal_field_deg)
        lens = intrinsics_of_lens(camera.lens, field_rad, *size_px, found.lens)
        through = rotate(
            R, vec(rays([pixel], lens)[0])
        )  # 1 m deep: depth is along the optical axis
        depth_m = (
            _depth_m(found, pixel) if at_s == found.captured_s and distance_m is None else None
        )
        if depth_m is not None:
            return add(p, scale(through, depth_m))
        direction = unit(through)
        if distance_m is None:
            distance_m = seen_distance_m(percept, p, direction)
        return add(p, scale(direction, distance_m))


def seen_distance_m(percept: Percept | None, p_world_m: Vec3, direction_world: Vec3) -> float:
    """Return the distance of the person or thing at a pixel.

    Args:
        percept: percept of the frame.
        p_world_m: position of the camera.
        direction_world: unit vector through the pixel.
    """
    near, best = USUAL_M, NEAR_RAD
    if percept is None:
        return near
    places = [face.p_world_m for face in percept.faces]
    places += map(vec, percept.bodies.p_world_m)
    for place in places:
        there = sub(place, p_world_m)
        angle = angle_between(unit(there), direction_world)
        if angle < best:
            near, best = norm(there), angle
    return near


def _depth_m(found: Detections, pixel: tuple[float, float]) -> float | None:
    """Return the measured depth around a pixel of the camera frame, None without one."""
    if found.depth_m is None:
        return None
    height, width = found.depth_m.shape[:2]
    side = max(3.0, _PATCH * hypot(width, height))
    box = (pixel[0] - side / 2, pixel[1] - side / 2, side, side)
    return depth_at(found.depth_m, box, shrink=1.0).distance_m
