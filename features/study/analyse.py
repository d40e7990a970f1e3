"""Analysis of a study's answers: what counts, scores of each condition, and decisions."""

from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.features.study.design import (
    PAIR,
    Hypothesis,
    Measure,
    Questionnaire,
    StudyDesign,
    design_measures,
)
from gazerig.features.study.journal import Record, StudyFolder
from gazerig.features.study.statistics import (
    StatisticalTest,
    chi_square_test,
    cohens_dz,
    correct_p_values,
    rank_sum_test,
    sign_test,
    signed_rank_test,
)

Scores = dict[str, dict[str, list[float]]]
"""Condition -> code of the participant -> a value for each trial."""


class Answer(NamedTuple):
    """An answer; left_out: reason of its exclusion, "" if it counts."""

    participant: str
    record: Record
    left_out: str


class Decision(NamedTuple):
    """The decision on one hypothesis.

    n: participants with both conditions; means: of the better and of the other condition, for
        choices the shares; d_z: Cohen's d_z of the participants' differences
    tests: the planned test, then exploratory ones
    corrected_p: p value of the planned test, corrected over all hypotheses
    verdict: "supported", "not supported", "against" (significant, but of the other sign), or "too
        few": no answers of so few participants could have been significant
    """

    hypothesis: Hypothesis
    n: int
    means: tuple[float, float]
    d_z: float
    tests: tuple[StatisticalTest, ...]
    corrected_p: float = nan
    verdict: str = "too few"


class StudyAnalysis(NamedTuple):
    """The data of a report; reasons: of each participant's exclusion, "" for those who count."""

    design: StudyDesign
    questionnaires: Mapping[str, Questionnaire]
    simulated: bool
    reasons: dict[str, str]
    answers: list[Answer]
    scores: dict[Measure, Scores]
    decisions: list[Decision]


def analyse_study(path: Path) -> StudyAnalysis:
    """Analyse the data of a study.

    Raises:
        SetupError: the folder holds no study or no participant, or a file is damaged.
    """
    folder = StudyFolder(path)
    stored, journals = folder.design(), folder.journals()
    design, questionnaires = stored.design, stored.questionnaires
    if not journals:
        raise SetupError(f"{path} has no participant yet: gazerig study run STUDY --participant 1")
    reasons = {code: _exclusion(records) for code, records in journals.items()}
    answers = [
        Answer(code, row, reasons[code] or ("practice" if (row.trial or 0) < 0 else ""))
        for code, records in journals.items()
        for row in records
        if row.kind == "answered"
    ]
    counted = [one for one in answers if not one.left_out]
    measures = design_measures(design, questionnaires)
    scores = {one: _scores(one, counted, design, questionnaires) for one in measures.values()}
    decisions = [_decide(one, scores[measures[one.measure]]) for one in design.hypotheses]
    return StudyAnalysis(
        design,
        questionnaires,
        any(records[0].simulated for records in journals.values()),
        reasons,
        answers,
        scores,
        _correct(decisions, design.plan.alpha),
    )


def _exclusion(records: Sequence[Record]) -> str:
    """Return the reason of a participant's exclusion, "" without one."""
    return records[-1].note if records[-1].kind == "closed" else "did not finish"


def _scores(
    measure: Measure,
    counted: Sequence[Answer],
    design: StudyDesign,
    questionnaires: Mapping[str, Questionnaire],
) -> Scores:
    """Return the values of each trial: a rating, or the mean of a scale.

    Reversed items are inverted. A choice in the pair "a|b" is a 1 for one of "a|b" and "b|a", the
    first of which is chosen, and a 0 for the other.
    """
    items = questionnaires[measure.questionnaire].items
    pages: dict[tuple[str, int | None, str], list[float]] = {}
    for code, row, _ in counted:
        if row.questionnaire != measure.questionnaire or row.item not in measure.items:
            continue
        item, values = items[row.item], dict[str, float]()
        if isinstance(row.value, int):
            values[row.condition] = item.points + 1 - row.value if item.reverse else row.value
        else:
            values[row.condition] = row.value == "first"
            values[PAIR.join(reversed(row.condition.split(PAIR)))] = row.value == "second"
        for condition, value in values.items():
            pages.setdefault((code, row.trial, condition), []).append(value)
    scores: Scores = {condition: {} for condition in design.conditions}
    for (code, _, condition), parts in pages.items():
        scores.setdefault(condition, {}).setdefault(code, []).append(float(np.mean(parts)))
    return scores


def _decide(one: Hypothesis, scores: Scores) -> Decision:
    """Return the results of a hypothesis' tests."""
    keys = one.better, one.than
    if one.test == "sign":
        keys = PAIR.join(keys), PAIR.join(reversed(keys))
    sides = [scores.get(key, {}) for key in keys]
    codes = [code for code in sides[0] if code in sides[1]]
    better, than = (np.array([np.mean(side[code]) for code in codes]) for side in sides)
    if len(codes) < 2 or not (better != than).any():
        return Decision(one, len(codes), (nan, nan), nan, (_NO_DIFFERENCE,))
    single = [np.concatenate([*side.values()]) for side in sides]
    tests = tuple(
        chi_square_test(*single) if key == "chi_square" else _TESTS[key](better, than)
        for key in (one.test, *one.also)
    )
    means = float(better.mean()), float(than.mean())
    return Decision(one, len(codes), means, cohens_dz(better, than), tests)


_NO_DIFFERENCE = StatisticalTest("none: no differences", 0.0, 1.0, 1.0, nan)
_TESTS = {"signed_rank": signed_rank_test, "rank_sum": rank_sum_test, "sign": sign_test}


def _correct(decisions: Sequence[Decision], alpha: float) -> list[Decision]:
    """Return the decisions with corrected p values and verdicts."""
    corrected = correct_p_values([one.tests[0].exact_p for one in decisions])
    found = []
    for one, p in zip(decisions, corrected, strict=True):
        verdict = "not supported"
        if 2.0 * 0.5**one.n > alpha:
            verdict = "too few"
        elif p <= alpha:
            verdict = "supported" if one.tests[0].effect > 0.0 else "against"
        found.append(one._replace(corrected_p=p, verdict=verdict))
    return found
