"""Tests of a study's statistics: by other programs, by hand and by enumeration."""

import importlib.util
import json
from itertools import combinations, permutations, product
from math import comb, isnan

import numpy as np
import pytest
from golden import study_p_values as golden
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats

from gazerig.features.lab.report.statistics import Correction, correct_p_values
from gazerig.features.study.statistics import effects, ranks
from gazerig.features.study.statistics.contingency import chi_square, counts_of
from gazerig.features.study.statistics.reliability import cronbachs_alpha

GOLDEN = json.loads(golden.FILE.read_text())
PINGOUIN = importlib.util.find_spec("pingouin") is not None


def ours(rows: np.ndarray) -> dict[str, float]:
    """Return what this program says under the names of the golden file."""
    a, b = rows[:, 0].astype(float), rows[:, 1].astype(float)
    table = chi_square([counts_of(a, 5), counts_of(b, 5)])
    out = {
        f"signed_rank {zeros} {side}": ranks.signed_rank(b - a, side == "two-sided", zeros).p
        for zeros in ("wilcox", "pratt")
        for side in ("two-sided", "greater")
    }
    friedman = ranks.friedman(rows.astype(float))
    return out | {
        "matched correlation": float(effects.matched_correlation(b - a)),
        "rank_sum two-sided": ranks.rank_sum(a, b).p,
        "rank_sum greater": ranks.rank_sum(a, b, two_sided=False).p,
        "dominance": float(effects.dominance(a, b)),
        "friedman": friedman.p,
        "concordance": friedman.effect.value,
        "chi_square": table.p,
        "cramers_v": table.effect.value,
        "cronbachs_alpha": cronbachs_alpha(rows.astype(float)).value,
    }


@pytest.mark.parametrize("k", range(golden.SETS))
def test_figures_equal_those_that_pingouin_gave(k: int) -> None:
    one = GOLDEN["sets"][k]
    assert ours(np.array(one["ratings"])) == pytest.approx(one["pingouin"], abs=1e-9)


@pytest.mark.skipif(not PINGOUIN, reason="pingouin is absent: it drags in 390 MB")
def test_figures_equal_those_that_pingouin_gives_here() -> None:
    for rows in golden.data_sets():
        assert ours(rows) == pytest.approx(golden.p_values(rows), abs=1e-9)


def test_the_golden_data_have_the_ties_that_they_are_for() -> None:
    sets = [np.array(one["ratings"]) for one in GOLDEN["sets"]]
    assert len(sets) == 20
    assert all(np.count_nonzero(s[:, 0] == s[:, 1]) for s in sets)
    assert all(np.array_equal(s, t) for s, t in zip(sets, golden.data_sets(), strict=True))


@pytest.mark.parametrize(("by", "theirs"), [("holm", "holm"), ("bonferroni", "bonf")])
def test_corrections_equal_pingouins(by: Correction, theirs: str) -> None:
    for name, expected in zip(
        ("rank_sum two-sided", "chi_square"), GOLDEN["corrected"][theirs], strict=True
    ):
        family = {str(k): one["pingouin"][name] for k, one in enumerate(GOLDEN["sets"])}
        found = correct_p_values(family, by)
        assert list(found) == list(family)
        assert list(found.values()) == pytest.approx(expected, abs=1e-12)


@settings(deadline=None, max_examples=40)
@given(some.lists(some.integers(-4, 4), min_size=1, max_size=9))
def test_the_exact_signed_rank_chance_is_that_of_all_signs(values: list[int]) -> None:
    d = np.array(values, float)
    for zeros in ("wilcox", "pratt"):
        kept = d[d != 0.0] if zeros == "wilcox" else d
        size = stats.rankdata(np.abs(kept))[kept != 0.0] if len(kept) else np.array([])
        sign = np.sign(kept[kept != 0.0])
        seen = size[sign > 0].sum()
        sums = [size[np.array(s) > 0].sum() for s in product((-1, 1), repeat=len(size))]
        above = np.mean([s >= seen - 1e-9 for s in sums])
        below = np.mean([s <= seen + 1e-9 for s in sums])
        assert ranks.exact_signed_rank(d, False, zeros) == pytest.approx(above)
        assert ranks.exact_signed_rank(d, True, zeros) == pytest.approx(
            min(1, 2 * min(above, below))
        )


