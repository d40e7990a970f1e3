"""Power that is claimed is power that drawn studies have; sample sizes grow as they must."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from scipy import stats
from study_records import QUESTIONS, design, pairs, records

from gazerig.features.study.design import DECIDING, Hypothesis, Test, Trials
from gazerig.features.study.participation import participation
from gazerig.features.study.power import (
    MOST,
    PowerQuestion,
    joint_probabilities,
    power_claim,
    power_of,
    sample_size,
    sample_size_by_formula,
)
from gazerig.features.study.run.study_file import load_study
from gazerig.features.study.scores import choice_wins, design_measures, measure_scores
from gazerig.features.study.simulation import (
    BETWEEN_SD,
    ITEM_SD,
    TRIAL_SD,
    Population,
    SimulatedParticipant,
    choice_probability,
    differences,
    effect_shift,
    factor_levels,
    ratings_from_latent,
    shift_effect,
)
from gazerig.features.study.statistics.ranks import exact_signed_rank, exact_swaps, sign_test

SIGNED = PowerQuestion("signed_rank", 0.6, 0.05)
STUDIES = 500
SHIFTS = (0.6 * sqrt(2.0), 0.0)
"""Means in units of the noise that give d_z = .6."""


@pytest.mark.parametrize(
    ("n", "alpha", "two_sided"),
    [(9, 0.05, True), (24, 0.05, True), (24, 0.0125, True), (18, 0.05, False), (50, 0.05, True)],
)
def test_the_claim_is_what_simulated_participants_give(
    n: int, alpha: float, two_sided: bool
) -> None:
    asked = replace(SIGNED, alpha=alpha, two_sided=two_sided, effect=0.4 if n == 50 else 0.6)
    drawn = differences(asked.effect, (STUDIES, n), np.random.default_rng(n))
    found = [row.any() and exact_signed_rank(row, two_sided) <= alpha for row in drawn]
    # The standard error of 500 studies is .018 to .022; the seed is fixed.
    assert power_of(asked, n) == pytest.approx(np.mean(found), abs=0.045)


def test_the_joint_chances_are_those_of_the_effect() -> None:
    chances, points = joint_probabilities(0.6, 5), np.arange(1, 6)
    assert chances.sum() == pytest.approx(1.0, abs=1e-9)
    difference = points[:, None] - points[None, :]
    mean = (chances * difference).sum()
    spread = np.sqrt((chances * (difference - mean) ** 2).sum())
    assert mean / spread == pytest.approx(0.6, abs=2e-3)
    assert shift_effect(effect_shift(0.6, 5), 5) == pytest.approx(0.6, abs=1e-6)
    assert joint_probabilities(0.0, 5) == pytest.approx(joint_probabilities(0.0, 5).T)


@pytest.mark.parametrize("test", DECIDING)
@pytest.mark.parametrize("points", [5, 9])
def test_without_an_effect_it_is_the_chance_of_a_false_alarm(test: Test, points: int) -> None:
    asked = PowerQuestion(test, 0.0, 0.05, points=points)
    assert 0.0 < power_of(asked, 40) < 0.056
    assert power_of(asked, 0) == 0.0


def test_fewer_than_six_different_answers_can_never_be_significant() -> None:
    assert power_of(SIGNED, 5) == 0.0  # the least chance of five signs is 2 / 32
    assert power_of(replace(SIGNED, alpha=0.01), 7) == 0.0
    assert power_of(SIGNED, 6) > 0.0


def test_continuous_answers_have_the_power_that_the_efficiency_says() -> None:
    asked = replace(SIGNED, points=0)
    t_test = stats.nct.sf(stats.t.isf(0.025, 99), 99, 0.3 * 10)
    assert power_of(replace(asked, effect=0.3 * np.sqrt(np.pi / 3)), 100) == pytest.approx(
        t_test, abs=0.02
    )
    assert sample_size(asked, 0.8) == pytest.approx(sample_size_by_formula(asked, 0.8), abs=3)


def test_ties_cost_power_and_more_participants_give_it() -> None:
    by_n = [power_of(SIGNED, n) for n in (8, 12, 16, 24, 36, 60)]
    assert by_n == sorted(by_n) and by_n[-1] > 0.98
    by_effect = [power_of(replace(SIGNED, effect=d), 24) for d in (0.2, 0.4, 0.6, 0.8)]
    assert by_effect == sorted(by_effect)
    few = sample_size(SIGNED, 0.8)
    assert few is not None and few >= sample_size_by_formula(SIGNED, 0.8)
    assert power_of(SIGNED, few) >= 0.8


@pytest.mark.parametrize("multiple", [1, 2, 6, 10])
def test_a_sample_size_is_the_least_multiple_with_the_power(multiple: int) -> None:
    n = sample_size(SIGNED, 0.8, multiple)
    assert n is not None and n % multiple == 0
    assert power_of(SIGNED, n) >= 0.8 > power_of(SIGNED, n - multiple)


def test_what_would_take_too_many_has_no_size() -> None:
    assert sample_size(replace(SIGNED, effect=0.05, points=0), 0.95) is None
    assert sample_size_by_formula(replace(SIGNED, effect=0.05), 0.95) > MOST


@pytest.mark.parametrize("points", [5, 0])
def test_the_rank_sum_test_has_the_power_of_its_swaps(points: int) -> None:
    rng = np.random.default_rng(2)
    if points:
        cells = joint_probabilities(0.6, 5)
        drawn = rng.choice(25, (300, 20), p=(cells / cells.sum()).ravel()).astype(float)
        above, below = drawn // 5, drawn % 5
    else:
        own = 0.8 * rng.normal(size=(300, 20))
        above, below = (own + sqrt(0.98) * rng.normal(shift, size=(300, 20)) for shift in SHIFTS)
    found = [exact_swaps(a, b) <= 0.05 for a, b in zip(above, below, strict=True)]
    # The standard error of 300 studies is .026; the seed is fixed.
    asked = replace(SIGNED, test="rank_sum", points=points)
    assert power_of(asked, 20) == pytest.approx(np.mean(found), abs=0.06)


def test_choices_have_the_sign_tests_power() -> None:
    asked = PowerQuestion("sign", 0.6, 0.05)
    share = stats.norm.cdf(0.6)
    exact = [stats.binomtest(k, 30).pvalue <= 0.05 for k in range(31)]
    assert power_of(asked, 30) == pytest.approx(stats.binom.pmf(range(31), 30, share) @ exact)
    one = replace(asked, two_sided=False)
    exact = [stats.binomtest(k, 30, alternative="greater").pvalue <= 0.05 for k in range(31)]
    assert power_of(one, 30) == pytest.approx(stats.binom.pmf(range(31), 30, share) @ exact)
    n = sample_size(asked, 0.8)
    assert n is not None and 30 < n < 45


def test_repeated_choices_have_the_power_of_participants_and_not_of_choices() -> None:
    asked = PowerQuestion("sign", 0.3, 0.05, choices=4)
    more = np.random.default_rng(3).binomial(4, stats.norm.cdf(0.3), (400, 24)) - 2
    found = np.mean([sign_test(row).deciding_p <= 0.05 for row in more])
    # The standard error of 400 studies is .025; the seed is fixed.
    assert power_of(asked, 24) == pytest.approx(found, abs=0.06)
    assert power_of(asked, 24) < power_of(replace(asked, choices=1), 96)


def test_a_hypothesis_gets_its_share_of_the_false_alarms() -> None:
    study = load_study("default_against_papers")
    known = design_measures(study.design, study.questionnaires)
    one = study.design.hypotheses[0]
    found = power_claim(study.design, one, known[one.measure])
    assert found.question.alpha == pytest.approx(0.05 / 4)
    assert found.participants == 42 and found.power >= 0.8
    assert found.needed is not None and found.needed <= 42 and found.needed % 6 == 0
    alone = replace(study.design, plan=replace(study.design.plan, correction="none"))
    assert power_claim(alone, one, known[one.measure]).question.alpha == 0.05


# --- Tests of simulated participants: the effect has the given size, and nothing drifts


@pytest.mark.parametrize("points", [2, 5, 7, 11])
@pytest.mark.parametrize("effect", [-0.8, 0.3, 1.2])
def test_differences_have_the_effect_asked_for(points: int, effect: float) -> None:
    found = differences(effect, (1, 60000), np.random.default_rng(1), points)[0]
    assert found.mean() / found.std() == pytest.approx(effect, abs=0.02)


@pytest.mark.parametrize(("items", "repetitions"), [(1, 1), (6, 1), (1, 3), (6, 3)])
def test_means_of_scales_and_repetitions_have_it_too(items: int, repetitions: int) -> None:
    shift = effect_shift(0.6, 5, items, repetitions)
    rng, people = np.random.default_rng(2), 20000
    own = rng.normal(0.0, BETWEEN_SD, (people, 1, 1))
    means = []
    for side in (0.5, -0.5):
        trial = rng.normal(0.0, TRIAL_SD, (people, repetitions, 1))
        item = rng.normal(0.0, ITEM_SD, (people, repetitions, items))
        means.append(ratings_from_latent(own + trial + item + side * shift, 5).mean(axis=(1, 2)))
    found = means[0] - means[1]
    assert found.mean() / found.std() == pytest.approx(0.6, abs=0.025)
    assert shift_effect(shift, 5, items, repetitions) == pytest.approx(0.6)


@pytest.mark.parametrize(("people", "effect"), [(12, 0.8), (24, 0.6), (40, 0.5)])
def test_500_studies_find_as_often_as_their_design_claims(people: int, effect: float) -> None:
    """tests/study/bench_study_power.py runs 500 whole studies for each test."""
    rows = differences(effect, (500, people), np.random.default_rng(5))
    share = np.mean([exact_signed_rank(row) <= 0.05 for row in rows])
    claimed = power_of(PowerQuestion("signed_rank", effect, 0.05), people)
    assert share == pytest.approx(claimed, abs=0.03)


def test_levels_follow_the_hypotheses() -> None:
    chain = (Hypothesis("paper.looked_at", "a", "b"), Hypothesis("paper.looked_at", "b", "c"))
    assert factor_levels(design(("a", "b", "c"), hypotheses=chain)) == {"a": 2, "b": 1, "c": 0}
    assert factor_levels(design(("a", "b", "c"), hypotheses=())) == {"a": 1, "b": 0, "c": 0}
    circle = (*chain, Hypothesis("paper.looked_at", "c", "a"))
    assert max(factor_levels(design(("a", "b", "c"), hypotheses=circle)).values()) <= 2


def test_the_same_participant_answers_the_same_in_any_order() -> None:
    study = design()
    one = SimulatedParticipant(study, QUESTIONS, 7, Population(seed=3))
    two = SimulatedParticipant(study, QUESTIONS, 7, Population(seed=3))
    asked = [
        (t, c, i) for t, c in enumerate(("walk", "centre")) for i in ("naturalness", "looked_at")
    ]
    first = [one.answer(t, c, "paper", i) for t, c, i in asked]
    again = [two.answer(t, c, "paper", i) for t, c, i in reversed(asked)]
    assert first == again[::-1]
    others = [
        [SimulatedParticipant(study, QUESTIONS, k, Population()).answer(t, c, "paper", i)
         for t, c, i in asked]
        for k in range(1, 6)
    ]  # fmt: skip
    assert len({str(answers) for answers in others}) == 5


def test_a_whole_study_has_the_effect_on_items_and_on_scales() -> None:
    study = design(questionnaires=("paper", "calmness"))
    people = [participation(records(study, k), study, QUESTIONS) for k in range(1, 241)]
    known = design_measures(study, QUESTIONS)
    for name in ("paper.naturalness", "calmness.ease"):
        found = measure_scores(known[name], people, tuple(study.conditions), QUESTIONS)
        d = found.condition_means("walk") - found.condition_means("centre")
        # The standard error of d_z (Hedges & Olkin 1985) is sqrt(1/n + d^2/2n).
        assert d.mean() / d.std() == pytest.approx(0.6, abs=3 * sqrt(1 / 240 + 0.18 / 240))


def test_choices_prefer_as_often_as_differences_are_positive() -> None:
    study = pairs(("walk", "centre"))
    people = [participation(records(study, k), study, QUESTIONS) for k in range(1, 301)]
    table = choice_wins(
        design_measures(study, QUESTIONS)["choice.alive"], people, tuple(study.conditions)
    )
    assert table.sum() == 300
    assert table[0, 1] / 300 == pytest.approx(stats.norm.cdf(0.6), abs=0.08)
    assert choice_probability(0.0) == 0.5


def test_careless_and_hasty_ones_are_among_them_and_are_left_out() -> None:
    study = replace(design(), trials=Trials(repetitions=2))
    careless = Population(careless=0.3, hasty=0.2)
    people = [participation(records(study, k, careless), study, QUESTIONS) for k in range(1, 61)]
    same = [p for p in people if "one answer" in p.left_out]
    fast = [p for p in people if any(r.left_out == "answered too fast" for r in p.answers)]
    assert 8 <= len(same) <= 32 and 4 <= len(fast) <= 22


def test_objective_measures_have_the_effect_over_repetitions() -> None:
    study = replace(design(), objective=("mutual_gaze_share",), trials=Trials(repetitions=2))
    d = []
    for k in range(1, 401):
        person = SimulatedParticipant(study, QUESTIONS, k, Population(0.8))
        found = [person.simulate_measures(t, c)["mutual_gaze_share"]
                 for t, c in enumerate(("walk", "walk", "centre", "centre"))]  # fmt: skip
        d.append(found[0] + found[1] - found[2] - found[3])
    assert np.mean(d) / np.std(d) == pytest.approx(0.8, abs=0.2)
