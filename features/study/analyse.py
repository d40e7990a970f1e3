"""Analysis of a study's answers: what counts, scores of each condition, and decisions."""

from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from gazerig.drivers.errors import SetupError
from gazerig.features.study.design import (
    PAIR,
    Hypothesis,
    Measure,
    Questionnaire,
    StudyDesign,
    Test,
    design_measures,
)
from gazerig.features.study.journal import (
    ItemAnswered,
    ParticipationClosed,
    ParticipationOpened,
    StudyFolder,
)
from gazerig.features.study.statistics import (
    StatisticalTest,
    chi_square_test,
    cohens_dz,
    correct_p_values,
    rank_sum_test,
    sign_test,
    signed_rank_test,
)
from gazerig.gaze.types import Floats

FASTEST_MS = 300.0
"""A page of answers that were all given faster is left out."""
LEAST_SAME = 8
"""Participants with as many ratings or more, all equal, are left out."""
Scores = dict[str, dict[str, list[float]]]
"""Condition -> code of the participant -> a value for each trial."""


class Answer(NamedTuple):
    """An answer; left_out: reason of its exclusion, "" if it counts."""

    participant: str
    record: ItemAnswered
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
    """The data of a report; left_out: reason by participant; scores: of ratings, by measure."""

    design: StudyDesign
    questionnaires: Mapping[str, Questionnaire]
    participants: tuple[str, ...]
    simulated: bool
    left_out: dict[str, str]
    answers: list[Answer]
    scores: dict[Measure, Scores]
    decisions: list[Decision]

    @property
    def counted(self) -> int:
        """Return the number of participants who count."""
        return len(self.participants) - len(self.left_out)


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
    reasons = {code: _exclusion(records, questionnaires) for code, records in journals.items()}
    answers = [
        Answer(code, row, reasons[code] or left_out)
        for code, records in journals.items()
        for row, left_out in _answers(records)
    ]
    counted = [one for one in answers if not one.left_out]
    measures = design_measures(design, questionnaires)
    scores = {one: _scores(one, counted, design, questionnaires) for one in measures.values()}
    decisions = [_decide(one, scores[measures[one.measure]]) for one in design.hypotheses]
    opened = [one for records in journals.values() for one in records]
    return StudyAnalysis(
        design, questionnaires, tuple(journals),
        any(one.simulated for one in opened if isinstance(one, ParticipationOpened)),
        {code: reason for code, reason in reasons.items() if reason}, answers, scores,
        _correct(decisions, design.plan.alpha),
    )  # fmt: skip


def _answers(records: Sequence[Any]) -> list[tuple[ItemAnswered, str]]:
    """Return one participant's answers, with the reasons of their exclusion."""
    rows = [one for one in records if isinstance(one, ItemAnswered)]
    slowest_ms: dict[tuple[int | None, str], float] = {}
    for row in rows:
        page = row.trial, row.questionnaire
        slowest_ms[page] = max(slowest_ms.get(page, 0.0), row.ms)
    found = []
    for row in rows:
        left_out = "" if row.value is not None else "not answered"
        if row.trial is not None and row.trial < 0:
            left_out = "practice"
        elif slowest_ms[row.trial, row.questionnaire] < FASTEST_MS:
            left_out = "answered too fast"
        found.append((row, left_out))
    return found


def _exclusion(records: Sequence[Any], questionnaires: Mapping[str, Questionnaire]) -> str:
    """Return the reason of a participant's exclusion, "" without one."""
    closed = [one for one in records if isinstance(one, ParticipationClosed)]
    if not closed:
        return "did not finish"
    if not closed[0].finished:
        return "withdrew"
    ratings = [
        row.value
        for row, left_out in _answers(records)
        if row.trial is not None and left_out not in ("practice", "not answered")
        and questionnaires[row.questionnaire].items[row.item].kind == "rating"
    ]  # fmt: skip
    same = len(ratings) >= LEAST_SAME and len(set(ratings)) == 1
    return "gave one answer to every item of all trials" if same else ""


def _scores(
    measure: Measure,
    counted: Sequence[Answer],
    design: StudyDesign,
    questionnaires: Mapping[str, Questionnaire],
) -> Scores:
    """Return the values of each trial: a rating, or the mean of a scale.

    Reversed items are inverted; a scale with answers to fewer than half of its items has no value.
    A choice is a 1 under "chosen|other" instead of a condition.
    """
    items = questionnaires[measure.questionnaire].items
    pages: dict[tuple[str, int | None, str], list[float]] = {}
    for code, row, _ in counted:
        if row.questionnaire == measure.questionnaire and row.item in measure.items:
            item, condition, value = items[row.item], row.condition, 1
            if isinstance(row.value, int):
                value = item.points + 1 - row.value if item.reverse else row.value
            elif row.value == "second":
                condition = PAIR.join(reversed(condition.split(PAIR)))
            pages.setdefault((code, row.trial, condition), []).append(value)
    scores: Scores = {condition: {} for condition in design.conditions}
    for (code, _, condition), values in pages.items():
        if 2 * len(values) >= len(measure.items):
            scores.setdefault(condition, {}).setdefault(code, []).append(float(np.mean(values)))
    return scores


def _decide(one: Hypothesis, scores: Scores) -> Decision:
    """Return the results of a hypothesis' tests."""
    if one.test == "sign":
        wins, losses = (
            scores.get(PAIR.join(pair), {})
            for pair in ((one.better, one.than), (one.than, one.better))
        )
        codes = [*wins.keys() | losses.keys()]
        leans = np.array([len(wins.get(code, ())) - len(losses.get(code, ())) for code in codes])
        test = sign_test(leans) if leans.any() else _NO_DIFFERENCE
        count, of = sum(map(len, wins.values())), sum(map(len, (*wins.values(), *losses.values())))
        share = count / of if of else nan
        return Decision(one, len(codes), (share, 1.0 - share), nan, (test,))
    sides = scores[one.better], scores[one.than]
    codes = [code for code in sides[0] if code in sides[1]]
    better, than = (np.array([np.mean(side[code]) for code in codes]) for side in sides)
    means = (float(better.mean()), float(than.mean())) if codes else (nan, nan)
    if len(codes) < 2 or not (better != than).any():
        return Decision(one, len(codes), means, nan, (_NO_DIFFERENCE,))
    tests = tuple([_run_test(key, better, than, one, scores) for key in (one.test, *one.also)])
    return Decision(one, len(codes), means, cohens_dz(better, than), tests)


_NO_DIFFERENCE = StatisticalTest("signed_rank", 0.0, 1.0, 1.0, nan)


def _run_test(
    key: Test, better: Floats, than: Floats, one: Hypothesis, scores: Scores
) -> StatisticalTest:
    if key == "signed_rank":
        return signed_rank_test(better, than)
    if key == "rank_sum":
        return rank_sum_test(better, than)
    single = (np.concatenate([*scores[side].values()]) for side in (one.better, one.than))
    return chi_square_test(*single)


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
