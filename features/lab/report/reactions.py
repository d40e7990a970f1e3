"""Latency of the gaze to things that come into view."""

import numpy as np

from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, mean, median

EXPRESS_MS = 120.0
"""Faster reactions are express saccades."""


def measures(run: GazeTrace) -> list[MeasuredValue]:
    """Return the measures of reactions."""
    latency_ms = np.array([1e3 * reaction.latency_s for reaction in run.reactions])
    return [
        MeasuredValue("reaction", latency_ms, median),
        MeasuredValue("express", (latency_ms < EXPRESS_MS).astype(float), mean),
    ]
