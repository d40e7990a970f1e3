"""Recordings of runs: every tick is read back bit for bit, and reading errors have a reason."""

import base64
import json
import os
import signal
import subprocess
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from functools import partial
from itertools import islice
from math import inf, nan
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from branch import Branch
from child_processes import command
from desk import GAZE_JOINTS
from fakes.runs import simulated, ticks
from jsonschema import Draft202012Validator
from made_ticks import made_tick
from mcap.reader import make_reader
from mcap.writer import Writer
from recorded_run import STARTED, exact, info_for

from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import Detections
from gazerig.gaze.types import Bodies, Face, Percept
from gazerig.robot.loop.tick import Tick, TickRecord
from gazerig.robot.loop.tick_stream import encode
from gazerig.robot.model.clock import RealClock, SimulatedClock
from gazerig.robot.model.reply import ControlState, TrackState
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording import writer
from gazerig.robot.recording.read import BadRecording, RunRecording
from gazerig.robot.recording.recorder import FramePicker, Recorder
from gazerig.robot.recording.run_info import PROFILE, RunEnd, RunInfo, as_text, read_text
from gazerig.robot.recording.writer import RunWriter
from gazerig.robot.run.run import Run


def picked_s(rate_hz: float, times_s: Iterable[float]) -> list[float]:
    """Return the times of the frames that are picked of these."""
    picker, picture = FramePicker(rate_hz), np.zeros((2, 2, 3), np.uint8)
    return [
        at_s
        for number, at_s in enumerate(times_s, 1)
        if picker.is_due(Detections(at_s, number, 2, 2, image=picture))
    ]


def test_other_programs_open_it(recorded):
    with recorded.path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        assert summary is not None and summary.statistics is not None
        assert {s.name for s in summary.schemas.values()} >= {
            "foxglove.CompressedImage", "foxglove.JointStates", "foxglove.Log", "gazerig.Tick",
        }  # fmt: skip
        assert all(s.encoding == "jsonschema" for s in summary.schemas.values())
        assert all(chunk.compression == "zstd" for chunk in summary.chunk_indexes)
        valid = {c.topic: Draft202012Validator({"additionalProperties": False,
                          **json.loads(summary.schemas[c.schema_id].data)})
                 for c in summary.channels.values()}  # fmt: skip
        for one in valid.values():
            one.check_schema(one.schema)
        seen: dict[str, Any] = {}
        count: Counter[str] = Counter()
        for _, channel, message in reader.iter_messages():
            assert channel.message_encoding == "json"
            count[channel.topic] += 1
            assert message.sequence == count[channel.topic]  # a missing one is detectable
            data = seen[channel.topic] = json.loads(message.data)
            valid[channel.topic].validate(data)
            if channel.topic == fmt.TICK:
                since_s = data["tick"]["t_s"] - recorded.ticks[0].t_s
                wall_s = STARTED.timestamp() + since_s
                assert message.log_time / 1e9 == pytest.approx(wall_s, abs=1e-6)
    assert set(seen) == set(fmt.TYPES) - {fmt.DESCRIPTION}
    pixels = cv2.imdecode(
        np.frombuffer(base64.b64decode(seen[fmt.FRAME]["data"]), np.uint8), cv2.IMREAD_COLOR
    )
    assert pixels is not None and pixels.shape[:2] == (40, 60)
    assert count[fmt.FRAME] == 6
    states = {one["name"]: one["position"] for one in seen[fmt.JOINT_STATES]["joints"]}
    assert tuple(states) == GAZE_JOINTS


def write_ticks(path: Path, ticks: Iterable[Tick]) -> Path:
    made = RunWriter(os.open(path, os.O_WRONLY | os.O_CREAT), info_for())
    for tick in ticks:
        made.write_ticks(encode([TickRecord(tick, 0.1, tick.percept)]))
    assert made.close(RunEnd("seconds")).failed == ""
    return path


