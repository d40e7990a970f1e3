"""A recorded run repeated: to the bit with the same parameters, followed with changed ones."""

import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from math import inf, nextafter
from pathlib import Path
from typing import NamedTuple

import pytest
from fakes.runs import VISIT, record
from msgspec import structs
from recorded_rigs import Run
from recorded_run import exact

from gazerig.config.load import load
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig
from gazerig.drivers.errors import SetupError
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.app.resimulate import Resimulation, rerun
from gazerig.robot.control.loop import Tick
from gazerig.robot.control.tick import TickRecord
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
    Speak,
    Stop,
    SyncTrack,
    Tune,
)
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunEnd
from gazerig.robot.recording.run_writer import RunWriter

NECK_YAW = 6
Asked = dict[int, tuple[Command, ...]]

PUPPET: Asked = {
    40: (Ask("conversation", "talk"), Ask("lids", "wink left")),
    80: (LookAt((1.0, 0.3, 0.3)),),
    140: (LookAt(None), Jog((("neck_yaw", 0.2), ("left_eye_pan", 0.1)))),
    200: (Jog(()),),
    240: (Stop("a finger is in it"),),
    650: (Resume(),),
    700: (Tune((("gaze.saccade.profile", "min_jerk"), ("joints.neck_yaw.zero_step", 2060))),),
    730: (Tune((("gaze.attention.habituation", "none"), ("gaze.idle.hold_ms", 500.0))),),
}


def recorded(
    path: Path,
    seconds: float,
    asked: Asked | None = None,
    character: str | None = None,
    start_s: float = 0.0,
    at: Callable[[int, Assembly], None] = lambda n, made: None,
) -> list[Tick]:
    """Record a simulated run as ``gazerig run --fast --record`` does; give its ticks."""
    rig = load_rig("desk", character)

    def each(number: int, made: Assembly) -> None:
        at(number, made)
        for order in (asked or {}).get(number, ()):
            made.robot.command(order)

    options = replace(VISIT, rig="desk", character=character)
    return record(path, rig, seconds, options, each, start_s=start_s)


@pytest.fixture(scope="module")
def once(tmp_path_factory: pytest.TempPathFactory) -> Run:
    path = tmp_path_factory.mktemp("reruns") / "run.mcap"
    ticks = recorded(path, 2.1, PUPPET)
    return Run(RunRecording(path), ticks)


class Again(NamedTuple):
    found: Resimulation
    ticks: list[Tick]
    path: Path


@pytest.fixture(scope="module")
def again(once: Run, tmp_path_factory: pytest.TempPathFactory) -> Again:
    """The run done again with all as it was, and recorded itself."""
    path = tmp_path_factory.mktemp("again") / "again.mcap"
    recorder = Recorder(path, once.recording.info, patient=True)
    recorder.open()
    seen: list[Tick] = []

    def on_tick(tick: Tick) -> None:
        seen.append(tick)
        recorder.record(tick)

    found = rerun(once.recording, on_tick=on_tick)
    recorder.close("seconds")
    return Again(found, seen, path)


def test_the_same_code_and_configuration_give_the_same_to_the_bit(once: Run, again: Again) -> None:
    found = again.found
    assert found.is_same and found.ticks == found.agreeing_ticks == len(once.ticks) == 419
    assert found.first_difference_s is None and found.difference == ""
    assert found.joints == "recorded" and found.notes == ()
    assert found.recorded_figures == found.rerun_figures
    # Not the decisions alone: whole ticks, stop, puppet and tuning included.
    assert list(map(exact, again.ticks)) == list(map(exact, once.ticks))


def test_the_same_bytes_go_over_the_bus(once: Run, again: Again) -> None:
    assert len(once.recording.end.tx_sha256) == 64
    assert again.found.sent_bytes_same is True


def test_emulated_servos_do_what_they_did(once: Run) -> None:
    found = rerun(once.recording, joints="emulated")
    assert found.joints == "emulated"
    assert found.is_same and found.sent_bytes_same is True