@settings(deadline=None, max_examples=30)
@given(some.lists(some.integers(1, 5), min_size=2, max_size=8), some.data())
def test_the_exact_rank_sum_chance_is_that_of_all_divisions(
    values: list[int], data: some.DataObject
) -> None:
    n = data.draw(some.integers(1, len(values) - 1))
    whole = np.array(values, float)
    rank = stats.rankdata(whole)
    centre = (len(whole) - n) * (len(whole) + 1) / 2
    seen = rank[n:].sum()
    sums = np.array([sum(c) for c in combinations(rank, len(whole) - n)])
    two = np.mean(np.abs(sums - centre) >= abs(seen - centre) - 1e-9)
    assert ranks.exact_rank_sum(whole[:n], whole[n:]) == pytest.approx(two)
    one = np.mean(sums >= seen - 1e-9)
    assert ranks.exact_rank_sum(whole[:n], whole[n:], False) == pytest.approx(one)


@pytest.mark.parametrize("people", [60, 300])
def test_the_rank_sum_of_the_same_people_has_the_chance_of_their_swaps(people: int) -> None:
    """Answers that go together: taken as strangers', they would hide the difference."""
    rng = np.random.default_rng(people)
    own = rng.normal(0.0, 3.0, people)
    a, b = own + rng.normal(size=people), own + rng.normal(0.15, 1.0, people)
    found = ranks.rank_sum(a, b, paired=True)
    rank = stats.rankdata(np.concatenate([a, b]))
    score = rank[people:] - rank[:people]
    swapped = np.abs(rng.choice((-1.0, 1.0), (4000, people)) @ score)
    assert found.deciding_p == pytest.approx(np.mean(swapped >= abs(score.sum())), abs=0.03)
    assert ranks.rank_sum(a, b).deciding_p > found.deciding_p + 0.1


def test_without_ties_the_exact_chances_are_scipys() -> None:
    rng = np.random.default_rng(3)
    a, b = rng.normal(size=9), rng.normal(0.8, 1.0, 11)
    assert ranks.exact_rank_sum(a, b) == pytest.approx(
        stats.mannwhitneyu(a, b, method="exact").pvalue
    )
    assert ranks.exact_signed_rank(a) == pytest.approx(stats.wilcoxon(a, method="exact").pvalue)


def test_all_of_nine_above_is_the_papers_first_study_at_its_clearest() -> None:
    """Nine people (Nakamoto & Tsuruno 4.4.3): by hand 2/2^9, and 2/C(18, 9)."""
    a, b = np.array([1, 2, 2, 1, 2, 1, 2, 2, 1.0]), np.array([4, 5, 4, 4, 5, 5, 4, 4, 3.0])
    assert ranks.signed_rank(b - a).exact_p == pytest.approx(2 / 2**9)
    found = ranks.rank_sum(a, b)
    assert found.exact_p == pytest.approx(2 / comb(18, 9)) == found.least_p
    assert found.statistic == 81 and found.effect.value == 1.0
    # By hand: 4 columns-pairs never shared: chi-square is the number of answers.
    table = chi_square([counts_of(a, 5), counts_of(b, 5)], paired=True)
    assert table.statistic == pytest.approx(18.0) and table.df == 4
    assert table.p == pytest.approx(stats.chi2.sf(18.0, 4)) and table.p < 0.01
    assert table.effect.value == pytest.approx(1.0)
    assert any("below 5" in note for note in table.notes)


def test_a_known_table_of_counts() -> None:
    """Pearson's statistic by hand: ((5)^2/15 + ...) of rows 20, 10 and 10, 20 is 6.667."""
    found = chi_square([[20, 10], [10, 20]])
    assert found.statistic == pytest.approx(20 / 3) and found.df == 1 and found.notes == ()
    assert found.exact_p == pytest.approx(stats.fisher_exact([[20, 10], [10, 20]]).pvalue)
    assert found.effect.value == pytest.approx(1 / 3)
    assert found.effect.low95 < 1 / 3 < found.effect.high95


def test_columns_that_nobody_chose_are_dropped_and_said() -> None:
    found = chi_square([[0, 5, 7, 0, 9], [0, 9, 3, 0, 8]])
    assert found.df == 2
    assert any("2 of 5 columns are empty and dropped (1, 4)" in note for note in found.notes)
    same = chi_square([[0, 5], [0, 5]])
    assert same.p == 1.0 and "all answers are the same" in same.notes


def test_exact_chances_of_small_tables_are_enumerated_and_of_large_ones_drawn() -> None:
    small = chi_square([[3, 1, 1], [0, 2, 4]])
    brute = _enumerated(np.array([[3, 1, 1], [0, 2, 4]]))
    assert small.exact_p == pytest.approx(brute)
    large = chi_square([[12, 9, 4, 11, 8], [6, 8, 9, 14, 7], [3, 9, 9, 9, 14]])
    assert abs(large.exact_p - large.p) < 0.02  # expected counts above 5: both hold


