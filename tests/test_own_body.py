"""The robot's own head in the view of its camera: distinguished from hands by the kinematics."""

from math import radians

import numpy as np
import pytest

from gazerig.config.schema import load_rig
from gazerig.drivers.types import Detections, MovingBlob
from gazerig.gaze.angles import norm, rotate_back, sub
from gazerig.gaze.attention.persons import Persons
from gazerig.gaze.types import Bodies, Percept, Vec3
from gazerig.robot.app.gaze_models import rig_kinematics
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.kinematics import Capsule
from gazerig.robot.model.tracker_params import TrackerParams
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.tracker import Tracker

NECK = rig_kinematics(load_rig("desk"))
BEHIND: Vec3 = (-0.5, 0.0, 0.12)
"""A camera on the base, behind the head, that sees it from the back."""


def kind_of(
    p_world_m: Vec3, *, yaw_deg: float = 0.0, depth_known: bool = False, camera_m: Vec3 = BEHIND,
    mount: str = "base", kind: str = "thing",
) -> str:  # fmt: skip
    """Return what a moving patch is called whose middle is seen in the direction of a place."""
    mm = tuple(1e3 * x for x in camera_m)
    placed = CameraMount(CameraParams(mount=mount, position_mm=mm))  # type: ignore[arg-type]
    own = NECK.body_volumes
    perception = Perception(placed, 69.0, Tracker(TrackerParams()), own_parts=own)
    poses = PoseHistory(NECK)
    poses.remember(0.0, (radians(yaw_deg), 0.0, 0.0))
    R, p = placed.pose(*poses.head_pose(0.0))
    way = rotate_back(R, sub(p_world_m, p))
    far = 1.0 if depth_known else 2.0 / norm(way)
    at = (far * way[0], far * way[1], far * way[2])
    blob = MovingBlob(4, kind, at, 0.05, depth_known=depth_known, depth_sd_m=0.02)
    percept = perception.see(Detections(0.0, 1, 640, 400, blobs=(blob,)), poses)
    assert percept is not None
    return percept.bodies.kinds[0]


def test_e93_the_own_head_seen_from_behind_is_own_wherever_it_turns() -> None:
    for yaw_deg in (-70.0, 0.0, 40.0):
        _, p_head = NECK.head_pose((radians(yaw_deg), 0.0, 0.0))
        assert kind_of(p_head, yaw_deg=yaw_deg) == "own"
    assert kind_of((0.0, 0.0, 0.03)) == "own"  # the neck
    assert kind_of(p_head, kind="hand") == "hand"  # what a detector has named is that


def test_what_is_beside_it_or_measured_before_or_behind_it_is_not() -> None:
    _, p_head = NECK.head_pose((0.0, 0.0, 0.0))
    aside = (p_head[0], p_head[1] + 0.09, p_head[2])
    assert kind_of(aside) == "thing"
    assert kind_of(aside, yaw_deg=0.0, depth_known=True) == "thing"
    assert kind_of(p_head, depth_known=True) == "own"
    before, behind = ((x, 0.0, 0.12) for x in (-0.3, 1.0))
    assert kind_of(before, depth_known=True) == kind_of(behind, depth_known=True) == "thing"


def test_a_camera_inside_the_head_sees_none_of_it() -> None:
    ahead = (1.0, 0.1, 0.1)
    assert kind_of(ahead, camera_m=(0.02, 0.0, 0.045), mount="head") == "thing"


@pytest.mark.parametrize("seed", range(20))
def test_a_ray_meets_a_capsule_where_steps_along_it_do(seed: int) -> None:
    rng = np.random.default_rng(seed)
    start, end, eye = (tuple(rng.uniform(-1.0, 1.0, 3).tolist()) for _ in range(3))
    part = Capsule(start, end, float(rng.uniform(0.05, 0.4)))
    if part.contains(eye):
        return
    aim = np.add(start, end) * 0.5 + rng.normal(0.0, 0.3, 3) - eye
    way = aim / np.linalg.norm(aim)
    steps = np.arange(0.0, 5.0, 0.002)
    inside = [part.contains(tuple(np.add(eye, s * way).tolist())) for s in steps]
    hit = part.hit_m(eye, tuple(way.tolist()))
    assert (hit is not None) == any(inside) or sum(inside) < 20
    if hit is not None:  # of the sphere about the nearest point: not before the capsule itself
        assert steps[int(np.argmax(inside))] - 0.01 <= hit + 0.01


def test_the_own_body_waves_to_nobody() -> None:
    for kind, named in (("own", frozenset[int]()), ("thing", frozenset({1}))):
        persons = Persons()
        for k in range(60):
            v = np.zeros((2, 3))
            v[1, 1] = 0.8 * np.cos(2 * np.pi * 1.5 * k / 30)
            places = np.array([(1.0, 0.0, 0.2), (0.9, 0.3, 0.2)])
            seen = Bodies((1, 2), ("face", kind), places, v, np.zeros((2, 3)), np.full(2, 0.1))
            persons.update(Percept(k / 30, seen), (0.0, 0.0, 0.1))
        assert persons.ids_with_trait("waving") == named
