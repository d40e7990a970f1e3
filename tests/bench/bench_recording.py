"""Cost of recording: the loop's jitter and processor time with it and without, bytes, reading.

Usage: .venv/bin/python tests/bench/bench_recording.py [SECONDS] [SIMULATED_SECONDS]

One run in real time on the emulated bus records in every other second, so that both are
measured under the same load; then a simulated run is recorded and read.
"""

import sys
import tempfile
import time
import tracemalloc
from pathlib import Path

import numpy as np

from gazerig.config.save_text import params_text, walk_text
from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import Assembly, Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.resimulate import rerun
from gazerig.robot.app.session import shut_down
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunInfo, versions


def made(fast: bool, recording: Recorder) -> Assembly:
    """Assemble the desk rig with emulated servos before a simulated visitor."""
    options = RunOptions(mock=True, fast=fast, seed=0, scene="visitor")
    return assemble(load_rig("desk"), options, Substitutes(body=recording.wrap_body))


def recorder(path: Path, fast: bool) -> Recorder:
    """Make a recorder as ``gazerig run --record`` does."""
    rig = load_rig("desk")
    info = RunInfo(
        "desk", rig.profile, params_text(rig), 0, rig.loop.rate_hz, "2026-01-31T00:00:00+00:00",
        walk_yaml=walk_text(rig.gaze.scanpath.transition_matrix), scene="visitor", mock=True, fast=fast,
        versions=versions(),
    )  # fmt: skip
    return Recorder(path, info, patient=fast)


def jitter(path: Path, seconds: float) -> None:
    """Run in real time; print lateness and processor time of ticks with and without."""
    recording = recorder(path, fast=False)
    assembly = made(False, recording)
    recording.open()
    robot, clock = assembly.robot, assembly.clock
    rows: list[tuple[bool, float, float, float]] = []
    before = [time.thread_time(), 0.0]
    began: list[float] = []

    def watch(tick: Tick) -> None:
        began[:] = began or [tick.t_s]
        on = int(tick.t_s - began[0]) % 2 == 1
        start_s = time.thread_time()
        if on:
            recording.record(tick)
        now_s = time.thread_time()
        rows.append((on, tick.t_s, now_s - start_s, now_s - before[0]))
        before[0] = now_s

    robot.start(clock)
    try:
        count = run(
            robot, clock, assembly.loop, lambda s: "seconds" if s >= seconds else None, watch
        )
    finally:
        shut_down(assembly, count, print)
        print(recording.close("seconds"))
        assembly.close()
    print(f"overruns: {count.overruns} of {count.ticks} ticks")
    on = np.array([row[0] for row in rows])
    times = np.array([row[1] for row in rows])
    gaps = np.diff(times, prepend=times[0] - 0.005) - 0.005
    for name, which in (("off", ~on), ("on", on)):
        off_us = 1e6 * np.abs(gaps[which])
        note = 1e6 * np.array([row[2] for row in rows])[which]
        cpu = 1e6 * np.array([row[3] for row in rows])[which]
        print(
            f"recording {name:3}: interval off by p50 {np.percentile(off_us, 50):.0f} us, p99 "
            f"{np.percentile(off_us, 99):.0f} us, worst {off_us.max():.0f} us; note() p50 "
            f"{np.percentile(note, 50):.0f} us, p99 {np.percentile(note, 99):.0f} us; loop thread "
            f"{cpu.mean():.0f} us of processor a tick"
        )


def volume(path: Path, seconds: float) -> None:
    """Record simulated seconds; print bytes a minute and the speed of reading."""
    recording = recorder(path, fast=True)
    assembly = made(True, recording)
    robot = assembly.robot
    recording.open()
    robot.start(assembly.clock)
    start_s = time.monotonic()
    stop = recording.wrap_stop(lambda s: "seconds" if s >= seconds else None)
    count = run(robot, assembly.clock, assembly.loop, stop, recording.record)
    shut_down(assembly, count, lambda line: None)
    print(recording.close("seconds", assembly.sent_bytes_digest()))
    print(f"recorded in {time.monotonic() - start_s:.1f} s")
    size = path.stat().st_size
    print(f"{size / count.ticks:.0f} bytes a tick, {size / seconds * 60 / 1e6:.2f} MB a minute")
    tracemalloc.start()
    start_s = time.monotonic()
    found = RunRecording(path)
    opened_s = time.monotonic() - start_s
    ticks = sum(1 for _, _ in zip(found.ticks(), range(2000), strict=False))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    print(f"opened in {opened_s * 1e3:.1f} ms; memory for reading {peak / 1e6:.1f} MB")
    start_s = time.monotonic()
    ticks = sum(1 for _ in found.ticks())
    read_s = time.monotonic() - start_s
    print(
        f"{ticks} ticks read in {read_s:.1f} s: {read_s / ticks * 1e6:.0f} us each, ten minutes at "
        f"200 Hz in {read_s / ticks * 120_000:.0f} s"
    )
    start_s = time.monotonic()
    again = rerun(found)
    print(
        f"run again in {time.monotonic() - start_s:.1f} s: {again.agreeing_ticks} of {again.ticks} ticks "
        f"and the bus bytes {'the same' if again.sent_bytes_same else 'differ'}"
    )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        jitter(Path(folder) / "jitter.mcap", float(sys.argv[1]) if len(sys.argv) > 1 else 30.0)
        volume(Path(folder) / "volume.mcap", float(sys.argv[2]) if len(sys.argv) > 2 else 60.0)
