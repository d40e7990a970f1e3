"""Decisions on the hypotheses of a study, by their planned tests."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import isfinite, nan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gazerig.features.lab.report.statistics import correct_p_values
from gazerig.features.study.design import Hypothesis, StudyDesign, Test
from gazerig.features.study.participation import Participation
from gazerig.features.study.questionnaire import Questionnaire
from gazerig.features.study.scores import (
    Measure,
    Scores,
    choice_differences,
    choice_wins,
    design_measures,
    measure_scores,
)
from gazerig.features.study.statistics.assumptions import (
    AssumptionCheck,
    difference_checks,
    range_check,
)
from gazerig.features.study.statistics.contingency import chi_square, counts_of
from gazerig.features.study.statistics.effects import EffectSize, StatisticalTest, cohens_dz
from gazerig.features.study.statistics.ranks import (
    friedman_test,
    rank_sum_test,
    sign_test,
    signed_rank_test,
)
from gazerig.gaze.types import Floats

Verdict = Literal["supported", "not supported", "against", "too few"]
"""Verdict; "against": the difference is significant, but the test's effect has the other sign."""

_LEAST_PEOPLE = 2


@dataclass(frozen=True)
class Decision:
    """The decision on one hypothesis.

    test: the planned test, None without data; further_tests: further tests
    corrected_p: p value of the planned test, corrected over all hypotheses
    n: participants with all conditions of both sides; standardised: d_z of their differences
    medians, means: of the better and of the other condition; for choices the shares in all direct
        choices, and no medians
    too_few: reason why no result could have been significant, "" if one could
    """

    hypothesis: Hypothesis
    measure: Measure
    test: StatisticalTest | None
    further_tests: tuple[StatisticalTest, ...]
    corrected_p: float
    verdict: Verdict
    n: int
    medians: tuple[float, float]
    means: tuple[float, float]
    standardised: EffectSize | None
    checks: tuple[AssumptionCheck, ...]
    too_few: str = ""


def decide_hypotheses(
    design: StudyDesign,
    questionnaires: Mapping[str, Questionnaire],
    people: Sequence[Participation],
) -> tuple[Decision, ...]:
    """Decide on every hypothesis of a design, with the correction that it planned."""
    known = design_measures(design, questionnaires)
    found = [
        _decide_rating(design, one, known[one.measure], questionnaires, people)
        for one in design.hypotheses
    ]
    chances = {
        str(k): one.test.deciding_p
        for k, one in enumerate(found)
        if one.test is not None and isfinite(one.test.deciding_p)
    }
    many = correct_p_values(chances, design.plan.correction)
    decided = []
    for k, one in enumerate(found):
        p, verdict = many.get(str(k), nan), one.verdict
        if one.test is None or one.too_few or not isfinite(p):
            verdict = "too few"
        elif p <= design.plan.alpha:
            # The difference of means may have another sign than the ranks that the test compares.
            verdict = "supported" if one.test.effect.value > 0.0 else "against"
        decided.append(replace(one, corrected_p=p, verdict=verdict))
    return tuple(decided)


def _decide_rating(
    design: StudyDesign,
    one: Hypothesis,
    measure: Measure,
    questionnaires: Mapping[str, Questionnaire],
    people: Sequence[Participation],
) -> Decision:
    conditions = tuple(design.conditions)
    if measure.kind == "choice":
        return _decide_choice(design, one, measure, people)
    found = measure_scores(measure, people, conditions, questionnaires)
    sides = _Sides(found, design.side(one.better), design.side(one.than))
    better, than = sides.means
    n = len(better)
    if n < _LEAST_PEOPLE:
        why = f"{n} of {design.plan.participants} participants have both conditions"
        nothing = (nan, nan)
        return Decision(one, measure, None, (), nan, "too few", n, nothing, nothing, None, (), why)
    tests = [_run_test(key, one, sides, measure) for key in (one.test, *one.also)]
    checks = difference_checks(better - than, sides.better_first)
    if measure.kind in ("item", "scale"):
        answers = [found.answers(*sides.than), found.answers(*sides.better)]
        checks.append(range_check(np.concatenate(answers), measure.points))
    return Decision(
        one, measure, tests[0], tuple(tests[1:]), nan, "not supported", n,
        (float(np.median(better)), float(np.median(than))), (float(better.mean()),
        float(than.mean())), cohens_dz(better - than), tuple(checks),
        _too_few_reason(tests[0], design.plan.alpha),
    )  # fmt: skip


@dataclass(frozen=True)
class _Sides:
    """Both sides of a hypothesis: a condition each, or all conditions of a factor's level."""

    found: Scores
    better: tuple[str, ...]
    than: tuple[str, ...]

    @property
    def have_data(self) -> NDArray[np.bool_]:
        """Return which participants have all conditions of both sides, (participants,)."""
        found: NDArray[np.bool_] = np.isfinite(self.found.condition_means(*self.better, *self.than))
        return found

    @property
    def means(self) -> tuple[Floats, Floats]:
        """Return the means of the better side and of the other one, (known,) each."""
        return self.found.condition_means(*self.better)[self.have_data], self.found.condition_means(
            *self.than
        )[self.have_data]

    @property
    def better_first(self) -> NDArray[np.bool_]:
        """Return whether each participant saw the better side first, (known,)."""
        first, second = self.found.first_seen(*self.better), self.found.first_seen(*self.than)
        found: NDArray[np.bool_] = (first < second)[self.have_data]
        return found


def _run_test(key: Test, one: Hypothesis, sides: _Sides, measure: Measure) -> StatisticalTest:
    found, (better, than) = sides.found, sides.means
    if key == "signed_rank":
        return signed_rank_test(better - than, one.two_sided)
    if key == "rank_sum":
        return rank_sum_test(than, better, one.two_sided, paired=True)
    if key == "friedman":
        return friedman_test(found.means[np.isfinite(found.means).all(axis=1)])
    if key == "chi_square":
        rows = [counts_of(found.answers(*c), measure.points) for c in (sides.better, sides.than)]
        return chi_square(rows, paired=True)
    raise ValueError(f"{key} cannot decide on a rating")


def _decide_choice(
    design: StudyDesign, one: Hypothesis, measure: Measure, people: Sequence[Participation]
) -> Decision:
    """Decide on a hypothesis about choices between two conditions."""
    conditions = tuple(design.conditions)
    table = choice_wins(measure, people, conditions)
    better, than = (
        conditions.index(key) for name in (one.better, one.than) for key in design.side(name)
    )
    direct = int(table[better, than] + table[than, better])
    leans = choice_differences(measure, people, conditions[better], conditions[than])
    if not direct:
        why = "nobody has chosen"
        nothing = (nan, nan)
        return Decision(one, measure, None, (), nan, "too few", 0, nothing, nothing, None, (), why)
    test = sign_test(leans, one.two_sided)
    share = float(table[better, than]) / direct
    return Decision(
        one, measure, test, (), nan, "not supported", len(leans), (nan, nan), (share, 1.0 - share),
        None, (), _too_few_reason(test, design.plan.alpha),
    )  # fmt: skip


def _too_few_reason(test: StatisticalTest, alpha: float) -> str:
    """Return why no result could have reached alpha, "" if one could."""
    if test.least_p <= alpha:
        return ""
    return (
        f"the most extreme answers that so few could give have p = {test.least_p:.3f}, "
        f"which is above {alpha:g}"
    )