def test_any_tick_comes_back(tmp_path):
    ticks = []
    for odd in (0.25, nan, -inf):
        track = TrackState("nod", "", 0.5, 1.0, owns=("jaw",), who="somebody", number=2)
        lead = ControlState(4, True, False, odd, "", "pointer", "somebody", "look", ("neck_yaw",))
        face = Face(3, (odd, 0.0, 1.0), (0.0,) * 3, ((1.0, 0.0, 0.0),) * 3, ((odd,) * 3,) * 8, 0.5)
        bodies = Bodies((3, 9), ("face", "hand"), *(np.full((2, 3), odd),) * 3,
                        np.array([odd, 1.0]), np.full((2, 6, 6), odd))  # fmt: skip
        ticks += [
            made_tick(client_control=lead, tracks=(track,), percept=percept)
            for percept in (Percept(odd, bodies, (face,)), Percept(1.0, scene=4), None)
        ]
    found = RunRecording(write_ticks(tmp_path / "odd.mcap", ticks)).ticks()
    assert list(map(repr, found)) == list(map(repr, ticks))


@pytest.mark.parametrize(
    ("name", "nonsense"),
    [
        ("seed", -1),
        ("rate_hz", 1e9),
        ("mock", 1),
        ("started_utc", "yesterday"),
    ],
)
def test_a_beginning_that_no_run_has_is_refused(name, nonsense):
    ((key, text),) = as_text(info_for()).items()
    assert read_text({key: text}, RunInfo) == info_for()
    wrong = json.dumps({**json.loads(text), name: nonsense})
    with pytest.raises(ValueError, match=name):
        read_text({key: wrong}, RunInfo)


def test_a_late_frame_does_not_delay_those_that_follow():
    camera = (k / 100.0 for k in range(200) if not 40 <= k < 45 and not 100 <= k < 170)
    wanted = [0.0, 0.2, 0.45, 0.6, 0.8, 1.7, 1.9]  # after a long gap the count starts again
    assert picked_s(5.0, camera) == pytest.approx(wanted)


# --- Recordings of runs that cannot be read, and what goes wrong while one is written


# --- what cannot be read


def test_a_recording_cut_anywhere_opens_and_keeps_what_is_whole(recorded, tmp_path):
    data = recorded.path.read_bytes()
    cut = tmp_path / "cut.mcap"
    counts = []
    for share in (0.9, 0.6, 0.4):
        cut.write_bytes(data[: int(share * len(data))])
        recording = RunRecording(cut)
        assert not recording.whole and "was not closed" in recording.note
        assert recording.info == recorded.info
        back = list(recording.ticks())
        for was, now in zip(recorded.ticks, back, strict=False):
            assert exact(now) == exact(was)
        counts.append(len(back))
    assert counts == sorted(counts, reverse=True) and counts[-1] < 299


def test_time_that_runs_back_or_leaps_is_no_run(tmp_path):
    for number, (t_s, right) in enumerate(
        ((5.0, True), (3604.9, True), (4.99, False), (3605.0, False))
    ):
        path = write_ticks(tmp_path / f"{number}.mcap", map(made_tick, (0.0, 5.0, t_s)))
        if right:
            assert [tick.t_s for tick in RunRecording(path).ticks()] == [0.0, 5.0, t_s]
            assert RunRecording(path).duration_s == pytest.approx(t_s)
            continue
        with pytest.raises(BadRecording, match="damaged .a tick at"):
            list(RunRecording(path).ticks())


def written(path: Path, profile: str) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile, "test")
        writer.finish()
    return path


def test_what_is_no_recording_of_a_run_is_refused_in_one_line(tmp_path):
    (tmp_path / "text").write_text("not at all a recording")
    (tmp_path / "empty").touch()
    wrong = {
        tmp_path / "nothing": "no recording at .*nothing: check the path",
        tmp_path: "is not a file",
        tmp_path / "text": "is not a recording: make one with gazerig run --record",
        tmp_path / "empty": "is not a recording",
        written(tmp_path / "camera", "gazerig-camera-1"): "not a recording of a run",
        written(tmp_path / "newer", "gazerig-run-9"): "of format 9, .* reads 2: use the version",
        written(tmp_path / "other", "ros2"): r"not a recording of a run \(its profile is 'ros2'\)",
        written(tmp_path / "bare", PROFILE): "it contains nothing of a run",
    }
    for path, words in wrong.items():
        with pytest.raises(SetupError, match=words) as found:
            RunRecording(path)
        assert "\n" not in str(found.value)


