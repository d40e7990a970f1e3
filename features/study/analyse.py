"""Analysis of a study's answers: what counts, scores of each condition, tests and decisions.

Large-sample p values are SciPy's, corrected for ties and for continuity; exact ones count all
signs or swaps of the participants' answers, including midranks (Streitberg & Roehmel 1986).
"""

from collections.abc import Mapping, Sequence
from math import nan
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy import stats

from gazerig.drivers.errors import SetupError
from gazerig.features.study.design import (
    PAIR,
    Hypothesis,
    Measure,
    Questionnaire,
    StudyDesign,
    design_measures,
)
from gazerig.features.study.journal import JournalRecord, StudyFolder
from gazerig.gaze.types import Floats

ALPHA = 0.05
"""Probability of a false alarm, over all hypotheses (Holm's correction)."""
Scores = dict[str, dict[str, list[float]]]
"""Condition -> code of the participant -> a value for each trial."""


class StatisticalTest(NamedTuple):
    """The results of one test.

    p: from the statistic's distribution in large samples; exact_p: nan if it was not computed
    effect: matched rank-biserial correlation, Cliff's delta, net share of participants or
        Cramer's V
    """

    key: str
    statistic: float
    p: float
    exact_p: float
    effect: float


def signed_rank_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test the participants' differences: Wilcoxon's signed-rank test, zeros left out.

    The effect is the matched-pairs rank-biserial correlation (Kerby 2014).
    """
    d = better - than
    d = d[d != 0.0]
    found = stats.wilcoxon(d, correction=True, method="asymptotic")
    ranks = np.sign(d) * stats.rankdata(np.abs(d))
    effect = float(ranks.sum() / np.abs(ranks).sum())
    return StatisticalTest(
        "signed_rank", found.statistic, found.pvalue, exact_sign_p(ranks), effect
    )


def rank_sum_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test whether answers tend to be higher: Wilcoxon's rank-sum (Mann and Whitney's U).

    The large-sample p value treats both answers of a participant as those of two people; the exact
    one swaps each participant's two answers, and is valid for any dependence between them.
    """
    found = stats.mannwhitneyu(better, than, method="asymptotic")
    ranks = stats.rankdata([better, than]).reshape(2, -1)
    exact = exact_sign_p(ranks[0] - ranks[1])
    effect = float(np.sign(np.subtract.outer(better, than)).mean())  # Cliff's delta (1993)
    return StatisticalTest("rank_sum", found.statistic, found.pvalue, exact, effect)


def sign_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test whether more participants lean to one side than to the other: the exact sign test."""
    above, kept = int((better > than).sum()), int((better != than).sum())
    p = stats.binomtest(above, kept).pvalue
    return StatisticalTest("sign", above, p, p, 2.0 * above / kept - 1.0)


def chi_square_test(better: Floats, than: Floats) -> StatisticalTest:
    """Test whether single answers have one distribution: Pearson's chi-square of the counts.

    Without correction for continuity, and with each answer as another person's.
    """
    table = np.array(
        [[np.sum(side == x) for x in np.union1d(better, than)] for side in (better, than)]
    )
    found = stats.chi2_contingency(table, correction=False)
    effect = float(np.sqrt(found.statistic / table.sum()))
    return StatisticalTest("chi_square", found.statistic, found.pvalue, nan, effect)


def exact_sign_p(scores: Floats) -> float:
    """Return the share of all signs of scores (n,), halves allowed, with as extreme a sum."""
    doubled = np.rint(2.0 * scores).astype(np.int64)
    chances = np.zeros(int(np.abs(doubled).sum()) + 1)
    chances[0] = 1.0
    for size in np.abs(doubled):
        chances = 0.5 * (chances + np.roll(chances, size))  # what is rolled over is zero
    seen = int(doubled[doubled > 0].sum())
    return min(1.0, 2.0 * float(min(chances[seen:].sum(), chances[: seen + 1].sum())))


def correct_p_values(p_values: Sequence[float]) -> list[float]:
    """Return p values corrected by Holm's step-down procedure (1979), in their order."""
    corrected, least = list(p_values), 0.0
    for rank, k in enumerate(np.argsort(p_values)):
        least = max(least, min(1.0, (len(p_values) - rank) * p_values[k]))
        corrected[k] = least
    return corrected


class CountedAnswer(NamedTuple):
    """An answer; left_out: reason of its exclusion, "" if it counts."""

    participant: str
    record: JournalRecord
    left_out: str


class Decision(NamedTuple):
    """The decision on one hypothesis.

    n: participants with both conditions; means: of the better and of the other condition, for
        choices the shares
    tests: the planned test, then exploratory ones
    corrected_p: p value of the planned test, corrected over all hypotheses
    verdict: "supported", "not supported", "against" (significant, but of the other sign), or "too
        few": no answers of so few participants could have been significant
    """

    hypothesis: Hypothesis
    n: int
    means: tuple[float, float]
    tests: tuple[StatisticalTest, ...]
    corrected_p: float = nan
    verdict: str = "too few"


class StudyAnalysis(NamedTuple):
    """The data of a report; reasons: of each participant's exclusion, "" for those who count."""

    design: StudyDesign
    questionnaires: Mapping[str, Questionnaire]
    simulated: bool
    reasons: dict[str, str]
    answers: list[CountedAnswer]
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
    reasons = {
        code: records[-1].note if records[-1].kind == "closed" else "did not finish"
        for code, records in journals.items()
    }
    answers = [
        CountedAnswer(code, row, reasons[code] or ("practice" if (row.trial or 0) < 0 else ""))
        for code, records in journals.items()
        for row in records
        if row.kind == "answered"
    ]
    counted = [one for one in answers if not one.left_out]
    measures = design_measures(design, questionnaires)
    scores = {one: _scores(one, counted, design, questionnaires) for one in measures.values()}
    decisions = _correct([_decide(one, scores[measures[one.measure]]) for one in design.hypotheses])
    simulated = any(records[0].simulated for records in journals.values())
    return StudyAnalysis(design, questionnaires, simulated, reasons, answers, scores, decisions)


def _scores(
    measure: Measure,
    counted: Sequence[CountedAnswer],
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
    keys = one.better, one.than
    if one.test == "sign":
        keys = PAIR.join(keys), PAIR.join(reversed(keys))
    sides = [scores.get(key, {}) for key in keys]
    codes = [code for code in sides[0] if code in sides[1]]
    better, than = (np.array([np.mean(side[code]) for code in codes]) for side in sides)
    if not (better != than).any():
        return Decision(one, len(codes), (nan, nan), (_NO_DIFFERENCE,))
    single = [np.concatenate([*side.values()]) for side in sides]
    tests = tuple(
        chi_square_test(*single) if key == "chi_square" else _TESTS[key](better, than)
        for key in (one.test, *one.also)
    )
    means = float(better.mean()), float(than.mean())
    return Decision(one, len(codes), means, tests)


_NO_DIFFERENCE = StatisticalTest("none: no differences", 0.0, 1.0, 1.0, nan)
_TESTS = {"signed_rank": signed_rank_test, "rank_sum": rank_sum_test, "sign": sign_test}


def _correct(decisions: Sequence[Decision]) -> list[Decision]:
    corrected = correct_p_values([one.tests[0].exact_p for one in decisions])
    found = []
    for one, p in zip(decisions, corrected, strict=True):
        verdict = "not supported"
        if 2.0 * 0.5**one.n > ALPHA:
            verdict = "too few"
        elif p <= ALPHA:
            verdict = "supported" if one.tests[0].effect > 0.0 else "against"
        found.append(one._replace(corrected_p=p, verdict=verdict))
    return found
