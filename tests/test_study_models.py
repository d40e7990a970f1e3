"""Tests of a study's models: published data sets with the figures that other programs print."""

from math import isnan

import numpy as np
import pytest

from gazerig.robot.study.statistics import bradley_terry, mixed_ordinal

BITTERNESS = np.array([
    [2, 1, 2, 3, 2, 3, 1, 2, 1], [3, 2, 3, 2, 3, 2, 1, 2, 2],
    [3, 1, 3, 3, 4, 3, 2, 2, 3], [4, 3, 2, 2, 3, 2, 2, 3, 2],
    [4, 2, 5, 3, 3, 2, 2, 3, 3], [4, 3, 5, 2, 3, 4, 3, 3, 2],
    [5, 5, 4, 5, 3, 5, 2, 3, 4], [5, 4, 4, 3, 3, 4, 3, 4, 4],
])  # fmt: skip
"""Nine judges of eight bottles (Randall 1989): cold, cold in contact, warm, warm in contact."""

WARM = np.repeat([0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0], 9)
CONTACT = np.repeat([0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 1.0], 9)
JUDGE = np.tile(np.arange(9), 8)


@pytest.mark.parametrize(
    ("nodes", "thresholds", "effects", "variance", "likelihood"),
    [
        (1, [-1.6237, 1.5134, 4.2285, 6.0888], [3.0630, 1.8349], 1.2795, -81.56541),
        (10, [-1.6235, 1.5128, 4.2271, 6.0862], [3.0619, 1.8334], 1.2877, -81.53246),
    ],
)  # fmt: skip
def test_wine_has_the_figures_of_the_package_ordinal(
    nodes: int, thresholds: list[float], effects: list[float], variance: float, likelihood: float
) -> None:
    """Christensen, "ordinal" for R, clmm(rating ~ temp + contact + (1 | judge))."""
    found = mixed_ordinal.fit(BITTERNESS.ravel(), np.stack([WARM, CONTACT], 1), JUDGE, nodes)
    assert found.converged
    assert found.thresholds == pytest.approx(thresholds, abs=2e-4)
    assert found.effects == pytest.approx(effects, abs=2e-4)
    assert found.spread**2 == pytest.approx(variance, abs=2e-4)
    assert found.log_likelihood == pytest.approx(likelihood, abs=2e-5)
    if nodes == 1:
        errors = [found.standard_error(0), found.standard_error(1)]
        assert errors == pytest.approx([0.5954, 0.5125], abs=2e-4)


def test_the_likelihood_does_not_change_with_more_nodes() -> None:
    """Participants who differ much, where the mode is hard to find."""
    rng = np.random.default_rng(0)
    a = rng.integers(1, 6, 24)
    b = np.clip(a + rng.integers(-1, 3, 24), 1, 5)
    y, who = np.concatenate([a, b]), np.tile(np.arange(24), 2)
    x = np.repeat([0.0, 1.0], 24)[:, None]
    few, many = (mixed_ordinal.fit(y, x, who, nodes) for nodes in (11, 41))
    assert few.spread > 4.0
    assert few.log_likelihood == pytest.approx(many.log_likelihood, abs=1e-2)
    assert few.effects == pytest.approx(many.effects, abs=1e-3)


