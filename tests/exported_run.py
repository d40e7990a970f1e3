"""A simulated run before a face, to be exported."""

from collections.abc import Sequence

from fakes.runs import play

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick
from gazerig.robot.recording.gaze_angles import (
    GazeAngles,
    LabelledInterval,
    Labels,
    collect_gaze_angles,
    find_intervals,
    label_samples,
)

RATE_HZ = 200.0


def seen(scene: str, seconds: float) -> list[Tick]:
    """Run a simulated head and give its ticks."""
    made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene=scene))
    ticks: list[Tick] = []
    play(made, seconds, ticks.append)
    return ticks


class Run:
    """One run with all that is made of it."""

    def __init__(self, ticks: Sequence[Tick]) -> None:
        self.ticks = ticks
        self.trace: GazeAngles = collect_gaze_angles(ticks)
        self.labels: Labels = label_samples(self.trace)
        self.stretches: tuple[LabelledInterval, ...] = find_intervals(self.trace, self.labels)
