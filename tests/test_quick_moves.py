"""The five buttons under the head show why they are grey."""

import pytest
from desk import GAZE_JOINTS
from fakes.runs import simulated

from gazerig.robot.dashboard.panels.controls import TRACKS, refused_moves

LIDLESS = tuple(joint for joint in GAZE_JOINTS if "lid" not in joint)
ALL = {"track": ("none", *TRACKS)}


@pytest.mark.parametrize("rig", ["desk", "maker", "feetech", "expressive"])
def test_the_shipped_rigs_can_do_all_five(rig: str) -> None:
    made = simulated(rig)
    assert refused_moves(made.robot.menus(), made.robot.body.names) == {}
    made.close()


def test_without_lids_a_button_says_that_there_are_none() -> None:
    only_neck = {"track": ("none", "nod", "shake")}
    assert refused_moves(only_neck, LIDLESS) == dict.fromkeys(
        ("wink", "surprised", "sleepy"), "this rig has no lids"
    )
    assert refused_moves(ALL, GAZE_JOINTS) == {}


def test_joints_that_are_absent_and_a_calibration_are_named() -> None:
    assert "none of the joints" in refused_moves({"track": ("none",)}, GAZE_JOINTS)["nod"]
    calibrating = refused_moves({"steer": ("next",)}, GAZE_JOINTS)
    assert set(calibrating) == {*TRACKS, "wink"}
    assert set(calibrating.values()) == {"not while a calibration is under way"}
