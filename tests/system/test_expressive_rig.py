"""The shipped rig with a jaw and brows goes through every part of the program."""

from math import degrees

import pytest
from expressive_rig import started
from fakes.runs import ticks

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import load_rig
from gazerig.robot.model.commands import Express, Value
from gazerig.robot.run.run import Run

pytestmark = pytest.mark.usefixtures("ideal_servos")

NAMES = (
    "eyes_pan", "eyes_tilt", "left_upper_lid", "right_upper_lid", "neck_yaw", "neck_pitch", "jaw",
    "left_brow", "right_brow",
)  # fmt: skip


def test_a_face_keeps_clear_shuts_its_lids_and_moves_its_jaw_without_a_camera():
    rig = load_rig("expressive")
    # A forbidden pair with a jaw in it holds the jaw back while the chin is on the chest.
    pair: Value = {"first": ("neck_pitch", -35.0, -5.0), "second": ("jaw", 4.0, 25.0)}
    low: dict[str, Value] = {"expressions.sulky": {"neck_pitch": -20.0, "jaw": 15.0}}
    made: Run = started(apply_changes(rig, {"guard.collisions": (pair,), **low}))
    made.robot.command(Express("sulky"))
    lowest, worst = 0.0, -90.0
    for tick in ticks(made, 400):
        at = dict(zip(NAMES, map(degrees, tick.guard_result.command_rad), strict=True))
        lowest = min(lowest, at["neck_pitch"])
        if at["neck_pitch"] < -5.0:
            worst = max(worst, at["jaw"])
    made.close()
    assert lowest < -15.0 and worst <= 4.0
    # A blink shuts the lids of a sad face.
    made = started(apply_changes(rig, {"gaze.lids.law": "nakamoto"}))
    made.robot.command(Express("sad"))
    lid = NAMES.index("left_upper_lid")
    angles = [degrees(tick.desired_rad[lid]) for tick in ticks(made, 1600)[201:]]
    made.close()
    assert min(angles) == pytest.approx(-25.0, abs=0.5)  # shut
    assert max(angles) < 20.0 - 13.0  # open, less nearly all of the 14 deg
    # A stale frame holds the neck; the jaw moves on.
    made = started(rig)
    made.camera.latest = lambda t_s: None  # type: ignore[assignment,method-assign]
    made.robot.command(Express("surprised"))
    tick = ticks(made, 400)[-1]
    made.close()
    held = [reason for reason in tick.guard_result.reasons if "stale frame" in reason]
    assert {reason.partition(":")[0] for reason in held} <= {"neck_yaw", "neck_pitch"} and held
    assert degrees(tick.joints.position_rad[NAMES.index("jaw")]) == pytest.approx(12.0, abs=0.5)
