"""A recorded run with gestures is done again to the same bytes, without the gestures' files."""

from dataclasses import replace
from pathlib import Path

import pytest
from fakes.runs import VISIT, record

from gazerig.config.schema import load_rig, load_rules
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.model.commands import Play
from gazerig.robot.recording.read import RunRecording

pytestmark = pytest.mark.usefixtures("branched_children")

PLAYS = {300: Play("mine"), 380: Play("shake", 1.3), 450: Play(""), 500: Play("nod", times=2)}


def test_gestures_are_done_again_to_the_same_bytes(tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(
        "description: x\nframes:\n  - {time_s: 0.3, head_yaw_deg: 6, lids: {all: 0.5}}\n"
    )
    rig = load_rig("desk")
    rules = load_rules("greeting")
    rig = replace(
        rig,
        gesture_files=(str(mine),),
        gaze=replace(
            rig.gaze,
            top_down=replace(
                rules,
                rules={**rules.rules, "wait": replace(rules.rules["wait"], gesture_at="face")},
            ),
        ),
    )
    path = tmp_path / "run.mcap"

    def ask(number: int, made: Assembly) -> None:
        if (play := PLAYS.get(number)) is not None:
            made.robot.command(play)

    ticks = record(path, rig, 3.5, VISIT, ask)
    events = [line for tick in ticks for line in tick.events]
    told = [line for line in events if line.startswith("gesture")]
    assert any("rule wait: nod" in line for line in told)
    assert any("mine takes 0.7 s" in line for line in told) and len(told) == 4
    mine.unlink()
    recording = RunRecording(path)
    assert "head_yaw_deg: 6" in recording.info.gestures_yaml
    again = rerun(recording, joints="emulated")
    assert again.same and again.tx_same is True
