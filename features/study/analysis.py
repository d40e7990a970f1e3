"""Analysis of a whole study: participants, measures of each condition, and decisions."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import comb, nan, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from gazerig.features.study.data_folder import InterimLook
from gazerig.features.study.decisions import Decision, decide_hypotheses
from gazerig.features.study.design import StudyDesign
from gazerig.features.study.participation import AnswerRow, Participation
from gazerig.features.study.questionnaire import Questionnaire
from gazerig.features.study.scores import (
    Measure,
    Scores,
    choice_wins,
    design_measures,
    item_answers,
    measure_scores,
)
from gazerig.features.study.statistics.contingency import Counts, counts_of
from gazerig.features.study.statistics.effects import EffectSize, cronbachs_alpha
from gazerig.gaze.types import Floats


@dataclass(frozen=True)
class ConditionSummary:
    """A measure in one condition.

    low95, high95: interval of the mean, within participants (Cousineau 2005, Morey 2008)
    """

    condition: str
    n: int
    mean: float
    low95: float
    high95: float
    sd: float
    median: float


@dataclass(frozen=True)
class MeasureSummary:
    """Summary of a rating, the mean of a scale, or an objective measure.

    counts: (conditions, points) number of answers at each point; None for other measures
    alpha: Cronbach's alpha of a scale
    """

    measure: Measure
    scores: Scores
    conditions: tuple[ConditionSummary, ...]
    counts: Counts | None
    alpha: EffectSize | None


@dataclass(frozen=True)
class ChoiceSummary:
    """Summary of choices between pairs.

    wins: (conditions, conditions) number of choices of the row over the column
    circles: number of circular triads by majority, and of all triples of conditions
    first: number of choices of the first presentation, and of all choices
    """

    measure: Measure
    wins: NDArray[np.int64]
    circles: tuple[int, int]
    first: tuple[int, int]


@dataclass(frozen=True)
class StudyAnalysis:
    """The data of a report.

    name: of the study's file; design_sha256: the hash in all data
    deleted: participants whose data were deleted; looks: analyses before the planned sample was
        complete
    """

    name: str
    design: StudyDesign
    questionnaires: Mapping[str, Questionnaire]
    design_sha256: str
    people: tuple[Participation, ...]
    decisions: tuple[Decision, ...]
    measures: tuple[MeasureSummary, ...]
    choices: tuple[ChoiceSummary, ...]
    deleted: int = 0
    looks: tuple[InterimLook, ...] = ()

    @property
    def counted(self) -> tuple[Participation, ...]:
        """Return the participants who are not excluded."""
        return tuple(one for one in self.people if not one.left_out)

    @property
    def remarks(self) -> tuple[AnswerRow, ...]:
        """Return the free texts that are not empty."""
        return tuple(
            row
            for one in self.counted
            for row in one.counted
            if isinstance(row.value, str)
            and row.value.strip()
            and self.questionnaires[row.questionnaire].items[row.item].kind == "text"
        )

    def label(self, name: str) -> str:
        """Return the label of a condition, or of a factor's level, in the report."""
        if name in self.design.conditions:
            return self.design.conditions[name].label or name
        return name.replace("=", " = ")


def analyse_study(
    name: str,
    design: StudyDesign,
    questionnaires: Mapping[str, Questionnaire],
    design_sha256: str,
    people: Sequence[Participation],
    deleted: int = 0,
) -> StudyAnalysis:
    """Analyse a study."""
    people = without_simulated(people)
    known = [one for one in design_measures(design, questionnaires).values() if not one.once]
    keys = tuple(design.conditions)
    summaries = [
        _summarise_measure(one, people, keys, questionnaires)
        for one in known
        if one.kind != "choice" and not (design.task == "pairwise" and one.kind != "objective")
    ]
    choices = [_summarise_choices(one, people, keys) for one in known if one.kind == "choice"]
    return StudyAnalysis(
        name, design, questionnaires, design_sha256, tuple(people),
        decide_hypotheses(design, questionnaires, people), tuple(summaries), tuple(choices), deleted,
    )  # fmt: skip


def without_simulated(people: Sequence[Participation]) -> tuple[Participation, ...]:
    """Omit simulated participants if the study has real ones."""
    if all(one.simulated for one in people):
        return tuple(people)
    return tuple(
        replace(one, left_out=one.left_out or "simulated") if one.simulated else one
        for one in people
    )


def _summarise_measure(
    measure: Measure,
    people: Sequence[Participation],
    conditions: tuple[str, ...],
    questionnaires: Mapping[str, Questionnaire],
) -> MeasureSummary:
    found = measure_scores(measure, people, conditions, questionnaires)
    counts = None
    if measure.kind == "item":
        counts = np.array([counts_of(found.answers(c), measure.points) for c in conditions])
    alpha = None
    if measure.kind == "scale":
        alpha = cronbachs_alpha(item_answers(measure, people, questionnaires))
    halves = within_participant_half_widths(found.means)
    out = []
    for k, condition in enumerate(found.conditions):
        column = found.means[:, k]
        known = column[np.isfinite(column)]
        mean = float(known.mean()) if len(known) else nan
        sd = float(known.std(ddof=1)) if len(known) > 1 else nan
        median = float(np.median(known)) if len(known) else nan
        half = float(halves[k])
        out.append(
            ConditionSummary(condition, len(known), mean, mean - half, mean + half, sd, median)
        )
    return MeasureSummary(measure, found, tuple(out), counts, alpha)


def within_participant_half_widths(means: Floats) -> Floats:
    """Return half the 95 % intervals of means within participants, (conditions,).

    Each participant's own level is subtracted (Cousineau 2005); the factor k / (k - 1) of Morey
    (2008) corrects the bias.

    Args:
        means: (participants, conditions); incomplete rows are ignored.
    """
    whole = means[np.isfinite(means).all(axis=1)]
    n, k = len(whole), means.shape[1]
    if n < 2 or k < 2:
        return np.full(k, nan)
    relative = whole - whole.mean(axis=1, keepdims=True)
    spread = relative.std(axis=0, ddof=1) * sqrt(k / (k - 1))
    return np.asarray(float(stats.t.ppf(0.975, n - 1)) * spread / sqrt(n), np.float64)


def _summarise_choices(
    measure: Measure, people: Sequence[Participation], conditions: tuple[str, ...]
) -> ChoiceSummary:
    table = choice_wins(measure, people, conditions)
    made = [
        row.value
        for one in people
        for row in one.counted
        if row.questionnaire == measure.questionnaire and row.item in measure.items
    ]
    first = sum(value == "first" for value in made), len(made)
    return ChoiceSummary(measure, table, circular_triples(table), first)


def circular_triples(wins: NDArray[np.int64]) -> tuple[int, int]:
    """Return the number of circular triads by majority, and of all triples of conditions."""
    majority = (wins > wins.T).astype(np.int64)
    circles = int(np.trace(np.linalg.matrix_power(majority, 3))) // 3
    return circles, comb(len(wins), 3)
