"""A recorded run, and what it was recorded from."""

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import numpy as np
from fakes.runs import simulated
from msgspec.structs import replace

from gazerig.config.save import params_text
from gazerig.config.schema import load_rig, load_walk
from gazerig.drivers.types import Detections
from gazerig.robot.loop.loop import Tick, run
from gazerig.robot.model.commands import Ask, Command, Jog, LookAt, Resume, Stop, Tune
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunInfo, versions
from gazerig.robot.run.run import Run

STARTED = datetime(2026, 1, 31, 23, 59, 59, 250_000, UTC)


def info_for() -> RunInfo:
    rig = load_rig("desk")
    return RunInfo(
        rig="desk",
        profile=rig.profile,
        config_yaml=params_text(rig),
        walk_yaml=params_text(load_walk(rig.gaze.scanpath.transition_matrix)),
        seed=7,
        rate_hz=rig.loop.rate_hz,
        started_utc=STARTED,
        scene="visitor",
        eyes="scene visitor",
        mock=True,
        fast=True,
        pictures_hz=4.0,
        versions=versions(),
    )


class Recorded(NamedTuple):
    path: Path
    ticks: list[Tick]
    info: RunInfo
    said: str


def record(
    path: Path, seconds: float, at: Callable[[int, Run], None] = lambda n, made: None
) -> Recorded:
    """Record a simulated run with a drawn picture in every tenth tick."""
    info = info_for()
    recorder = Recorder(path, info, patient=True)
    recorder.open()
    made = simulated(seed=7, wrap_body=recorder.wrap_body)
    seen: list[Tick] = []

    def watch(tick: Tick) -> None:
        at(len(seen), made)
        recorder.record(with_picture(tick, len(seen)))
        seen.append(tick)

    made.robot.start(made.clock)
    stop = recorder.wrap_stop(lambda s: "seconds" if s >= seconds - 1e-9 else None)
    count = run(made.robot, made.clock, made.loop, stop, watch)
    made.robot.stop()
    said = recorder.close(count.stopped_by, made.bus.sent_bytes_digest())
    made.close()
    assert recorder.events() == () and recorder.lost == 0
    return Recorded(path, seen, info, said)


def with_picture(tick: Tick, number: int) -> Tick:
    if number % 10:
        return tick
    picture = np.full((40, 60, 3), number % 250, np.uint8)
    return replace(tick, detections=Detections(tick.t_s - 0.03, number + 1, 60, 40, image=picture))


def ordered(number: int, made: Run) -> None:
    """Ask for one of everything."""
    orders: dict[int, Command] = {
        50: Ask("behaviour", "guard"),
        60: LookAt((1.0, 0.2, 0.3)),
        80: Jog((("neck_yaw", 0.1),)),
        100: Jog(()),
        110: Stop("look at this"),
        140: Resume(),
        160: Tune((("gaze.saccade.profile", "min_jerk"), ("guard.soft_start_speed_deg_s", 50.0))),
    }
    if number in orders:
        made.robot.command(orders[number])


def exact(tick: Tick) -> str:
    """Write a tick so that two are the same only where every bit is; arrays apart."""
    return repr(replace(tick, detections=None, percept=None))
