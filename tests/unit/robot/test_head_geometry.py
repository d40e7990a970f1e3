"""Geometry of head and cameras, and servos that move two joints, in numbers computed by hand."""

from dataclasses import replace
from math import asin, atan, atan2, cos, pi, radians, sin
from typing import Any

import numpy as np
import pytest
from desk import GAZE_JOINTS
from gaze_targets import joints_at
from text_table import rows

from gazerig.gaze.types import GazeCommand, Vec3
from gazerig.robot.model.coupling import (
    CouplingParams,
    find_far_outside,
    servo_setups,
    unreachable_text,
)
from gazerig.robot.model.frames import (
    CameraMount,
    CameraParams,
    LensParams,
    MountedOn,
    PoseHistory,
    fixed_mount,
    quaternion,
)
from gazerig.robot.model.intrinsics import lens_fault
from gazerig.robot.model.joint import JointLimit, JointParams
from gazerig.robot.model.kinematics import GeometryParams, Kinematics, gaze_error

LIDS = {
    "left_upper_lid": (-0.5, 0.5),
    "right_upper_lid": (0.25, -0.25),
    "left_lower_lid": (0.0, 0.5),
    "right_lower_lid": (0.0, -1.0),
}
ALL = (*GAZE_JOINTS, "left_lower_lid", "right_lower_lid", "jaw")
HEAD = Kinematics(GeometryParams(60.0, 40.0, 50.0, 60.0), ALL, LIDS)
ONE = Kinematics(GeometryParams(60.0, 40.0, 50.0, 60.0), ("eyes_pan", "eyes_tilt"), {})


def turns(row: list[float]) -> Vec3:
    yaw, pitch, roll = map(radians, row)
    return yaw, pitch, roll


AHEAD = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
LEFT = turns([90.0, 0.0, 0.0])


PLACES = """
# yaw, pitch and roll in deg, place between the eyes
0   0   0   |  0.04   0      0.11
90  0   0   |  0      0.04   0.11
0   90  0   | -0.05   0      0.10
0   0   90  |  0.04  -0.05   0.06
90  90  0   |  0     -0.05   0.10
"""


@pytest.mark.parametrize("row", rows(PLACES))
def test_a_head_turns_about_its_pivot(row):
    head, place = turns(row[:3]), row[3:]
    R, p = HEAD.head_pose(head)
    assert p == pytest.approx(place) and HEAD.pivot_m(R, p) == pytest.approx((0.0, 0.0, 0.06))
    eyes = HEAD.forward(joints_at((*[0.0] * 8, *head, 0.0)))
    aside = np.array(R)[:, 1] * 0.03
    assert eyes.p_world_eye_left_m == pytest.approx(np.array(place) + aside)
    assert eyes.p_world_eye_right_m == pytest.approx(np.array(place) - aside)


def test_every_joint_has_its_place_in_the_pose_and_back():
    rates = tuple(0.01 * k for k in range(12))
    command = GazeCommand(
        (0.7, 0.6, 0.5), (0.1, 0.2), (0.3, -0.4), 0.25, 0.75, "fixate", False, (1.0, 0.0, 0.0),
        0, 0, 0, 0.5, 0.125,
    )  # fmt: skip
    angles = (0.1, 0.2, 0.3, -0.4, -0.25, -0.125, 0.25, -0.125, 0.7, 0.6, 0.5)
    assert HEAD.inverse(command) == (*angles, 0.0) and HEAD.inverse(command, (9.0,))[-1] == 9.0
    assert ONE.inverse(command) == pytest.approx((0.2, -0.1))
    pose = HEAD.forward(joints_at((*angles, 9.0), velocity_rad_s=rates))
    assert pose.head_rad == command.head_rad and pose.head_rate_rad_s == rates[8:11]
    assert (pose.eye_left_rad, pose.eye_right_rad) == ((0.1, 0.2), (0.3, -0.4))
    assert (pose.lid_left, pose.lid_right) == (0.25, 0.75)
    assert (pose.lower_left, pose.lower_right) == (0.5, 0.125)
    wide = HEAD.forward(joints_at((0.0,) * 4 + (-9.0, -9.0, 9.0, np.nan) + (0.0,) * 4))
    assert (wide.lid_left, wide.lid_right, wide.lower_left, wide.lower_right) == (0, 1, 1, 0)
    pose = ONE.forward(joints_at((0.2, -0.1)))
    assert (pose.eye_left_rad, pose.eye_right_rad) == ((0.2, -0.1), (0.2, -0.1))
    assert (pose.lid_left, pose.lid_right, pose.lower_left, pose.lower_right) == (1, 1, 1, 1)
    assert (pose.head_rad, pose.head_rate_rad_s) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