def test_a_file_is_not_written_over_unasked(tmp_path):
    there = tmp_path / "there.mcap"
    there.write_text("precious")
    with pytest.raises(SetupError, match="already exists: name another file, or use --force"):
        refused = Recorder(there, info_for())
        refused.open()
    refused.close()
    assert there.read_text() == "precious"
    with pytest.raises(SetupError, match="cannot write .*: choose a folder"):
        Recorder(tmp_path / "no" / "r", info_for()).open()


# --- what goes wrong while it runs


def test_a_full_disk_ends_the_recording_and_not_the_run(small_disk, tmp_path):
    path = tmp_path / "full.mcap"
    recorder = Recorder(path, info_for(), patient=True)
    recorder.open()
    made = simulated(wrap_body=recorder.wrap_body, bus="ideal")
    made.robot.start(made.clock)
    said: list[str] = []
    goes_on = 0
    for number in range(1, 2001):
        made.clock.sleep_until(0.005 * number)
        recorder.record(made.robot.tick(0.005 * number, 0.005))
        said += recorder.events()
        goes_on += bool(said)
        if goes_on == 100:
            break
    last = recorder.close("seconds")
    said += recorder.events()
    assert goes_on == 100
    assert said == ["recording stopped (File too large); the run continues without it"]
    assert last == f"recording in {path} is incomplete: File too large"
    recording = RunRecording(path)
    assert not recording.whole
    assert path.stat().st_size <= 60_000
    list(recording.ticks())  # what is there is not damaged


def writing(path: Path) -> tuple[Recorder, Run, Any]:
    """Begin to record a robot; give the process of the writer too."""
    recorder = Recorder(path, info_for())
    recorder.open()
    made = simulated(wrap_body=recorder.wrap_body, bus="ideal")
    made.robot.start(made.clock)
    assert recorder._link is not None
    return recorder, made, recorder._link.process


def test_a_writer_that_stops_delays_nothing_and_loses_nothing(tmp_path):
    path = tmp_path / "late.mcap"
    recorder, made, process = writing(path)
    process.send_signal(19)  # SIGSTOP
    seen = ticks(made, 400)
    for tick in seen:
        recorder.record(tick)  # would never return if it waited
    process.send_signal(18)  # SIGCONT
    assert recorder.close("fault: jaw: overload").startswith("400 ticks")
    assert recorder.lost == 0
    recording = RunRecording(path)
    assert recording.note == "late.mcap ends with a fault: jaw: overload"
    back = list(recording.ticks())
    assert list(map(exact, back)) == list(map(exact, seen))


def test_what_the_queue_cannot_hold_is_lost_and_counted(tmp_path, monkeypatch):
    monkeypatch.setattr("gazerig.robot.recording.recorder.QUEUE_BYTES", 150_000)
    path = tmp_path / "lost.mcap"
    recorder, made, process = writing(path)
    process.send_signal(19)
    for tick in ticks(made, 400):
        recorder.record(tick)
    process.send_signal(18)
    said = recorder.close("seconds")
    assert recorder.lost > 0
    assert f"; {recorder.lost} ticks were not recorded" in said
    recording = RunRecording(path)
    assert recording.end.lost == recorder.lost
    assert f"lacks {recorder.lost} ticks" in recording.note
    assert len(list(recording.ticks())) == 400 - recorder.lost


def test_a_writer_that_dies_is_told_once_and_the_run_goes_on(tmp_path):
    recorder, made, process = writing(tmp_path / "dead.mcap")
    process.kill()
    process.wait()
    said: list[str] = []
    for tick in ticks(made, 199):
        recorder.record(tick)
        said += recorder.events()
    assert said == ["recording stopped (its writer has died); the run continues without it"]
    assert "incomplete: its writer has died" in recorder.close("seconds")


