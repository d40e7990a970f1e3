"""All measures of a run and their comparison with the bands, without figures."""

from gazerig.features.lab.analysis.human_norms import BY_KEY, band_applies
from gazerig.features.lab.report import (
    blinks,
    eye_contact,
    eye_head,
    face,
    landing,
    pursuit,
    rests,
    saccades,
    turns,
)
from gazerig.features.lab.report.gaze_trace import GazeTrace
from gazerig.features.lab.report.statistics import MeasuredValue, MeasureResult, judge


def measure_run(run: GazeTrace) -> tuple[MeasuredValue, ...]:
    """Measure everything that applies to the rig's joints and the run's mode of conversation."""
    each = (
        saccades.measures(run), landing.measures(run), rests.measures(run), face.measures(run),
        eye_head.measures(run), pursuit.measures(run), blinks.measures(run),
        eye_contact.measures(run), saccades.reaction_measures(run), turns.measures(run.turns()),
    )  # fmt: skip
    return tuple(
        m
        for group in each
        for m in group
        if band_applies(BY_KEY[m.key], run.mode) and not run.joints.left_out(m.key)
    )


def judge_run(run: GazeTrace) -> tuple[MeasureResult, ...]:
    """Measure a run and compare it with the bands."""
    return tuple(judge(m, BY_KEY[m.key]) for m in measure_run(run))
