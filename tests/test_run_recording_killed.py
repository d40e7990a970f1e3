"""A rig that is killed while it records: the file closes, or opens up to the last second."""

import os
import signal
import subprocess
import time
from datetime import UTC, datetime
from functools import partial
from pathlib import Path

import pytest
from branch import Branch
from child_processes import command
from fakes.runs import simulated

from gazerig.robot.app.assemble import Substitutes
from gazerig.robot.model.clock import RealClock
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunInfo

TICK_S = 0.05


def rig(path: Path) -> None:
    """Record a rig until it is killed, and print the time of each tick's transfer."""
    info = RunInfo("desk", "robot", "a: 1", 0, 1.0 / TICK_S, datetime(2026, 1, 31, tzinfo=UTC))
    recorder = Recorder(path, info)
    recorder.open()
    assert recorder._link is not None and recorder._link._process is not None
    print(recorder._link._process.pid, flush=True)
    made = simulated(substitutes=Substitutes(body=recorder.wrap_body))
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
            if float(line.split()[1]) >= 2.5:
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
def test_a_killed_rig_leaves_a_recording(tmp_path: Path, both: bool) -> None:
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