def test_the_last_bit_of_one_joint_is_seen(once: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    real = RunRecording.moments

    def bent(self: RunRecording) -> Iterator[TickRecord]:
        for number, moment in enumerate(real(self)):
            if number == 20:
                joints = moment.tick.joints
                angles = list(joints.position_rad)
                angles[NECK_YAW] = nextafter(angles[NECK_YAW], inf)
                joints = structs.replace(joints, position_rad=tuple(angles))
                moment = structs.replace(moment, tick=structs.replace(moment.tick, joints=joints))
            yield moment

    monkeypatch.setattr(RunRecording, "moments", bent)
    found = rerun(once.recording)
    assert found.first_difference_s == pytest.approx(0.1)


def test_the_recorded_rig(once: Run, tmp_path: Path) -> None:
    path = tmp_path / "recorded.yaml"
    path.write_text(once.recording.info.config_yaml, encoding="utf-8")
    assert repr(load(path, Rig)) == repr(load_rig("desk"))


def test_a_recording_without_ticks_is_refused(once: Run, tmp_path: Path) -> None:
    path = tmp_path / "none.mcap"
    writer = RunWriter(os.open(path, os.O_WRONLY | os.O_CREAT), once.recording.info)
    writer.close(RunEnd("seconds"))
    with pytest.raises(SetupError, match="contains no tick: nothing can be run again"):
        rerun(RunRecording(path))


# A recorded boxing match is done again to the same bytes: the planner sees what it saw


# A recorded run with tracks is done again to the same bytes, without the tracks' files


SHOW = """\
description: a show
fit: slow
owns: [neck, eyes]
cues: {here: 0.8}
frames:
  - {time_s: 0.4, look_at: [1.0, 0.3, 0.2], levels: {mouth: 0.7}}
  - {time_s: 0.8, head_yaw_deg: 8, eyes_yaw_deg: 3, express: surprised, strength: 0.5}
  - {time_s: 1.4, head_yaw_deg: -6, look_at: person}
  - {time_s: 2.0, head_yaw_deg: 0, eyes_yaw_deg: 0, look_at: null}
"""
COMMANDS: dict[int, Command] = {
    100: Play("a_show", loop=True, from_s="here"), 260: Play("wink_brow"),
    340: SyncTrack(1, 1.2), 360: SyncTrack(1, 0.1), 520: EndTrack("a_show"),
    550: Speak("absent.wav", 0.3, "mouth", ((0.1, 0.6), (0.2, 0.0))), 600: Play("a_show", from_s=1.0),
    640: Express("happy", 0.5), 660: SetLevel("mouth", 0.4), 680: Stop("test", who="me"),
}  # fmt: skip


def test_a_show_is_done_again_to_the_same_bytes(tmp_path: Path) -> None:
    files = {
        "a_show": SHOW,
        "wink_brow": "description: x\nframes: [{time_s: 1, joints_deg: {left_brow: 3}}]",
    }
    for name, text in files.items():
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    paths = tuple(str(tmp_path / f"{name}.yaml") for name in files)
    rig = replace(load_rig("expressive"), track_files=paths)
    jaw = replace(rig.joints["jaw"], limp_when_idle_s=0.25)
    rig = replace(rig, joints={**rig.joints, "jaw": jaw})

    def ask(number: int, made: Assembly) -> None:
        if (command := COMMANDS.get(number)) is not None:
            made.robot.command(command)

    ticks = record(tmp_path / "run.mcap", rig, 3.7, VISIT, ask)
    states = [tick.tracks for tick in ticks]
    assert max(len([one for one in them if one.is_playing]) for them in states) == 2
    assert {one.cue for them in states for one in them} == {"", "here"}
    assert {one.name for one in states[-1] if one.is_playing} == set()
    assert "switched off" in states[-1][-1].end_reason
    limp = [bool(tick.guard_result.limp) for tick in ticks]
    assert sum(a != b for a, b in pairwise(limp)) >= 2  # the jaw, between its motions
    for name in files:
        (tmp_path / f"{name}.yaml").unlink()
    for joints in ("emulated", "recorded"):
        again = rerun(RunRecording(tmp_path / "run.mcap"), joints=joints)
        assert again.is_same and again.sent_bytes_same is True, again
