"""A second pair of neck joints below the neck: gaze allows for the head's displacement."""

from collections.abc import Callable
from dataclasses import replace
from math import cos, degrees, radians, sin

import numpy as np
import pytest
from desk import LIDS
from expressive_rig import faults
from fakes.runs import ticks
from gaze_targets import joints_at

from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.gaze.angles import angle_between, norm, rotate, sub
from gazerig.gaze.field_of_view import head_in_space, line_of_sight
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.commands import Express, Jog, LookAt
from gazerig.robot.model.frames import PoseHistory
from gazerig.robot.model.kinematics import GeometryParams, Kinematics

LOWER = ("lower_neck_pitch", "lower_neck_yaw")
GEOMETRY = GeometryParams(170.0, 38.0, 55.0, lower_pitch_axis_height_mm=50.0)
TARGET = (1.0, 0.2, 0.25)


def rig_with_lower_neck() -> Rig:
    rig = load_rig("desk")
    lower = replace(rig.joints["neck_pitch"], id=30, min_deg=-30.0, max_deg=30.0)
    return replace(
        rig,
        geometry=GEOMETRY,
        joints={
            **rig.joints, "lower_neck_pitch": lower, "lower_neck_yaw": replace(lower, id=31),
        },
        expressions={"bow": {"lower_neck_pitch": -20.0, "lower_neck_yaw": 15.0}},
        expression_blend_s=1.0,
    )  # fmt: skip


def kinematics() -> Kinematics:
    return Kinematics(GEOMETRY, rig_with_lower_neck().joints, LIDS)


def test_the_lower_neck_carries_the_head() -> None:
    made, pitch = kinematics(), radians(-30.0)
    angles = (pitch if name == LOWER[0] else 0.0 for name in made.names)
    pose = made.forward(joints_at(*angles))
    # From the lower axis: 38 mm ahead and 120 + 55 mm up, pitched down by 30 deg.
    ahead, up = 0.038, 0.175
    assert pose.p_world_head_m == pytest.approx(
        (ahead * cos(pitch) - up * sin(pitch), 0.0, 0.05 + ahead * sin(pitch) + up * cos(pitch))
    )
    assert pose.head_rad == (0.0, 0.0, 0.0)
    assert head_in_space(pose) == pytest.approx((0.0, pitch, 0.0))
    assert pose.base_rad == (0.0, pitch)


@pytest.mark.parametrize("base", [(0.0, 0.0), (0.4, -0.3), (-0.2, 0.5)])
def test_a_neck_that_faces_a_point_leads_the_head_through_it(base: tuple[float, float]) -> None:
    made = kinematics()
    yaw, pitch = made.neck_angles_to(TARGET, base)
    R, p = made.head_pose((yaw, pitch, 0.0), base)
    assert angle_between(rotate(R, (1.0, 0.0, 0.0)), sub(TARGET, p)) < 1e-9


def test_poses_between_ticks_have_the_lower_neck_between() -> None:
    made = kinematics()
    poses = PoseHistory(made)
    poses.remember(0.0, (0.1, 0.0, 0.0), (0.0, 0.0))
    poses.remember(1.0, (0.1, 0.0, 0.0), (0.2, -0.4))
    R, p = poses.head_pose(0.25)
    wanted, at = made.head_pose((0.1, 0.0, 0.0), (0.05, -0.1))
    assert np.allclose(R, wanted) and p == pytest.approx(at)


def error_deg(tick: Tick) -> float:
    pose = tick.pose
    lines = (line_of_sight(pose, left=side) for side in (True, False))
    eyes = (pose.p_world_eye_left_m, pose.p_world_eye_right_m)
    return max(
        degrees(angle_between(line, sub(TARGET, eye)))
        for line, eye in zip(lines, eyes, strict=True)
    )


def test_the_eyes_stay_on_their_point_while_the_head_bows(
    started: Callable[[Rig], Assembly],
) -> None:
    rig = rig_with_lower_neck()
    assert faults(rig) == []
    made = started(rig)
    made.robot.command(LookAt(TARGET, stay=True))
    still = error_deg(ticks(made, 600)[-1])
    made.robot.command(Express("bow"))
    moving = ticks(made, 300)
    bowed = dict(zip(rig.names, map(degrees, moving[-1].joints.position_rad), strict=True))
    assert bowed["lower_neck_pitch"] == pytest.approx(-20.0, abs=0.5)
    assert bowed["lower_neck_yaw"] == pytest.approx(15.0, abs=0.5)
    worst = max(map(error_deg, moving))
    assert still < 0.2 and worst < 0.8, (still, worst)


def test_what_a_look_will_come_to_counts_the_bent_lower_neck(
    started: Callable[[Rig], Assembly],
) -> None:
    rig = rig_with_lower_neck()
    made = started(rig)
    made.robot.command(Express("bow"))
    ticks(made, 400)
    ticket = made.robot.command(LookAt(TARGET, stay=True))
    ticks(made, 1)
    reply = ticket.wait(0.0)
    assert reply is not None and reply.error_deg < 0.5, reply


def test_people_stay_where_they_are_when_the_lower_neck_turns_the_camera(
    started: Callable[[Rig], Assembly],
) -> None:
    """The emulated camera is carried by the servos, and frames are placed by what they measure."""
    rig = rig_with_lower_neck()
    made = started(rig)
    made.robot.command(Jog((("lower_neck_yaw", radians(15.0)),), stay=True))
    errors = []
    for tick in ticks(made, 700):
        if tick.percept is None or not tick.percept.faces or made.scene is None:
            continue
        seen = tick.percept.faces[0].p_world_m
        people = [one[0] for one in made.scene.people(tick.percept.captured_s)]
        errors.append(min(norm(sub(seen, at)) for at in people))
    assert len(errors) > 200 and max(errors) < 0.04, max(errors)
