"""A click in the camera image -> the point of the world that was clicked on."""

from collections.abc import Callable
from math import hypot, radians

import numpy as np

from gazerig.drivers.camera.depth_roi import depth_at
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import Detections
from gazerig.gaze.angles import add, angle_between, norm, rotate, scale, sub, unit
from gazerig.gaze.types import Percept, Vec3
from gazerig.robot.control.loop import Tick
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.intrinsics import intrinsics_of_lens, rays

NEAR_RAD = 0.12
"""A click within 7 deg of a person means something as far away as they are."""
USUAL_M = 1.5
"""Assumed distance of a thing without a measured one: across a desk and a step more."""

_PATCH = 0.03  # of the image's width, the square whose depth is read


class ClickToLook:
    """Knows the newest image and where the camera was when it was taken."""

    def __init__(
        self, mount: CameraMount, poses: PoseHistory, camera: Callable[[], CameraParams]
    ) -> None:
        self._mount = mount
        self._poses = poses
        self._camera = camera
        self._tick: Tick | None = None

    def update(self, tick: Tick) -> None:
        """Leave the newest tick; called by the loop."""
        self._tick = tick

    def point(self, x: float, y: float) -> Vec3 | None:
        """Return the point of the world at a place of the newest image, None without one.

        x, y: 0..1 from the left and from the top
        """
        tick = self._tick
        if tick is None or tick.detections is None:
            return None
        found = tick.detections
        pixel = (
            min(max(x, 0.0), 1.0) * (found.width_px - 1),
            min(max(y, 0.0), 1.0) * (found.height_px - 1),
        )
        R, p = self._mount.pose(*self._poses.head_pose(found.captured_s))
        x_ray, y_ray, z_ray = rays(np.array([pixel]), self._lens(found))[0].tolist()
        through = rotate(R, (x_ray, y_ray, z_ray))  # 1 m deep: depth is along the optical axis
        depth_m = _depth_m(found, pixel)
        if depth_m is not None:
            return add(p, scale(through, depth_m))
        way = unit(through)
        return add(p, scale(way, distance_m(tick.percept, p, way)))

    def _lens(self, found: Detections) -> Intrinsics:
        camera = self._camera()
        field_rad = radians(camera.horizontal_field_deg)
        size_px = found.width_px, found.height_px
        return intrinsics_of_lens(camera.lens, field_rad, *size_px, found.lens)


def distance_m(percept: Percept | None, p_world_m: Vec3, way_world: Vec3) -> float:
    """Return how far away a clicked thing counts as: as far as what is seen there.

    p_world_m, way_world: where the camera is and the unit direction of the click
    """
    near, best = USUAL_M, NEAR_RAD
    if percept is None:
        return near
    places = [face.p_world_m for face in percept.faces]
    places += [(float(x), float(y), float(z)) for x, y, z in percept.bodies.p_world_m]
    for place in places:
        there = sub(place, p_world_m)
        angle = angle_between(unit(there), way_world)
        if angle < best:
            near, best = norm(there), angle
    return near


def _depth_m(found: Detections, pixel: tuple[float, float]) -> float | None:
    """Read the depth image about a pixel of the camera image, None where it says nothing."""
    if found.depth_m is None:
        return None
    height, width = found.depth_m.shape[:2]
    x = pixel[0] * width / found.width_px
    y = pixel[1] * height / found.height_px
    side = max(3.0, _PATCH * hypot(width, height))
    box = (x - side / 2, y - side / 2, side, side)
    return depth_at(found.depth_m, box, shrink=1.0).distance_m
