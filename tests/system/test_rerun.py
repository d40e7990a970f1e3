"""A recorded run repeated: to the bit with the same parameters, followed with changed ones."""

import os
from collections.abc import Iterator
from dataclasses import replace
from itertools import islice
from math import inf, nextafter

import pytest
from fakes.runs import VISIT, record
from msgspec import structs
from recorded_run import exact
from slow_rigs import slowed

from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.gaze.track.track import Track
from gazerig.robot.loop import body
from gazerig.robot.loop.loop import Tick
from gazerig.robot.loop.tick import TickRecord
from gazerig.robot.model.commands import (
    Ask,
    Command,
    EndTrack,
    Express,
    Jog,
    LookAt,
    Play,
    Resume,
    SetLevel,
    Stop,
    SyncTrack,
    Tune,
)
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.run_info import RunEnd
from gazerig.robot.recording.writer import RunWriter
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.rerun import rerun
from gazerig.robot.run.run import Run

NECK_YAW = 4

SHOW = """\
description: a show
owns: [neck, eyes]
cues: {here: 0.8}
frames:
  - {time_s: 0.4, levels: {mouth: 0.7}}
  - {time_s: 0.8, head_yaw_deg: 8, eyes_yaw_deg: 3, joints_deg: {right_brow: 3}}
  - {time_s: 1.4, head_yaw_deg: -6}
  - {time_s: 2.0, head_yaw_deg: 0, eyes_yaw_deg: 0}
"""
SPEECH = Play(
    "speech", sound_s=0.3, definition=Track("speech", sound="absent.wav"),
    mouth=((0.1, 0.6),),
)  # fmt: skip
ORDERS: dict[int, tuple[Command, ...]] = {
    20: (Ask("conversation", "talk"), Ask("lids", "wink left")),
    30: (LookAt((1.0, 0.3, 0.3)),),
    45: (LookAt(None), Jog((("neck_yaw", 0.2), ("eyes_pan", 0.1)))),
    60: (Jog(()),),
    65: (Stop("a finger is in it"),),
    88: (Resume(),),
    90: (Play("a_show", loop=True, from_s="here"),), 150: (Play("wink_brow"),),
    170: (Tune((("gaze.saccade.profile", "min_jerk"), ("joints.neck_yaw.zero_step", 2060))),),
    185: (Tune((("gaze.attention.habituation", "none"), ("gaze.idle.hold_ms", 500.0))),),
    190: (SyncTrack(1, 1.2),), 200: (SyncTrack(1, 0.1),), 280: (EndTrack("a_show"),),
    295: (SPEECH,), 320: (Play("a_show", from_s=1.0),),
    340: (Express("happy", 0.5),), 350: (SetLevel("mouth", 0.4),), 360: (Stop("test", who="me"),),
}  # fmt: skip


def test_the_same_code_and_configuration_give_the_same_to_the_bit(tmp_path, monkeypatch):
    """Of a run in which one of all is ordered, with tracks whose files are gone, and of the same
    with one other bit.
    """
    files = {
        "a_show": SHOW,
        "wink_brow": "description: x\nframes: [{time_s: 1, joints_deg: {left_brow: 3}}]",
    }
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    paths = tuple(str(tmp_path / f"{name}.yaml") for name in files)
    rig = replace(slowed(load_rig("expressive"), 100.0), track_files=paths)

    def order(number: int, made: Run) -> None:
        for command in ORDERS.get(number, ()):
            made.robot.command(command)

    monkeypatch.setattr(body, "MIN_HOLD_S", 0.2)  # a shorter run
    path = tmp_path / "run.mcap"
    ticks = record(path, rig, 3.9, VISIT, order)
    for name in files:
        (tmp_path / f"{name}.yaml").unlink()
    recording = RunRecording(path)
    assert {type(order) for tick in ticks for order in tick.commands} == {
        type(order) for orders in ORDERS.values() for order in orders
    }
    states = [tick.tracks for tick in ticks]
    assert max(len([one for one in them if one.is_playing]) for them in states) == 2
    assert not any(one.is_playing for one in states[-1])
    assert "switched off" in states[-1][-1].end_reason
    again: list[Tick] = []
    found = rerun(recording, on_tick=again.append)
    assert found.is_same and found.ticks == found.agreeing_ticks == len(ticks) == 389
    assert found.first_difference_s is None and found.difference == ""
    assert found.notes == ()
    assert len(recording.end.tx_sha256) == 64 and found.sent_bytes_same is True
    # Not the decisions alone: whole ticks, stop, puppet and tuning included.
    assert list(map(exact, again)) == list(map(exact, ticks))
    moments = RunRecording.moments

    def bent(self: RunRecording) -> Iterator[TickRecord]:
        for number, moment in enumerate(islice(moments(self), 40)):
            if number == 10:
                joints = moment.tick.joints
                angles = list(joints.position_rad)
                angles[NECK_YAW] = nextafter(angles[NECK_YAW], inf)
                joints = structs.replace(joints, position_rad=tuple(angles))
                moment = structs.replace(moment, tick=structs.replace(moment.tick, joints=joints))
            yield moment

    monkeypatch.setattr(RunRecording, "moments", bent)
    assert rerun(recording).first_difference_s == pytest.approx(0.1)
    empty = tmp_path / "none.mcap"
    RunWriter(os.open(empty, os.O_WRONLY | os.O_CREAT), recording.info).close(RunEnd("seconds"))
    monkeypatch.setattr(RunRecording, "moments", moments)
    with pytest.raises(SetupError, match="contains no tick: nothing can be run again"):
        rerun(RunRecording(empty))


def test_only_simulated_time_has_bytes_that_a_rerun_repeats():
    for fast in (True, False):
        options = RunOptions(mock=True, fast=fast, page=None).check_and_complete()
        made = Run(load_rig("desk"), options)
        assert (made.bus.sent_bytes_digest() is None) is not fast
        made.close()
