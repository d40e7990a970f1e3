"""A recorded run with gestures is done again to the same bytes, without the gestures' files."""

import itertools
from dataclasses import replace
from pathlib import Path

import pytest

from gazerig.config.schema import load_rig, load_rules
from gazerig.robot.app.assemble import Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.app.run_rig import run_info
from gazerig.robot.app.session import shut_down
from gazerig.robot.control.loop import run
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.commands import Play
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder

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
    options = RunOptions(mock=True, fast=True, seed=5, scene="visitor")
    path = tmp_path / "run.mcap"
    recorder = Recorder(path, run_info(rig, options), patient=True)
    recorder.open()
    made = assemble(rig, options, Substitutes(body=recorder.wrap_body))
    events: list[str] = []

    numbers = itertools.count(1)

    def watch(tick: Tick) -> None:
        recorder.record(tick)
        events.extend(tick.events)
        if (play := PLAYS.get(next(numbers))) is not None:
            made.robot.command(play)

    made.robot.start(made.clock)
    stop = recorder.wrap_stop(lambda s: "seconds" if s >= 3.5 else None)
    count = run(made.robot, made.clock, lambda: made.loop, stop, watch)
    shut_down(made, count, lambda line: None)
    recorder.close(count.stopped_by, made.sent_digest())
    made.close()
    told = [line for line in events if line.startswith("gesture")]
    assert any("rule wait: nod" in line for line in told)
    assert any("mine takes 0.7 s" in line for line in told) and len(told) == 4
    mine.unlink()
    recording = RunRecording(path)
    assert "head_yaw_deg: 6" in recording.info.gestures_yaml
    again = rerun(recording, joints="emulated")
    assert again.same and again.tx_same is True
