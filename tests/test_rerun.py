"""A recorded run repeated: to the bit with the same parameters, followed with changed ones."""

import os
from collections.abc import Callable, Iterator
from dataclasses import replace
from inspect import signature
from itertools import pairwise
from math import inf, nextafter
from pathlib import Path
from typing import NamedTuple

import pytest
from fakes.runs import VISIT, record
from stand_in import StandIn

from gazerig.config.load import load
from gazerig.config.rig import Rig
from gazerig.config.schema import load_rig, load_rules
from gazerig.drivers.errors import SetupError
from gazerig.gaze.types import Percept
from gazerig.robot.app.assemble import Assembly, assemble, with_options
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.resimulate import Resimulation, rerun
from gazerig.robot.control.body import Body
from gazerig.robot.control.loop import Tick
from gazerig.robot.model.commands import (
    Ask,
    Command,
    ControlTrack,
    Jog,
    LookAt,
    Play,
    Resume,
    Speak,
    Stop,
    SyncTrack,
    Tune,
)
from gazerig.robot.recording.joint_recorder import JointRecorder
from gazerig.robot.recording.playback_devices import PlaybackBody
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunEnd, as_text
from gazerig.robot.recording.run_writer import RunWriter
from gazerig.robot.recording.tick_record import (
    BodyRecord,
    MeasuredJoints,
    TickRecord,
    TorqueEnabled,
    TorqueRefused,
)

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
    730: (Tune((("gaze.attention.stale_ms", 200.0), ("gaze.idle.rest_ms", 500.0))),),
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


class Once(NamedTuple):
    recording: RunRecording
    ticks: list[Tick]


@pytest.fixture(scope="module")
def once(tmp_path_factory: pytest.TempPathFactory) -> Once:
    path = tmp_path_factory.mktemp("reruns") / "run.mcap"
    ticks = recorded(path, 2.1, PUPPET)
    return Once(RunRecording(path), ticks)


class Again(NamedTuple):
    found: Resimulation
    ticks: list[Tick]
    path: Path


@pytest.fixture(scope="module")
def again(once: Once, tmp_path_factory: pytest.TempPathFactory) -> Again:
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


def exact(tick: Tick) -> str:
    return repr(tick._replace(detections=None, percept=None))


def test_the_same_code_and_configuration_give_the_same_to_the_bit(once: Once, again: Again) -> None:
    found = again.found
    assert found.is_same and found.ticks == found.agreeing_ticks == len(once.ticks) == 419
    assert found.first_difference_s is None and found.difference == ""
    assert found.joints == "recorded" and found.notes == ()
    assert found.recorded_figures == found.rerun_figures
    # Not the decisions alone: whole ticks, stop, puppet and tuning included.
    assert list(map(exact, again.ticks)) == list(map(exact, once.ticks))


def test_the_same_bytes_go_over_the_bus(once: Once, again: Again) -> None:
    assert len(once.recording.end.tx_sha256) == 64
    assert again.found.sent_bytes_same is True


def test_emulated_servos_do_what_they_did(once: Once) -> None:
    found = rerun(once.recording, joints="emulated")
    assert found.joints == "emulated"
    assert found.is_same and found.sent_bytes_same is True


def test_with_other_dice_it_differs(once: Once) -> None:
    recording = RunRecording(once.recording.path)
    recording.info = replace(recording.info, seed=6)
    found = rerun(recording)
    assert not found.is_same and found.agreeing_ticks < found.ticks
    assert found.sent_bytes_same is False
    assert found.first_difference_s is not None and found.difference


def test_the_last_bit_of_one_joint_is_seen(once: Once, monkeypatch: pytest.MonkeyPatch) -> None:
    real = RunRecording.moments

    def bent(self: RunRecording) -> Iterator[TickRecord]:
        for number, moment in enumerate(real(self)):
            if number == 20:
                joints = moment.tick.joints
                angles = list(joints.position_rad)
                angles[NECK_YAW] = nextafter(angles[NECK_YAW], inf)
                joints = joints._replace(position_rad=tuple(angles))
                moment = moment._replace(tick=moment.tick._replace(joints=joints))
            yield moment

    monkeypatch.setattr(RunRecording, "moments", bent)
    found = rerun(once.recording)
    assert found.first_difference_s == pytest.approx(0.1)


