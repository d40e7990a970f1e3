"""Saccades that the eye servo of a rig can make."""

from dataclasses import replace

import pytest
from described_rigs import shipped

from gazerig.features.lab.report.servo_saccades import eye_joint, eye_servo_text, saccade_times


def test_an_xl330_makes_saccades_of_human_speed_and_a_slow_servo_none() -> None:
    rig = shipped("desk")
    assert eye_joint(rig) == "left_eye_pan"
    for times in saccade_times(rig, "left_eye_pan"):
        assert times.servo_ms is not None
        assert times.model_ms < times.servo_ms < times.model_ms + 20
    slow = replace(rig.joints["left_eye_pan"], model="xm430-w350", gains=None)
    slow_rig = replace(rig, joints={**rig.joints, "left_eye_pan": slow})
    *_, large = saccade_times(slow_rig, "left_eye_pan")
    assert large.servo_ms is not None and large.servo_ms > 3 * large.model_ms


def test_times_are_the_same_each_time_and_only_of_the_range() -> None:
    rig = shipped("feetech")
    assert saccade_times(rig, "left_eye_pan") == saccade_times(rig, "left_eye_pan")
    narrow = replace(rig.joints["left_eye_pan"], min_deg=-6.0, max_deg=6.0)
    rig = replace(rig, joints={**rig.joints, "left_eye_pan": narrow})
    assert [one.amplitude_deg for one in saccade_times(rig, "left_eye_pan")] == [5.0, 10.0]


def test_a_servo_that_never_arrives_is_told() -> None:
    rig = shipped("desk")
    weak = replace(rig.joints["left_eye_pan"], gains=(5, 0, 0))
    (large,) = saccade_times(
        replace(rig, joints={"left_eye_pan": weak}), "left_eye_pan", amplitudes_deg=(20.0,)
    )
    assert large.servo_ms is None


@pytest.mark.parametrize("name", ["desk", "maker", "minimal"])
def test_the_text_names_the_servo_and_both_times(name: str) -> None:
    rig = shipped(name)
    joint = eye_joint(rig)
    assert joint is not None
    text = eye_servo_text(rig) or ""
    assert text.startswith(
        f"{rig.joints[joint].model}, emulated: within 1 deg of 5, 10, 20 deg after"
    )
    assert "; the model after " in text
    assert eye_servo_text(replace(rig, joints={"neck_yaw": rig.joints[joint]})) is None
