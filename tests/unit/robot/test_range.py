"""Range of what has no measured depth, and what perception costs a picture."""

import sys
from math import cos, pi, radians, sin, tan
from types import FrameType

import numpy as np
import pytest
from numpy.typing import NDArray
from seeing.row_09_identities import FIELD_DEG, RATE_HZ, SIZE, detected, perception
from stand_in import StandIn

from gazerig.drivers.types import DetectedFace, Detections, MovingBlob
from gazerig.gaze.angles import norm, sub
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.perception import Perception

ASSUMED_M, ASSUMED_SD_M = 2.0, 1.0


class _Neck(StandIn):
    """A head that turns about a point 10 cm behind and below its camera."""

    def head_pose(self, head_rad: tuple[float, float, float]) -> tuple[Mat3, Vec3]:
        c, s = cos(head_rad[0]), sin(head_rad[0])
        return ((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)), (0.1 * c, 0.1 * s, 0.1)


def still_thing(noise_deg: float, swings: bool, pictures: int, seed: int) -> NDArray[np.float64]:
    """Return the range over the assumed one, picture by picture, of a stationary thing.

    Args:
        noise_deg: standard deviation of its direction on each axis, cut off at the picture's edge.
        swings: the camera turns by 20 deg to both sides, and so moves by 7 cm.
        pictures: how many.
        seed: of the noise.
    """
    mount = CameraMount(CameraParams(position_mm=(0.0, 0.0, 0.0)))
    perception = Perception(mount, FIELD_DEG)
    poses, rng, found = PoseHistory(_Neck()), np.random.default_rng(seed), []
    true = np.array([ASSUMED_M, 0.0, 0.1])
    for k in range(1, pictures + 1):
        t_s = k / RATE_HZ
        yaw = radians(20.0) * sin(2.0 * pi * 0.3 * t_s) if swings else 0.0
        poses.remember(t_s, (yaw, 0.0, 0.0))
        R, p = mount.pose(*poses.head_pose(t_s))
        x, y, z = np.array(R).T @ (true - p)
        off = np.clip(rng.normal(0.0, noise_deg, 2), -30.0, 30.0)
        ray = np.array([x / z + tan(radians(off[0])), y / z + tan(radians(off[1])), 1.0])
        p_camera = ASSUMED_M * ray / np.linalg.norm(ray)
        blob = MovingBlob(
            1, "thing", tuple(p_camera.tolist()), 0.05, depth_known=False,
            depth_sd_m=ASSUMED_SD_M, box_px=(0.0, 0.0, 20.0, 20.0),
        )  # fmt: skip
        percept = perception.see(Detections(t_s, k, *SIZE, blobs=(blob,)), poses)
        assert percept is not None and len(percept.bodies) == 1, "it was taken for several"
        believed = norm(sub(tuple(percept.bodies.p_world_m[0].tolist()), p))
        found.append(believed / ASSUMED_M)
    return np.array(found)


def crowd(people: int, count: int) -> list[Detections]:
    """Return pictures of people who sway, located in the camera's axes as its process does."""
    rng, locate = np.random.default_rng(0), FrameLocator(None, np.radians(FIELD_DEG))
    out = []
    for number in range(1, count + 1):
        faces: list[DetectedFace] = []
        for k in range(people):
            row, column = divmod(k, 5)
            x = 0.42 * (column - 2) + 0.1 * np.sin(2.0 * number / RATE_HZ + k)
            faces.append(detected(np.array([x, 0.35 * (row - 1.5), 2.4 + 0.1 * row]), rng))
        found = Detections(number / RATE_HZ, number, *SIZE, faces=tuple(faces))
        out.append(found.locate_in_camera(locate))
    return out


def calls(see: Perception, poses: object, found: Detections) -> int:
    """Return how many functions of Python a picture takes: the same on every computer."""
    counted = 0

    def count(frame: FrameType, event: str, arg: object) -> None:
        nonlocal counted
        counted += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        see.see(found, poses)  # type: ignore[arg-type]
    finally:
        sys.setprofile(before)
    return counted


@pytest.mark.parametrize("swings", [False, True])
@pytest.mark.parametrize("noise_deg", (1.0, 2.0, 3.0))
def test_e81_range_stays_as_assumed_whatever_the_direction_does(noise_deg, swings):
    ratios = still_thing(noise_deg, swings, 150, seed=1)
    assert ratios.min() >= 0.95 and ratios.max() <= 1.05


def test_e84_what_a_crowd_costs_is_bounded():
    """Counted, not timed: all pairs are judged, each by some twenty calls of built-in functions."""
    counts = {}
    for people in (1, 6, 20):
        see, poses = perception()
        counts[people] = [calls(see, poses, found) for found in crowd(people, 12)][-1]
    # Each takes a share of a microsecond.
    assert counts[1] < 400 and counts[6] < 2500 and counts[20] < 10000