def test_another_character_is_followed_by_the_servos(once: Once, tmp_path: Path) -> None:
    bold = tmp_path / "bold.yaml"
    bold.write_text(
        "gaze:\n  saccade:\n    profile: main_sequence\n  scanpath:\n    rate_scale: 4.0\n"
    )
    seen: list[Tick] = []
    found = rerun(once.recording, character=str(bold), on_tick=seen.append)
    assert found.joints == "emulated" and not found.is_same
    assert len(seen) == found.ticks == 419
    assert found.agreeing_ticks < found.ticks and found.difference
    # The percepts are the same, and the servos follow the new commands.
    assert [captured(t.percept) for t in seen] == [captured(t.percept) for t in once.ticks]
    behind = [
        abs(now - sent)
        for tick in seen[-20:]
        for now, sent in zip(tick.joints.position_rad, tick.guard_result.command_rad, strict=True)
    ]
    assert max(behind) < 0.3


def captured(percept: Percept | None) -> float | None:
    return percept.captured_s if percept is not None else None


def test_another_rig_by_name_and_as_it_is(once: Once) -> None:
    by_name = rerun(once.recording, rig="desk", joints="recorded")
    as_it_is = rerun(once.recording, rig=load_rig("desk"), joints="recorded")
    assert by_name.is_same and as_it_is.is_same
    with pytest.raises(
        SetupError, match="joints upside_down: unknown; choose recorded or emulated"
    ):
        rerun(once.recording, joints="upside_down")


def test_a_run_of_a_character_is_done_again_without_its_file(tmp_path: Path) -> None:
    path = tmp_path / "shy.mcap"
    recorded(path, 1.0, character="shy")
    assert rerun(RunRecording(path)).is_same


def test_the_recorded_rig(once: Once, tmp_path: Path) -> None:
    path = tmp_path / "recorded.yaml"
    path.write_text(once.recording.info.config_yaml, encoding="utf-8")
    assert repr(load(path, Rig)) == repr(load_rig("desk"))


def test_a_configuration_of_another_version_is_told_in_one_line(once: Once) -> None:
    recording = RunRecording(once.recording.path)
    text = f"{recording.info.config_yaml}antennas: 2\n"
    recording.info = replace(recording.info, config_yaml=text)
    words = r"a configuration that this version does not support \(antennas: .*\): give another rig"
    with pytest.raises(SetupError, match=words) as found:
        rerun(recording)
    assert "\n" not in str(found.value)


def test_a_run_on_the_hosts_clock_is_done_again(tmp_path: Path) -> None:
    """Times of a machine that has been up for days, and slots that are not round numbers."""
    path = tmp_path / "days.mcap"
    ticks = recorded(path, 3.0, {100: (Stop("x"),), 550: (Resume(),)}, start_s=345678.9012345)
    recording = RunRecording(path)
    found = rerun(recording)
    assert found.is_same and found.ticks == len(ticks)


def test_a_fault_that_ended_a_run_ends_nothing_here(tmp_path: Path) -> None:
    path = tmp_path / "fault.mcap"

    def fail(number: int, made: Assembly) -> None:
        if number == 100:
            made.robot.body.bus._port.chain[7].fail("overload")  # type: ignore[attr-defined]

    ticks = recorded(path, 2.0, at=fail)
    assert ticks[-1].guard_result.level == "torque_off"
    recording = RunRecording(path)
    assert recording.end.stopped_by.startswith("fault")
    found = rerun(recording)
    assert found.is_same and found.ticks == len(ticks)


def test_an_order_that_is_none_any_more_is_told(tmp_path: Path) -> None:
    path = tmp_path / "ask.mcap"
    recorded(path, 0.5, {20: (Ask("behaviour", "guard"),)})
    rig = load_rig("desk")
    top_down = rig.gaze.top_down
    fewer = replace(top_down, rules={"wait": top_down.rules["wait"]}, behaviour="wait")
    rig = replace(rig, gaze=replace(rig.gaze, top_down=fewer))
    found = rerun(RunRecording(path), rig=rig)
    (note,) = found.notes
    assert "could not be given again: no behaviour 'guard'" in note


def test_a_refused_resumption_is_refused_again() -> None:
    made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene="visitor"))
    made.robot.start(made.clock)
    tick = made.robot.tick(0.005, 0.005)
    body = PlaybackBody(made.robot.body)
    goals, other = (0.1,) * 9, tick.joints._replace(position_rad=(0.2,) * 9)
    body.play(
        TickRecord(
            tick,
            0.005,
            (TorqueRefused("servo 7 is mute"), TorqueEnabled(goals), MeasuredJoints(0.0, other)),
        )
    )
    with pytest.raises(SetupError, match="servo 7 is mute"):
        body.enable_torque()
    assert body.enable_torque() == goals
    assert body.read(0.005) is other
    assert body.read(0.005) is tick.joints
    assert body.read(0.010) is tick.joints  # more readings than there were
    body.stop_playback()
    assert body.read(0.015) is not tick.joints


