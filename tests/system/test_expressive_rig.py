"""The shipped rig with a jaw and brows goes through every part of the program."""

from math import degrees
from pathlib import Path

import pytest
from command_line import answers_in, invoked
from expressive_rig import started
from fakes.runs import ticks

from gazerig.config.load import shipped_path
from gazerig.config.parameters import apply_changes
from gazerig.config.schema import load_rig
from gazerig.robot.model.commands import Express, Value
from gazerig.robot.run.run import Run

pytestmark = pytest.mark.usefixtures("ideal_servos")

NAMES = (
    "eyes_pan", "eyes_tilt", "left_upper_lid", "right_upper_lid", "neck_yaw", "neck_pitch", "jaw",
    "left_brow", "right_brow",
)  # fmt: skip


def test_a_jaw_is_calibrated_by_hand(tmp_path: Path):
    pytest.importorskip("gazerig.features.bringup")
    rig = tmp_path / "face.yaml"
    text = shipped_path("rigs", "expressive").read_text()
    rig.write_text(text)
    done = invoked(
        "calibrate", "joints", str(rig), "--joint", "jaw", "--mock", "--dry-run",
        "--answers", answers_in(tmp_path, "turn 300", "", "turn -500", "", "", "y"),
    )  # fmt: skip
    assert "turn jaw to its POSITIVE end" in done.out + done.err
    assert "joints.jaw.zero_step" in done.out + done.err, done


def test_a_jaw_keeps_clear_of_a_neck_that_looks_down():
    """A forbidden pair with a jaw in it holds the jaw back while the chin is on the chest."""
    rig = load_rig("expressive")
    pair: Value = {"first": ("neck_pitch", -35.0, -5.0), "second": ("jaw", 4.0, 25.0)}
    low: dict[str, Value] = {"expressions.sulky": {"neck_pitch": -20.0, "jaw": 15.0}}
    made: Run = started(apply_changes(rig, {"guard.collisions": (pair,), **low}))
    made.robot.command(Express("sulky"))
    worst = -90.0
    for tick in ticks(made, 600):
        at = dict(zip(NAMES, map(degrees, tick.guard_result.command_rad), strict=True))
        if at["neck_pitch"] < -5.0:
            worst = max(worst, at["jaw"])
    made.close()
    assert worst <= 4.0


def test_a_blink_shuts_the_lids_of_a_sad_face():
    made = started(apply_changes(load_rig("expressive"), {"gaze.lids.law": "nakamoto"}))
    made.robot.command(Express("sad"))
    lid, widest, narrowest = NAMES.index("left_upper_lid"), -90.0, 90.0
    for tick in ticks(made, 1600)[201:]:
        angle = degrees(tick.desired_rad[lid])
        widest, narrowest = max(widest, angle), min(narrowest, angle)
    made.close()
    assert narrowest == pytest.approx(-25.0, abs=0.5)  # shut
    assert widest < 20.0 - 13.0  # open, less nearly all of the 14 deg


def test_the_jaw_moves_on_while_a_stale_frame_holds_the_neck():
    made = started(load_rig("expressive"))
    made.camera.latest = lambda t_s: None  # type: ignore[assignment,method-assign]
    made.robot.command(Express("surprised"))
    tick = ticks(made, 600)[-1]
    made.close()
    held = [reason for reason in tick.guard_result.reasons if "stale frame" in reason]
    assert {reason.partition(":")[0] for reason in held} <= {"neck_yaw", "neck_pitch"} and held
    assert degrees(tick.joints.position_rad[NAMES.index("jaw")]) == pytest.approx(12.0, abs=0.5)
