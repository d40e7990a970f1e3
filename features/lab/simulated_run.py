"""Run in simulated time for its figures only: nothing is shown, recorded or tuned."""

from collections.abc import Callable
from typing import NamedTuple

from gazerig.config.rig import Rig
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.report.gaze_trace import GazeTrace, GazeTraceBuilder
from gazerig.robot.loop.tick import Tick
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.session import Session


class SimulatedRun(NamedTuple):
    """The summary's figures of a run, and the trace for the report's measures."""

    figures: dict[str, object]
    trace: GazeTrace


def simulate(
    rig: Rig,
    options: RunOptions,
    stopped: Callable[[], str | None] = lambda: None,
    watch: Callable[[Tick], object] = lambda tick: None,
) -> SimulatedRun:
    """Run a rig from torque on to torque off.

    Args:
        rig: the configuration; the options' rig, character and profile are only names.
        options: with emulated servos, simulated time and a scene.
        stopped: returns why to end early, None to continue.
        watch: receives every tick.

    Raises:
        gazerig.config.load.ConfigError: a file that the rig names has a fault.
        SetupError: the options do not fit the rig, or the run ended with a fault.
    """
    builder = GazeTraceBuilder(ideal_servos=options.bus == "ideal")
    failures = list[Exception]()

    def update(tick: Tick) -> None:
        try:
            builder.update(tick)
            watch(tick)
        except Exception as error:
            failures.append(error)  # a run continues without a failed observer
            raise

    figures = Session(Run(rig, options), stopped, lambda line: None, watch=update).run()
    if failures:
        raise failures[0]
    stopped_by = str(figures["stopped_by"])
    if stopped_by.startswith("fault"):
        raise SetupError(f"the simulated run ended by a {stopped_by}")
    return SimulatedRun(figures, builder.trace())
