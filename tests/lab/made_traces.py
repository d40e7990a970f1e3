"""Traces of gaze made for the report, and its verdicts by name."""

import numpy as np

from gazerig.features.lab.analysis.blink_finder import BlinkEvent
from gazerig.features.lab.analysis.event_detector import CommandedSaccade, SaccadeEvent
from gazerig.features.lab.report.gaze_trace import GazeTrace, TraceRow
from gazerig.features.lab.report.report import judge_run
from gazerig.features.lab.report.statistics import MeasureResult

EMPTY = GazeTrace(np.zeros((0, len(TraceRow._fields))), (), (), ())


def verdicts(run: GazeTrace) -> dict[str, MeasureResult]:
    return {finding.band.key: finding for finding in judge_run(run)}


def run_of(saccades: list[tuple[float, float, float, float]], blinks: int = 0) -> GazeTrace:
    """Make a run of saccades: amplitude, duration in ms, peak, time of the peak."""
    every = tuple(
        SaccadeEvent(0.4 * n, d / 1e3, a, v, at, CommandedSaccade(0.4 * n, d / 1e3, a, v))
        for n, (a, d, v, at) in enumerate(saccades)
    )
    shuts = tuple(BlinkEvent(3.0 * n, 0.08, 0.04, 0.19, 1.0, 20.0, 10.0) for n in range(blinks))
    rows = np.full((600, len(TraceRow._fields)), np.nan)
    rows[:, 0] = np.arange(600) * 0.05
    rows[:, TraceRow._fields.index("mode")] = 0.0
    return GazeTrace(rows, every, (), shuts, shuts)
