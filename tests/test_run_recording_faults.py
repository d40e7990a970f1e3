"""Recordings of runs that cannot be read, and what goes wrong while one is written."""

import json
import os
from pathlib import Path
from typing import Any

import pytest
from fakes.runs import ticks
from mcap.reader import make_reader
from mcap.writer import Writer
from recorded_run import Recorded, assembly, exact, info_for

from gazerig.drivers.errors import SetupError
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording.read import BadRecording, RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import PROFILE, RunEnd
from gazerig.robot.recording.run_writer import RunWriter

# --- what cannot be read


def test_a_recording_cut_anywhere_opens_and_keeps_what_is_whole(
    recorded: Recorded, tmp_path: Path
) -> None:
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


def test_time_that_runs_back_or_leaps_is_no_run(recorded: Recorded, tmp_path: Path) -> None:
    with recorded.path.open("rb") as file:
        found = [json.loads(m.data) for *_, m in make_reader(file).iter_messages([fmt.TICK])][:3]
    for number, (moved_s, right) in enumerate(((0.0, True), (-0.006, False), (4000.0, False))):
        path = tmp_path / f"{number}.mcap"
        writer = RunWriter(os.open(path, os.O_WRONLY | os.O_CREAT), recorded.info)
        for nth, tick in enumerate(found):
            t_s = tick["tick"]["t_s"] + moved_s * (nth == 2)
            writer.add(fmt.TICK, 0.0, {**tick, "tick": {**tick["tick"], "t_s": t_s}})
        writer.close(RunEnd("seconds"))
        if right:
            assert len(list(RunRecording(path).ticks())) == 3
            continue
        with pytest.raises(BadRecording, match="damaged .a tick at"):
            list(RunRecording(path).ticks())


def written(path: Path, profile: str) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile, "test")
        writer.finish()
    return path


def test_what_is_no_recording_of_a_run_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "text").write_text("not at all a recording")
    (tmp_path / "empty").touch()
    wrong = {
        tmp_path / "nothing": "no recording at .*nothing: check the path",
        tmp_path: "is not a file",
        tmp_path / "text": "is not a recording: make one with gazerig run --record",
        tmp_path / "empty": "is not a recording",
        written(tmp_path / "camera", "gazerig-camera-1"): "a recording of a camera, not of a run",
        written(tmp_path / "newer", "gazerig-run-9"): "of format 9, .* reads 2: use the version",
        written(
            tmp_path / "other", "ros2"
        ): r"not a recording of gazerig \(its profile is 'ros2'\)",
        written(tmp_path / "bare", PROFILE): "it contains nothing of a run",
    }
    for path, words in wrong.items():
        with pytest.raises(SetupError, match=words) as found:
            RunRecording(path)
        assert "\n" not in str(found.value)


def test_a_file_is_not_written_over_unasked(tmp_path: Path) -> None:
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


def test_a_full_disk_ends_the_recording_and_not_the_run(small_disk: None, tmp_path: Path) -> None:
    path = tmp_path / "full.mcap"
    recorder = Recorder(path, info_for(), patient=True)
    recorder.open()
    made = assembly(recorder)
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


def writing(path: Path) -> tuple[Recorder, Assembly, Any]:
    """Begin to record a robot; give the process of the writer too."""
    recorder = Recorder(path, info_for())
    recorder.open()
    made = assembly(recorder)
    made.robot.start(made.clock)
    assert recorder._link is not None and recorder._link._process is not None
    return recorder, made, recorder._link._process


def test_a_writer_that_stops_delays_nothing_and_loses_nothing(tmp_path: Path) -> None:
    path = tmp_path / "late.mcap"
    recorder, made, process = writing(path)
    process.send_signal(19)  # SIGSTOP
    seen = ticks(made, 400)
    for tick in seen:
        recorder.record(tick)  # would never return if it waited
    process.send_signal(18)  # SIGCONT
    assert recorder.close("seconds").startswith("400 ticks")
    assert recorder.lost == 0
    back = list(RunRecording(path).ticks())
    assert list(map(exact, back)) == list(map(exact, seen))


def test_what_the_queue_cannot_hold_is_lost_and_counted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gazerig.robot.recording.writer_client.QUEUE_BYTES", 150_000)
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


def test_a_writer_that_dies_is_told_once_and_the_run_goes_on(tmp_path: Path) -> None:
    recorder, made, process = writing(tmp_path / "dead.mcap")
    process.kill()
    process.wait()
    said: list[str] = []
    for tick in ticks(made, 199):
        recorder.record(tick)
        said += recorder.events()
    assert said == ["recording stopped (its writer has died); the run continues without it"]
    assert "incomplete: its writer has died" in recorder.close("seconds")
