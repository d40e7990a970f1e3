"""Where in the frames of a film the measured eyes look."""

from math import radians

import numpy as np

from gazerig.gaze.angles import add, norm, scale, sub
from gazerig.gaze.types import Vec3
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.control.tick import Tick, cyclopean_direction
from gazerig.robot.model.intrinsics import intrinsics_of_lens, project


def gaze_point(tick: Tick) -> Vec3:
    """Return the point of the measured gaze, at the distance of its target."""
    left, right = tick.pose.p_world_eye_left_m, tick.pose.p_world_eye_right_m
    eye = scale(add(left, right), 0.5)
    return add(eye, scale(cyclopean_direction(tick), norm(sub(tick.target.p_world_m, eye))))


def in_picture(made: Assembly, point: Vec3, width_px: int, height_px: int) -> tuple[float, float]:
    """Return the pixel of a point of the world in the film, whose camera is stationary."""
    ahead = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    R, p = made.mount.pose(ahead, (0.0, 0.0, 0.0))
    lens = intrinsics_of_lens(None, radians(made.horizontal_field_deg), width_px, height_px)
    seen = np.array(R).T @ np.array(sub(point, p))
    x, y = project(seen[None], lens)[0].tolist()
    return x, y