def _answers(effect: float, people: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    own = rng.normal(0.0, 1.2, people)
    better = np.repeat([False, True], people)
    latent = np.tile(own, 2) + effect * better + rng.logistic(size=2 * people)
    y = 1 + np.digitize(latent, [-2.0, -0.7, 0.7, 2.0])
    return y, better, np.tile(np.arange(people), 2)


def test_simulated_answers_give_back_what_they_were_made_of() -> None:
    y, better, who = _answers(0.9, 1200, 1)
    found = mixed_ordinal.fit(y, better[:, None].astype(float), who)
    assert found.thresholds == pytest.approx([-2.0, -0.7, 0.7, 2.0], abs=0.25)
    assert found.effects[0] == pytest.approx(0.9, abs=3.0 * found.standard_error(0))
    assert found.spread == pytest.approx(1.2, abs=0.2)


def test_the_ordinal_test_finds_what_is_there_and_nothing_else() -> None:
    there = mixed_ordinal.ordinal_mixed(*_answers(1.5, 80, 2), two_sided=True)
    assert there.p < 0.001 and there.effect.low95 > 0.0
    above = mixed_ordinal.ordinal_mixed(*_answers(1.5, 80, 2), two_sided=False)
    assert above.p == pytest.approx(0.5 * there.p)
    absent = [
        mixed_ordinal.ordinal_mixed(*_answers(0.0, 15, s), two_sided=True).p for s in range(8)
    ]
    assert sum(p < 0.05 for p in absent) <= 2 and max(absent) > 0.3


def test_answers_that_separate_the_conditions_have_no_finite_effect() -> None:
    y, better = np.repeat([1, 5], 10), np.repeat([False, True], 10)
    found = mixed_ordinal.ordinal_mixed(y, better, np.tile(np.arange(10), 2), two_sided=True)
    assert any("separate" in note for note in found.notes)
    assert isnan(found.effect.low95) and found.p < 0.001


def test_what_cannot_be_fitted_is_said() -> None:
    same = mixed_ordinal.ordinal_mixed(
        np.full(8, 3), np.tile([True, False], 4), np.repeat(np.arange(4), 2), two_sided=True
    )
    assert same.p == 1.0 and same.notes == ("all answers are the same",)
    alone = mixed_ordinal.ordinal_mixed(
        np.array([1, 2]), np.array([False, True]), np.zeros(2, int), two_sided=True
    )
    assert isnan(alone.p)
    with pytest.raises(ValueError, match="same"):
        mixed_ordinal.fit(np.full(4, 2), np.zeros((4, 0)), np.arange(4))


TEAMS = ("Milwaukee", "Detroit", "Toronto", "New York", "Boston", "Cleveland", "Baltimore")
GAMES = {
    (0, 1): (7, 6), (0, 2): (9, 4), (0, 3): (7, 6), (0, 4): (7, 6), (0, 5): (9, 4), (0, 6): (11, 2),
    (1, 2): (7, 6), (1, 3): (5, 8), (1, 4): (11, 2), (1, 5): (9, 4), (1, 6): (9, 4),
    (2, 3): (7, 6), (2, 4): (7, 6), (2, 5): (8, 5), (2, 6): (12, 1),
    (3, 4): (6, 7), (3, 5): (7, 6), (3, 6): (10, 3),
    (4, 5): (7, 6), (4, 6): (12, 1), (5, 6): (6, 7),
}  # fmt: skip
"""American League 1987, eastern division (Agresti, Categorical Data Analysis, table 10.10)."""


def _wins(games: dict[tuple[int, int], tuple[int, int]], k: int) -> np.ndarray:
    wins = np.zeros((k, k), int)
    for (i, j), (won, lost) in games.items():
        wins[i, j], wins[j, i] = won, lost
    return wins


def test_baseball_has_the_scores_that_agresti_prints() -> None:
    found = bradley_terry.fit(_wins(GAMES, 7))
    above = found.scores - found.scores[-1]
    assert above == pytest.approx([1.58, 1.44, 1.29, 1.25, 1.11, 0.68, 0.0], abs=0.005)
    # The standard error that R's BradleyTerry2 prints of Milwaukee's.
    assert found.difference(0, 6)[1] == pytest.approx(0.3433, abs=1e-4)
    assert found.scores.sum() == pytest.approx(0.0, abs=1e-9)
    assert (found.intervals()[:, 0] < found.scores).all()


def test_two_conditions_have_the_binomial_chance() -> None:
    wins = _wins({(0, 1): (18, 6)}, 2)
    found = bradley_terry.preferred(wins, 0, 1, two_sided=True)
    assert found.effect.value == pytest.approx(np.log(18 / 6))
    assert found.statistic == pytest.approx(2 * (18 * np.log(1.5) + 6 * np.log(0.5)))
    assert found.exact_p == pytest.approx(0.0226562, abs=1e-6)  # 2 P(X >= 18), X of 24 tosses
    assert bradley_terry.preferred(wins, 1, 0, two_sided=False).exact_p > 0.97


def test_choices_against_a_third_condition_count() -> None:
    """By a logistic regression: equal scores of two conditions among three, likelihoods by hand."""
    wins = _wins({(0, 1): (6, 4), (0, 2): (9, 1), (1, 2): (5, 5)}, 3)
    direct = bradley_terry.preferred(_wins({(0, 1): (6, 4)}, 2), 0, 1, two_sided=True)
    found = bradley_terry.preferred(wins, 0, 1, two_sided=True)
    assert found.p < direct.p and isnan(found.exact_p)
    merged = 14 * np.log(14 / 20) + 6 * np.log(6 / 20) + 10 * np.log(0.5)
    free = bradley_terry.fit(wins).log_likelihood
    assert found.statistic == pytest.approx(2 * (free - merged))


@pytest.mark.parametrize(
    ("games", "says"),
    [
        ({}, "nothing was chosen"),
        ({(0, 1): (3, 2)}, "never compared"),
        (
            {(0, 1): (5, 0), (1, 2): (3, 2), (0, 2): (4, 0)},
            "condition 1 was chosen always over others",
        ),
    ],
)
def test_choices_without_finite_scores_are_refused_in_words(
    games: dict[tuple[int, int], tuple[int, int]], says: str
) -> None:
    found = bradley_terry.fit(_wins(games, 3))
    assert says in found.fault and np.isnan(found.scores).all()


def test_always_the_same_choice_still_has_an_exact_chance() -> None:
    found = bradley_terry.preferred(_wins({(0, 1): (8, 0)}, 2), 0, 1, two_sided=True)
    assert found.deciding_p == pytest.approx(2 / 2**8)
    assert isnan(found.effect.value) and any("always" in note for note in found.notes)


def test_circles_of_preference_are_counted() -> None:
    circle = _wins({(0, 1): (3, 0), (1, 2): (3, 0), (2, 0): (3, 0)}, 3)
    assert bradley_terry.circular_triples(circle) == (1, 1)
    assert bradley_terry.circular_triples(_wins(GAMES, 7))[1] == 35
