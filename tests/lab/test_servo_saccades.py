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