# --- A rig that is killed while it records: the file closes, or opens up to the last second


TICK_S = 0.05


def rig(path: Path) -> None:
    """Record a rig until it is killed, and print the time of each tick's transfer."""
    info = RunInfo("desk", "robot", "a: 1", 0, 1.0 / TICK_S, datetime(2026, 1, 31, tzinfo=UTC))
    recorder = Recorder(path, info)
    recorder.open()
    assert recorder._link is not None
    print(recorder._link.process.pid, flush=True)
    made = simulated(wrap_body=recorder.wrap_body)
    made.robot.start(made.clock)
    wall = RealClock()
    start_s = wall.now_s()
    for number in range(1, 100000):
        t_s = TICK_S * number
        wall.sleep_until(start_s + t_s)
        made.clock.sleep_until(t_s)
        recorder.record(made.robot.tick(t_s, TICK_S))
        print(wall.now_s(), t_s, flush=True)


class Killed:
    """A rig that has been killed, alone or with its writer.

    handed: (wall clock, rig's time) of every tick that it had handed over; killed_s: when
    """

    def __init__(self, path: Path, both: bool) -> None:
        process = Branch(partial(rig, path), stdout=subprocess.PIPE, text=True)
        assert process.stdout is not None
        writer = int(process.stdout.readline())
        lines = []
        for line in process.stdout:
            lines.append(line)
            if float(line.split()[1]) >= 1.5:
                break
        if both:
            os.kill(writer, signal.SIGKILL)
        process.kill()
        self.killed_s = time.monotonic()
        lines += process.stdout.readlines()
        process.wait()
        self.handed = [tuple(map(float, line.split())) for line in lines if line.endswith("\n")]
        deadline_s = time.monotonic() + 30.0
        while command(writer):
            assert time.monotonic() < deadline_s, "the writer outlives its rig"
            time.sleep(0.02)


@pytest.mark.parametrize("both", [False, True], ids=["rig", "rig and writer"])
def test_a_killed_rig_leaves_a_recording(tmp_path, both):
    path = tmp_path / "killed.mcap"
    killed = Killed(path, both)
    recording = RunRecording(path)
    assert recording.whole is not both
    words = "was not closed" if both else "ends at the time at which the program was killed"
    assert words in recording.note
    times = [tick.t_s for tick in recording.ticks()]
    assert times == [t_s for _, t_s in killed.handed][: len(times)]  # nothing lacks in between
    kept_s = dict((t_s, wall_s) for wall_s, t_s in killed.handed)[times[-1]]
    assert killed.killed_s - kept_s <= 1.0
    assert recording.info.rig == "desk" and recording.end.stopped_by == ""


# --- The process that writes a recording


def test_what_is_written_is_put_on_the_disk_every_second(tmp_path, monkeypatch):
    clock, at_s = SimulatedClock(), list[float]()
    monkeypatch.setattr(os, "fdatasync", lambda fd: at_s.append(clock.now_s()))

    def nothing_for(seconds: float) -> Iterator[None]:
        while clock.now_s() < seconds:
            clock.sleep_until(clock.now_s() + 0.1)
            yield None

    made = RunWriter(os.open(tmp_path / "r", os.O_WRONLY | os.O_CREAT), info_for())
    writer.write(nothing_for(5.05), made, clock)
    made.close(RunEnd())
    assert np.diff([0.0, *at_s]).max() < 1.2 and at_s[-1] > 5.0  # the last one at the end


def test_a_writer_whose_program_has_died_ends_although_a_fork_holds_its_pipe():
    theirs, ours = os.pipe()
    os.write(ours, writer.PREFIX.pack(writer.FRAME, 5, 6) + b"firstpixels")
    found = list(islice(writer.receive(theirs, os.getpid()), 3))  # our parent is another one
    assert found == [(writer.FRAME, b"first", b"pixels")]
    os.write(ours, writer.PREFIX.pack(writer.FRAME, 5, 6) + b"firstpix")  # cut off
    os.close(ours)
    assert not [*writer.receive(theirs, os.getpid())]
    os.close(theirs)