SIGHTS = """
# head in deg; point; tangents of both eyes to the left and up, these over the level distance
0   0   0   |  0.10   0.03  0.11  |  0  0                | 1  0
0   0   0   |  0.10  -0.03  0.17  | -1  0.70710678118655 | 0  1
90  0   0   | -0.03   0.10  0.11  |  0  0                | 1  0
0   90  0   | -0.05   0.03  0.16  |  0  0                | 1  0
0   90  0   | -0.11   0.03  0.16  |  0  1                | 1  0.70710678118655
0   0   90  |  0.10  -0.05  0.09  |  0  0                | 1  0
0   0   90  |  0.10  -0.11  0.09  |  0  1                | 1  0.70710678118655
"""


@pytest.mark.parametrize("row", rows(SIGHTS))
def test_each_eye_has_its_own_angles_to_a_point(row):
    R, p = HEAD.head_pose(turns(row[:3]))
    point, (a, b, c, d) = (row[3], row[4], row[5]), map(atan, row[6:])
    assert HEAD.eye_angles_to(point, R, p) == (pytest.approx((a, b)), pytest.approx((c, d)))
    both = pytest.approx((0.5 * (a + c), 0.5 * (b + d)))
    assert ONE.eye_angles_to(point, R, p) == (both, both)


def test_eyes_on_one_linkage_take_the_shorter_arc():
    for side in (1.0, -1.0):
        (pan, _), _ = ONE.eye_angles_to((-0.06, side * 0.01, 0.11), *ONE.head_pose((0.0, 0.0, 0.0)))
        # To both sides of straight behind: 0.02 and 0.04 m aside of 0.1 m.
        inner, outer = pi - atan2(0.04, 0.1), -(pi - atan2(0.02, 0.1))
        assert pan == pytest.approx(side * (0.5 * (inner + outer) + pi))


def test_a_neck_turns_to_a_point_by_the_height_of_its_arm():
    assert HEAD.neck_angles_to((3.0, 4.0, 0.06)) == pytest.approx((atan2(4, 3), -asin(0.01)))
    assert HEAD.neck_angles_to((0.3, 0.0, 0.46)) == pytest.approx((0.0, atan2(4, 3) - asin(0.1)))
    assert HEAD.neck_angles_to((0.03, 0.0, 0.10)) == pytest.approx((0.0, atan2(4, 3)))
    assert HEAD.neck_angles_to((0.0, 0.0, 0.1100001))[1] == pytest.approx(0.0, abs=2e-3)
    assert (
        HEAD.convergence_rad(0.3) == pytest.approx(atan2(0.1, 1.0))
        and ONE.convergence_rad(0.3) == 0.0
    )


def test_the_error_of_a_gaze_is_that_of_its_worse_eye():
    pose = HEAD.forward(joints_at((0.1, 0.0, 0.0, 0.0, *[0.0] * 8)))
    point = (2000.04, 0.0, 0.11)
    assert gaze_error(point, pose) == pytest.approx(0.1, abs=1e-4)
    assert gaze_error(point, pose, converges=False) == pytest.approx(0.05, abs=1e-4)


QUATERNIONS = """
0.7 0.1 -0.5 0.5,  0.1 0.7 0.5 -0.5,  0.1 -0.5 0.7 0.5,  0.1 0.5 -0.5 0.7
1 0 0 0,  0 1 0 0,  0 0 1 0,  0 0 0 1
"""


@pytest.mark.parametrize("q", rows(QUATERNIONS.replace(",", "\n")))
def test_a_rotation_is_its_quaternion(q):
    w, x, y, z = q
    R = (
        (1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)),
        (2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)),
        (2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)),
    )
    assert quaternion(R) == pytest.approx(q)


