"""Tests of simulated participants: the effect is there as it was asked for, and nothing drifts."""

from dataclasses import replace
from math import sqrt

import numpy as np
import pytest
from scipy import stats
from study_records import QUESTIONS, design, pairs, records

from gazerig.features.study.design import Hypothesis, Trials
from gazerig.features.study.measures import measures
from gazerig.features.study.participation import participation
from gazerig.features.study.power import PowerQuestion, power_of
from gazerig.features.study.scores import scores, wins
from gazerig.features.study.simulation import (
    BETWEEN_SD,
    ITEM_SD,
    TRIAL_SD,
    Population,
    SimulatedParticipant,
    choice_probability,
    differences,
    effect_of,
    levels,
    ratings_from_latent,
    shift_of,
)
from gazerig.features.study.statistics.ranks import exact_signed_rank


@pytest.mark.parametrize("points", [2, 5, 7, 11])
@pytest.mark.parametrize("effect", [-0.8, 0.3, 1.2])
def test_differences_have_the_effect_asked_for(points: int, effect: float) -> None:
    found = differences(effect, (1, 60000), np.random.default_rng(1), points)[0]
    assert found.mean() / found.std() == pytest.approx(effect, abs=0.02)


@pytest.mark.parametrize(("items", "repetitions"), [(1, 1), (6, 1), (1, 3), (6, 3)])
def test_means_of_scales_and_repetitions_have_it_too(items: int, repetitions: int) -> None:
    shift = shift_of(0.6, 5, items, repetitions)
    rng, people = np.random.default_rng(2), 20000
    own = rng.normal(0.0, BETWEEN_SD, (people, 1, 1))
    means = []
    for side in (0.5, -0.5):
        trial = rng.normal(0.0, TRIAL_SD, (people, repetitions, 1))
        item = rng.normal(0.0, ITEM_SD, (people, repetitions, items))
        means.append(ratings_from_latent(own + trial + item + side * shift, 5).mean(axis=(1, 2)))
    found = means[0] - means[1]
    assert found.mean() / found.std() == pytest.approx(0.6, abs=0.025)
    assert effect_of(shift, 5, items, repetitions) == pytest.approx(0.6)


@pytest.mark.parametrize(("people", "effect"), [(12, 0.8), (24, 0.6), (40, 0.5)])
def test_500_studies_find_as_often_as_their_design_claims(people: int, effect: float) -> None:
    """tests/study/bench_study_power.py lets 500 studies go the whole way, for each test."""
    rows = differences(effect, (500, people), np.random.default_rng(5))
    share = np.mean([exact_signed_rank(row) <= 0.05 for row in rows])
    claimed = power_of(PowerQuestion("signed_rank", effect, 0.05), people)
    assert share == pytest.approx(claimed, abs=0.03)


def test_levels_follow_the_hypotheses() -> None:
    chain = (Hypothesis("paper.looked_at", "a", "b"), Hypothesis("paper.looked_at", "b", "c"))
    assert levels(design(("a", "b", "c"), hypotheses=chain)) == {"a": 2, "b": 1, "c": 0}
    assert levels(design(("a", "b", "c"), hypotheses=())) == {"a": 1, "b": 0, "c": 0}
    circle = (*chain, Hypothesis("paper.looked_at", "c", "a"))
    assert max(levels(design(("a", "b", "c"), hypotheses=circle)).values()) <= 2


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
    known = measures(study, QUESTIONS)
    for name in ("paper.naturalness", "calmness.ease"):
        found = scores(known[name], people, tuple(study.conditions), QUESTIONS)
        d = found.column("walk") - found.column("centre")
        # The standard error of d_z (Hedges & Olkin 1985) is sqrt(1/n + d^2/2n).
        assert d.mean() / d.std() == pytest.approx(0.6, abs=3 * sqrt(1 / 240 + 0.18 / 240))


def test_choices_prefer_as_often_as_differences_are_positive() -> None:
    study = pairs(("walk", "centre"))
    people = [participation(records(study, k), study, QUESTIONS) for k in range(1, 301)]
    table = wins(measures(study, QUESTIONS)["choice.alive"], people, tuple(study.conditions))
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
        found = [person.measured(t, c)["mutual_gaze_share"]
                 for t, c in enumerate(("walk", "walk", "centre", "centre"))]  # fmt: skip
        d.append(found[0] + found[1] - found[2] - found[3])
    assert np.mean(d) / np.std(d) == pytest.approx(0.8, abs=0.2)
