"""Simulated runs of whole robots: started, ticked, recorded and let go."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.chooser import TargetChooser
from gazerig.robot.loop.loop import LoopCount, run
from gazerig.robot.loop.power_down import Interrupts
from gazerig.robot.loop.tick import Tick
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.run_rig import run_info
from gazerig.robot.run.session import prepare_shutdown

VISIT = RunOptions(mock=True, fast=True, seed=5, scene="visitor")


def simulated(
    rig: Rig | str = "desk",
    scene: str = "visitor",
    seed: int = 0,
    chooser: TargetChooser | None = None,
    wrap_body: Callable[[Body], Body] | None = None,
    **options: Any,
) -> Run:
    """Return a robot in simulated time that has not begun; options: others of RunOptions."""
    found = RunOptions(mock=True, fast=True, seed=seed, scene=scene, **options)
    whole = load_rig(rig) if isinstance(rig, str) else rig
    return Run(whole, found, chooser=chooser, wrap_body=wrap_body)


def ticks(made: Run, number: int, dt_s: float = 0.005) -> list[Tick]:
    """Tick on in simulated time, 200 times a second; return the ticks."""
    done = []
    for _ in range(number):
        made.clock.sleep_until(made.clock.now_s() + dt_s)
        done.append(made.robot.tick(made.clock.now_s(), dt_s))
    return done


Watch = Callable[[Tick], object]


def go(made: Run, seconds: float, watch: Watch = lambda tick: None) -> LoopCount:
    """Run the loop of a robot that has started for a time."""

    def end(s: float) -> str | None:
        return "over" if s >= seconds - 1e-9 else None

    return run(made.robot, made.clock, made.loop, end, watch)


def play(made: Run, seconds: float, watch: Watch = lambda tick: None) -> LoopCount:
    """Start a robot, run its loop for a time, stop it and close it."""
    made.robot.start(made.clock)
    try:
        return go(made, seconds, watch)
    finally:
        made.robot.stop()
        made.close()


def record(
    path: Path,
    rig: Rig,
    seconds: float,
    options: RunOptions = VISIT,
    at: Callable[[int, Run], None] = lambda n, made: None,
) -> list[Tick]:
    """Record a run as ``gazerig run --fast --record`` does; ``at``: called after each tick."""
    recorder = Recorder(path, run_info(rig, options), patient=True)
    recorder.open()
    made = Run(rig, options, wrap_body=recorder.wrap_body)
    seen: list[Tick] = []

    def watch(tick: Tick) -> None:
        recorder.record(tick)
        seen.append(tick)
        at(len(seen), made)

    made.robot.start(made.clock)
    stop = recorder.wrap_stop(lambda s: "seconds" if s >= seconds - 1e-9 else None)
    count = run(made.robot, made.clock, made.loop, stop, watch)
    prepare_shutdown(made, lambda line: None, Interrupts()).shut_down()
    recorder.close(count.stopped_by, made.bus.sent_bytes_digest())
    made.close()
    return seen