# Cameras and lenses


TURNS = """
# yaw, pitch, roll; where ahead and the right side of its pictures are then
0  0  0  | 1 0 0 | 0 -1 0
90 0  0  | 0 1 0 | 1 0 0
0  90 0  | 0 0 1 | 0 -1 0
0  0  90 | 1 0 0 | 0 0 -1
"""


@pytest.mark.parametrize("row", rows(TURNS))
def test_a_camera_is_turned_left_up_and_right_side_down(row):
    yaw, pitch, roll = row[:3]
    ahead, right = row[3:6], row[6:]
    R_left, p = HEAD.head_pose(LEFT)
    mounts: tuple[MountedOn, ...] = ("head", "base")
    for name in mounts:
        params = CameraParams(name, (10.0, 20.0, 30.0), yaw, pitch, roll_deg=roll)
        mount = CameraMount(params)
        R, place = mount.pose(R_left, p)
        assert mount.rotation(R_left) == R and mount.on_head == (name == "head")
        turn = np.array(R_left if name == "head" else AHEAD)
        assert np.array(R)[:, 2] == pytest.approx(turn @ ahead, abs=1e-12)
        assert np.array(R)[:, 0] == pytest.approx(turn @ right, abs=1e-12)
        assert place == pytest.approx(((-0.02, 0.05, 0.14), (0.01, 0.02, 0.03))[name == "base"])
    assert fixed_mount(params, HEAD) is params
    still = fixed_mount(replace(params, mount="head"), HEAD)
    assert still.position_mm == pytest.approx((50.0, 20.0, 140.0))
    assert still == replace(params, mount="base", position_mm=still.position_mm)


def test_nothing_is_looked_at_within_ignored_directions():
    mount = CameraMount(CameraParams(ignore_deg=((90, 99, 0, 9), (-10.0, 20.0, -5.0, 15.0))))
    edges = "0 0 1, -9.9 0 1, -10.1 0 0, 19.9 0 1, 20.1 0 0, 0 -4.9 1, 0 -5.1 0, 0 14.9 1, 0 15.1 0"
    for yaw, pitch, ignored in rows(edges.replace(",", "\n")):
        a, b = radians(yaw), radians(pitch)
        assert mount.is_ignored((cos(b) * cos(a), cos(b) * sin(a), sin(b))) == ignored
        assert not CameraMount(CameraParams()).is_ignored((1.0, 0.0, 0.0))


def test_past_poses_are_interpolated_and_told():
    told: list[tuple[float, Any]] = []
    poses = PoseHistory(HEAD, lambda *entry: told.append(entry))
    with pytest.raises(LookupError, match="no pose"):
        poses.head_pose(0.0)
    for k in range(601):
        poses.remember(float(k), (0.5 * k, -1.0 * k, 0.25 * k), AHEAD if k else None)
    assert told[0] == (0.0, HEAD.head_pose((0.0, 0.0, 0.0))[0]) and told[1] == (1.0, AHEAD)
    for t_s, share in ((-1.0, 1.0), (0.5, 1.0), (1.0, 1.0), (2.25, 2.25), (600, 600), (700, 600)):
        angles = (0.5 * share, -share, 0.25 * share)
        assert poses.angles(t_s) == angles and poses.head_pose(t_s) == HEAD.head_pose(angles)


LENSES = """
# size and centre of the measured pictures; size of others; what is said
640 400  319.5 199.5   640 400  -
640 400  319.5 199.5   646 400  -
640 400  319.5 199.5   634 400  -
640 400  319.5 199.5   647 400  it was measured on 640 x 400, images are 647 x 400
640 400  319.5 199.5   633 400  it was measured on 640 x 400, images are 633 x 400
640 400  319.5 199.5   0   400  images are 0 x 400
640 400  319.5 199.5   1   0    images are 1 x 0
16  16   8     8       1   1    -
640 400  799   200     640 400  -
640 400  -161  200     640 400  its axis at -161, 200 px is far outside images of 640 x 400
640 400  320   499     640 400  -
640 400  320   501     640 400  its axis at 320, 501 px is far outside images of 640 x 400
"""


