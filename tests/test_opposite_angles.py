"""The eyes of Nakamoto & Tsuruno 3.4, which the profile nakamoto runs."""

from math import degrees, radians

import pytest

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import angle_between, sub
from gazerig.gaze.oculomotor.binocular import EyeGeometry, Eyes, OppositeAngles
from gazerig.gaze.types import Angles3, Target, Vec3
from gazerig.robot.app.gaze_models import rig_kinematics

POINT: Vec3 = (1.0, 0.0, 0.125)
TARGET = Target(POINT, (0.0, 0.0, 0.0), 0.0, "face", 1, 0.5, True, "N", 1, "a face")
LIMIT_RAD = radians(20.0)


class Saccades:
    is_saccade_due = is_correction_due = False


def in_range(eyes: Eyes) -> Eyes:
    left, right = (tuple(min(max(a, -LIMIT_RAD), LIMIT_RAD) for a in eye) for eye in eyes)
    return (left[0], left[1]), (right[0], right[1])


def view(head_deg: Angles3) -> EyeGeometry:
    yaw, pitch, roll = head_deg
    kinematics = rig_kinematics(load_rig("desk"))
    R, p = kinematics.head_pose((radians(yaw), radians(pitch), radians(roll)))
    return EyeGeometry(R, p, kinematics.eye_angles_to, in_range)


def stand(model: OppositeAngles, head_deg: Angles3, gaze: Vec3 = POINT) -> tuple[Eyes, Vec3]:
    return model.fixate(TARGET, gaze, None, Saccades(), view(head_deg), 0.0, 0.005)


def off_deg(gaze: Vec3, head_deg: Angles3) -> float:
    p_head = view(head_deg).p_head
    return degrees(angle_between(sub(gaze, p_head), sub(POINT, p_head)))


def test_e31_opposite_angles_hold_the_gaze_through_a_turn_about_one_axis() -> None:
    model = OppositeAngles()
    (before, _), gaze = stand(model, (0.0, 0.0, 0.0))
    for yaw in range(1, 16):
        (left, _), gaze = stand(model, (float(yaw), 0.0, 0.0))
    assert degrees(left[0] - before[0]) == pytest.approx(-15.0, abs=1e-6)
    # The eyes sit ahead of the neck: that, and nothing of the turn, is left.
    assert off_deg(gaze, (15.0, 0.0, 0.0)) < 1.0


def test_e31_of_a_turn_about_two_axes_they_leave_what_the_paper_does_not_say() -> None:
    model = OppositeAngles()
    stand(model, (0.0, 0.0, 0.0))
    for step in range(1, 41):
        _, gaze = stand(model, (step * 1.0, step * 0.5, 0.0))
    assert 3.0 < off_deg(gaze, (40.0, 20.0, 0.0)) < 7.0  # 5.1 of the rule, and the eyes' shift


def test_an_eye_turns_in_a_shift_alone() -> None:
    model, head = OppositeAngles(), view((0.0, 0.0, 0.0))
    stood, _ = stand(model, (0.0, 0.0, 0.0))
    assert stand(model, (0.0, 0.0, 0.0), (1.0, 0.2, 0.2))[0] == stood
    wanted = head.eyes_to((1.0, 0.2, 0.2))
    turned, gaze = model.fixate(TARGET, (1.0, 0.2, 0.2), wanted, Saccades(), head, 0.0, 0.005)
    assert (turned, gaze) == (wanted, (1.0, 0.2, 0.2))
    assert stand(model, (0.0, 0.0, 0.0))[0] == wanted


def test_beyond_its_range_an_eye_is_not_turned_but_the_reflex_goes_on() -> None:
    model, far = OppositeAngles(), (1.0, 0.6, 0.125)
    stood, _ = stand(model, (0.0, 0.0, 0.0))
    head = view((0.0, 0.0, 0.0))
    held, _ = model.fixate(TARGET, far, head.eyes_to(far), Saccades(), head, 0.0, 0.005)
    assert held == stood
    head = view((5.0, 0.0, 0.0))
    (left, _), _ = model.fixate(TARGET, far, head.eyes_to(far), Saccades(), head, 0.0, 0.005)
    assert degrees(left[0] - stood[0][0]) == pytest.approx(-5.0, abs=1e-6)
    head = view((20.0, 0.0, 0.0))  # now it is near enough
    wanted = head.eyes_to(far)
    assert model.fixate(TARGET, far, wanted, Saccades(), head, 0.0, 0.005)[0] == wanted


def test_eyes_that_begin_out_of_range_begin_straight() -> None:
    eyes, _ = stand(OppositeAngles(), (0.0, 0.0, 0.0), (1.0, 1.0, 0.125))
    assert eyes == ((0.0, 0.0), (0.0, 0.0))
