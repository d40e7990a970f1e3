"""All measures of a run and their comparison with the bands, without figures."""

from gazerig.features.lab.analysis.human_norms import BANDS
from gazerig.features.lab.report import blinks, eye_head, face, saccades, turns
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, MeasureResult, judge


def measure_run(run: GazeTrace) -> tuple[MeasuredValue, ...]:
    """Measure everything that applies to the rig's joints and the run's mode of conversation."""
    found = {
        measured.key: measured
        for measured in (
            *saccades.measures(run), *face.measures(run), *eye_head.measures(run),
            *blinks.measures(run), *turns.measures(run),
        )
    }  # fmt: skip
    # An estimated eye follows its command, whatever the real eye does.
    if not run.joints.has_measured_eye:
        del found["unasked"]
    return tuple(
        found[band.key]
        for band in BANDS
        if band.key in found
        and run.joints.has_any(band.joints)
        and (not band.mode or run.mode in band.mode.split())
    )


def judge_run(run: GazeTrace, intervals: bool = True) -> tuple[MeasureResult, ...]:
    """Measure a run and compare it with the bands.

    Args:
        run: The run.
        intervals: Whether to compute intervals, without which nothing is uncertain.
    """
    return tuple(
        judge(measured, intervals, run.ideal_servos and measured.band.servos)
        for measured in measure_run(run)
    )
