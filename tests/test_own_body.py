"""The robot's own head in the view of its camera: distinguished from hands by the kinematics."""

from functools import cache
from math import radians

from gazerig.config.schema import load_rig
from gazerig.drivers.types import Detections, MovingBlob
from gazerig.gaze.angles import norm, rotate_back, sub
from gazerig.gaze.types import Vec3
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.kinematics import Kinematics
from gazerig.robot.perception.perception import Perception
from gazerig.robot.run.models import rig_kinematics

BEHIND: Vec3 = (-0.5, 0.0, 0.12)
"""A camera on the base, behind the head, that sees it from the back."""


@cache
def neck() -> Kinematics:
    return rig_kinematics(load_rig("desk"))


def kind_of(
    p_world_m: Vec3, *, yaw_deg: float = 0.0, depth_known: bool = False, camera_m: Vec3 = BEHIND,
    mount: str = "base", kind: str = "thing",
) -> str:  # fmt: skip
    """Return what a moving patch is called whose middle is seen in the direction of a place."""
    mm = tuple(1e3 * x for x in camera_m)
    placed = CameraMount(CameraParams(mount=mount, position_mm=mm))  # type: ignore[arg-type]
    own = neck().body_volumes
    perception = Perception(placed, 69.0, own_parts=own)
    poses = PoseHistory(neck())
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
        _, p_head = neck().head_pose((radians(yaw_deg), 0.0, 0.0))
        assert kind_of(p_head, yaw_deg=yaw_deg) == "own"
    assert kind_of((0.0, 0.0, 0.03)) == "own"  # the neck
    assert kind_of(p_head, kind="hand") == "hand"  # what a detector has named is that


def test_what_is_beside_it_or_measured_before_or_behind_it_is_not() -> None:
    _, p_head = neck().head_pose((0.0, 0.0, 0.0))
    aside = (p_head[0], p_head[1] + 0.09, p_head[2])
    assert kind_of(aside) == "thing"
    assert kind_of(aside, yaw_deg=0.0, depth_known=True) == "thing"
    assert kind_of(p_head, depth_known=True) == "own"
    before, behind = ((x, 0.0, 0.12) for x in (-0.3, 1.0))
    assert kind_of(before, depth_known=True) == kind_of(behind, depth_known=True) == "thing"


def test_a_camera_inside_the_head_sees_none_of_it() -> None:
    ahead = (1.0, 0.1, 0.1)
    assert kind_of(ahead, camera_m=(0.02, 0.0, 0.045), mount="head") == "thing"