class CalledBody(StandIn):
    """A body that notes what is called, and whose torque is refused."""

    def __init__(self) -> None:
        self.bus, self.names, self.called = None, (), list[str]()

    def __getattr__(self, name: str) -> Callable[..., str]:
        def call(*given: object) -> str:
            self.called.append(name)
            if name == "enable_torque":
                raise SetupError("servo 7 is mute")
            return name

        return call


@pytest.mark.parametrize("way", ["recorded", "played"])
def test_whatever_is_asked_of_a_body_reaches_the_machine(way: str) -> None:
    asked = {
        name: len(signature(member).parameters) - 1
        for name, member in vars(Body).items()
        if callable(member) and not name.startswith("_")
    }
    assert {"disable_torque", "stop", "write"} <= asked.keys()
    machine, notes = CalledBody(), list[BodyRecord]()
    body = JointRecorder(machine, notes.append) if way == "recorded" else PlaybackBody(machine)
    for name, count in asked.items():
        try:
            given = getattr(body, name)(*range(count))
        except SetupError:
            assert name == "enable_torque"
        else:
            assert given in (None, name)
    assert machine.called == list(asked)
    if way == "recorded":
        assert notes == [
            TorqueEnabled("start"),  # type: ignore[arg-type]
            MeasuredJoints(0, "read"),  # type: ignore[arg-type]
            TorqueRefused("servo 7 is mute"),
        ]


def test_a_recording_without_ticks_is_refused(once: Once, tmp_path: Path) -> None:
    path = tmp_path / "none.mcap"
    writer = RunWriter(os.open(path, os.O_WRONLY | os.O_CREAT), as_text(once.recording.info), 0)
    writer.close(RunEnd("seconds"))
    with pytest.raises(SetupError, match="contains no tick: nothing can be run again"):
        rerun(RunRecording(path))


def test_a_new_run_can_be_recorded_itself(once: Once, again: Again) -> None:
    back = list(RunRecording(again.path).ticks())
    assert list(map(exact, back)) == list(map(exact, once.ticks))


# A recorded boxing match is done again to the same bytes: the planner sees what it saw


def test_what_the_planner_chose_is_recorded_and_chosen_again(tmp_path: Path) -> None:
    options = RunOptions(mock=True, fast=True, seed=3, scene="boxing")
    rig = with_options(load_rig("desk"), options)
    ticks = record(tmp_path / "run.mcap", rig, 2.7, options)
    plans = [tick.target.plan for tick in ticks]
    assert {plan.partition(":")[0] for plan in plans} >= {"wait", "guard"}
    recording = RunRecording(tmp_path / "run.mcap")
    recorded = [moment.tick.target.plan for moment in recording.moments()]
    assert recorded[: len(plans)] == plans
    again = rerun(recording, joints="emulated")
    assert again.is_same and again.sent_bytes_same is True


# A recorded run with tracks is done again to the same bytes, without the tracks' files


PLAYS = {300: Play("mine"), 380: Play("shake", 1.3), 450: Play(""), 500: Play("nod", times=2)}


def test_tracks_are_done_again_to_the_same_bytes(tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(
        "description: x\nframes:\n  - {time_s: 0.3, head_yaw_deg: 6, lids: {all: 0.5}}\n"
    )
    rig = load_rig("desk")
    rules = load_rules("greeting")
    rig = replace(
        rig,
        track_files=(str(mine),),
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
    told = [line for line in events if line.startswith("track")]
    assert any("rule wait: nod" in line for line in told)
    assert any("mine takes 0.7 s" in line for line in told) and len(told) == 4
    mine.unlink()
    recording = RunRecording(path)
    assert "head_yaw_deg: 6" in recording.info.tracks_yaml
    again = rerun(recording, joints="emulated")
    assert again.is_same and again.sent_bytes_same is True


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
    100: Play("a_show", loop=True), 180: ControlTrack("seek", "a_show", "here"),
    220: ControlTrack("pause"), 260: Play("wink_brow"), 300: ControlTrack("resume"),
    340: SyncTrack(1, 1.2), 360: SyncTrack(1, 0.1), 420: ControlTrack("speed", "a_show", 0.6),
    520: ControlTrack("end", "a_show"),
    550: Speak("absent.wav", 0.3, "mouth", ((0.1, 0.6), (0.2, 0.0))), 600: Play("a_show", from_s=1.0), 680: Stop("test", "me"),
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