@pytest.mark.parametrize("row", [line.split(maxsplit=6) for line in LENSES.splitlines()[2:]])
def test_a_lens_that_does_not_fit_says_why(row):
    wide, high, width, height = (int(row[i]) for i in (0, 1, 4, 5))
    lens = LensParams((wide, high), (480.0, 490.0), (float(row[2]), float(row[3])))
    assert (lens_fault(lens, width, height) or "-") == row[6]


# Joints, linkages and coupled servos


DEG = 4096.0 / 360.0


PITCH = JointParams(1, "xl330-m077", -30.0, 20.0, 100.0, 1000.0)
ROLL = JointParams(2, "xl330-m077", -10.0, 10.0, 50.0, 400.0, sign=-1, ratio=2.0, zero_step=2000)
NECK = CouplingParams("neck_pitch", "neck_roll", 1.5, 2.0)
BOTH = {"neck_pitch": PITCH, "neck_roll": ROLL}


def test_both_servos_of_a_pair_have_the_range_and_pace_of_both_joints():
    assert NECK.servo_rad((1.0, 0.25)) == (2.0, 1.0) and NECK.joint_rad((2.0, 1.0)) == (1.0, 0.25)
    assert NECK.rates == ((1.5, 2.0), (1.5, -2.0))
    found = servo_setups(BOTH, {"neck_pitch": 0.1}, 20.0, [NECK])
    one, other = found
    # Shafts: -45 - 20 to 30 + 20 deg.
    assert (one.min_steps, one.max_steps) == (2048 - int(65 * DEG), 2048 + int(50 * DEG))
    assert (other.min_steps, other.max_steps) == (
        2000 - int(100 * DEG), 2000 + int(130 * DEG)
    )  # fmt: skip
    for servo, ratio in ((one, 1.0), (other, 2.0)):
        assert servo.max_speed_steps_s == pytest.approx(250.0 * DEG * ratio)
        assert servo.max_accel_steps_s2 == pytest.approx(2300.0 * DEG * ratio)
        assert servo.entry_speed_steps_s == pytest.approx(2.0 * 20.0 * DEG * ratio)
        assert servo.far_steps / (2.0 * ratio) == pytest.approx(PITCH.setup().far_steps)
        assert servo.rest_steps is None


def test_a_pair_that_cannot_reach_a_corner_says_so():
    assert unreachable_text(NECK, BOTH) is None
    wide = {**BOTH, "neck_roll": replace(ROLL, min_deg=-70.0)}
    assert unreachable_text(NECK, wide) == (
        "cannot reach neck_pitch -30, neck_roll -70 deg: the servo of neck_pitch would be at -57, "
        "outside the servo's 0..4095 steps"
    )


def test_joints_far_outside_are_named():
    at = {"neck_pitch": 2048 + 45.1 * DEG, "neck_roll": 2000.0 - 2 * 45.0 * DEG, "jaw": 2048.0}
    joints = {**BOTH, "jaw": PITCH}
    # Shafts at 45 deg: the first joint at 30, the second at 0.
    found = find_far_outside(joints, [NECK], at)
    assert list(found) == ["neck_pitch"]
    assert found["neck_pitch"].startswith("is at 30 deg, 10 deg outside its range -30..20 deg: ")
    assert not find_far_outside(joints, [NECK], {**at, "neck_pitch": 2048 + 44.9 * DEG})
    assert find_far_outside(joints, [NECK], {"neck_roll": 0.0, "jaw": 2048 - 61.0 * DEG}) == {
        "jaw": found["neck_pitch"].replace("30 deg, 10", "-61 deg, 31")
    }


def test_limits_are_reduced_to_those_of_the_servo():
    reach = JointLimit(-1.0, 2.0, 3.0, 4.0)
    assert JointLimit(-9.0, 9.0, 9.0, 9.0).reduced_to(reach) == reach._replace(accel_rad_s2=9.0)
    small = JointLimit(-0.5, 0.5, 1.0, 1.0)
    assert small.reduced_to(reach) == small
    assert JointLimit(5.0, 6.0, 1.0, 1.0).reduced_to(reach)[:2] == (2.0, 2.0)
    assert JointLimit(-6.0, -5.0, 1.0, 1.0).reduced_to(reach)[:2] == (-1.0, -1.0)
