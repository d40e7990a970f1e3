"""Simulated runs of a rig, recorded, with their ticks."""

from pathlib import Path
from typing import NamedTuple

from gazerig.config.save_text import params_text, walk_text
from gazerig.config.schema import Rig
from gazerig.robot.app.assemble import Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.session import shut_down
from gazerig.robot.control.loop import Tick, run
from gazerig.robot.recording.read import RunRecording
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunInfo

STARTED = "2026-01-31T12:00:00+00:00"


class Run(NamedTuple):
    recording: RunRecording
    ticks: list[Tick]


def recorded(path: Path, rig: Rig, seconds: float) -> Run:
    """Record a simulated run; give its ticks too."""
    options = RunOptions(mock=True, fast=True, seed=5, scene="visitor", bus="emulated")
    info = RunInfo(
        "a rig", rig.profile, params_text(rig), 5, rig.loop.rate_hz, STARTED,
        walk_yaml=walk_text(rig.gaze.scanpath.transition_matrix), scene="visitor", mock=True, fast=True,
    )  # fmt: skip
    recorder = Recorder(path, info, patient=True)
    recorder.open()
    made = assemble(rig, options, Substitutes(body=recorder.wrap_body))
    seen: list[Tick] = []

    def watch(tick: Tick) -> None:
        recorder.record(tick)
        seen.append(tick)

    made.robot.start(made.clock)
    stop = recorder.wrap_stop(lambda s: "seconds" if s >= seconds - 1e-9 else None)
    count = run(made.robot, made.clock, lambda: made.loop, stop, watch)
    shut_down(made, count, lambda line: None)
    recorder.close(count.stopped_by, made.sent_digest())
    made.close()
    return Run(RunRecording(path), seen)