def _enumerated(table: np.ndarray) -> float:
    """Return the share of all orders of the answers that are as extreme."""
    answers = np.repeat(np.arange(table.shape[1]), table.sum(axis=0))
    n, expected = table[0].sum(), np.outer(table.sum(1), table.sum(0)) / table.sum()

    def distance(first: np.ndarray) -> float:
        rows = np.stack([first, table.sum(0) - first])
        return float(((rows - expected) ** 2 / expected).sum())

    seen = distance(table[0])
    found = [
        distance(np.bincount(answers[list(c)], minlength=table.shape[1])) >= seen - 1e-9
        for c in combinations(range(len(answers)), int(n))
    ]
    return float(np.mean(found))


def test_the_drawn_chance_of_friedman_is_that_of_all_orders() -> None:
    rows = np.array([[1, 2, 4], [2, 2, 5], [1, 3, 3], [2, 4, 5.0]])
    rank = stats.rankdata(rows, axis=1)
    seen = (rank.sum(axis=0) ** 2).sum()
    every = [
        (np.sum([list(r) for r in orders], axis=0) ** 2).sum() >= seen - 1e-9
        for orders in product(*(list(permutations(r)) for r in rank))
    ]
    assert ranks.friedman(rows).exact_p == pytest.approx(np.mean(every), abs=0.01)
    with pytest.raises(ValueError, match="three conditions"):
        ranks.friedman(rows[:, :2])


def test_who_answers_alike_everywhere_differs_in_nothing() -> None:
    same = np.full(12, 3.0)
    assert ranks.signed_rank(same - same).deciding_p == 1.0
    assert ranks.rank_sum(same, same).deciding_p == 1.0
    assert ranks.friedman(np.stack([same] * 3, axis=1)).deciding_p == 1.0
    assert isnan(effects.cohens_dz(same - same).value)
    assert isnan(effects.rank_biserial(same - same).low95)
    with pytest.raises(ValueError, match="both sides"):
        ranks.rank_sum(same, same[:0])


def test_so_few_that_nothing_could_be_found_are_known_before() -> None:
    five = ranks.signed_rank(np.array([1.0, 2, 1, 3, 2]))
    assert five.exact_p == five.least_p == 2 / 2**5 > 0.05
    assert ranks.signed_rank(np.array([1.0, 2, 1, 3, 2, 1])).least_p < 0.05


def test_intervals_hold_the_truth_about_nineteen_times_of_twenty() -> None:
    rng = np.random.default_rng(8)
    held = 0
    for _ in range(100):
        found = effects.cohens_dz(rng.normal(0.5, 1.0, 40), resamples=400)
        held += found.low95 <= 0.5 <= found.high95
    assert 88 <= held <= 100


def test_effects_turn_their_sign_with_the_conditions() -> None:
    rng = np.random.default_rng(9)
    a, b = rng.integers(1, 6, 20).astype(float), rng.integers(1, 6, 20).astype(float)
    for one, other in (
        (effects.rank_biserial(b - a), effects.rank_biserial(a - b)),
        (effects.cliffs_delta(a, b, True), effects.cliffs_delta(b, a, True)),
        (effects.cohens_dz(b - a), effects.cohens_dz(a - b)),
    ):
        assert one.value == pytest.approx(-other.value)
        assert one.low95 < one.value < one.high95


def test_cramers_v_has_smithsons_interval() -> None:
    """The bounds make the statistic seen the 97.5th and the 2.5th percentile."""
    found = effects.cramers_v(20.0, 60, (2, 5))
    for bound, share in ((found.low95, 0.975), (found.high95, 0.025)):
        centre = bound**2 * 60 - 4
        assert stats.ncx2.cdf(20.0, 4, centre) == pytest.approx(share, abs=1e-6)
    assert effects.cramers_v(0.5, 60, (2, 5)).low95 == 0.0


def test_items_that_measure_one_thing_are_reliable() -> None:
    person = np.random.default_rng(4).normal(size=(60, 1))
    noise = np.random.default_rng(5).normal(size=(60, 5))
    assert cronbachs_alpha(person + 0.3 * noise).value > 0.95
    assert abs(cronbachs_alpha(noise).value) < 0.4
    assert isnan(cronbachs_alpha(noise[:, :1]).value)
    # By hand: two items (1, 2, 3) and (2, 2, 5): 2 (1 - (1 + 3) / 7).
    assert cronbachs_alpha(np.array([[1, 2], [2, 2], [3, 5.0]])).value == pytest.approx(6 / 7)
