"""Tests of what becomes of a study's records: rows, exclusions, scores and decided hypotheses."""

import importlib.util
import json
from dataclasses import replace
from itertools import combinations, permutations, product
from math import comb, isnan, sqrt

import numpy as np
import pytest
from golden import study_p_values as golden
from hypothesis import given, settings
from hypothesis import strategies as some
from scipy import stats
from study_records import PAPER, QUESTIONS, UTC, design, pairs, records

from gazerig.features.lab.report.statistics import Correction, correct_p_values
from gazerig.features.study.analysis import analyse_study, circular_triples
from gazerig.features.study.decisions import Decision, decide_hypotheses
from gazerig.features.study.design import (
    Condition,
    Exclusion,
    Hypothesis,
    StatisticalPlan,
    StudyDesign,
    Test,
    Trials,
)
from gazerig.features.study.journal import (
    ConsentGiven,
    ItemAnswered,
    ParticipationClosed,
    Record,
    TrialBegan,
    TrialEnded,
    TrialMeasured,
)
from gazerig.features.study.participation import Participation, participation
from gazerig.features.study.power import power_claim, power_of
from gazerig.features.study.preregistration_text import hypothesis_sentence
from gazerig.features.study.questionnaire import Questionnaire
from gazerig.features.study.report import apa
from gazerig.features.study.rules import consistency_rules
from gazerig.features.study.scores import choice_wins, design_measures, item_answers, measure_scores
from gazerig.features.study.simulation import Population, factor_levels
from gazerig.features.study.statistics import effects, ranks
from gazerig.features.study.statistics.contingency import chi_square, counts_of
from gazerig.features.study.statistics.effects import cronbachs_alpha

TWO = ("walk", "centre")


def people_of(
    study: StudyDesign, count: int, effect: float = 0.6, seed: int = 0
) -> list[Participation]:
    population = Population(effect, seed=seed)
    return [
        participation(records(study, k, population), study, QUESTIONS) for k in range(1, count + 1)
    ]


def decided(study: StudyDesign, count: int, effect: float = 0.6) -> tuple[Decision, ...]:
    return decide_hypotheses(study, QUESTIONS, people_of(study, count, effect))


def left_out(found: list[Record], study: StudyDesign | None = None) -> str:
    return participation(found, study or design(), QUESTIONS).left_out


def test_answers_become_rows_and_practice_does_not_count() -> None:
    study = design()
    found = records(study, 1)
    practice = ItemAnswered(-1, "walk", "paper", "naturalness", 5, 900.0, UTC)
    one = participation([*found[:2], practice, *found[2:]], study, QUESTIONS)
    assert [row.left_out for row in one.answers].count("practice") == 1
    # Two trials of two items, and the remarks at the end.
    assert len(one.counted) == 5 and one.left_out == "" and one.outcome == "finished"
    with pytest.raises(ValueError, match="begins with"):
        participation(found[1:], study, QUESTIONS)


def test_who_is_left_out_as_a_whole() -> None:
    found = records(design(), 1)
    assert (
        left_out([found[0], ConsentGiven(False, False, False, UTC), *found[2:]])
        == "did not consent"
    )
    assert left_out(found[:-1]) == "did not finish"
    kept = replace(design(), exclusion=Exclusion(incomplete="keep"))
    assert left_out(found[:-1], kept) == ""
    gone = ParticipationClosed("withdrawn", "felt unwell", UTC)
    assert left_out([*found[:-1], gone], kept) == "withdrew: felt unwell"
    sent = ParticipationClosed("excluded", "", UTC)
    assert left_out([*found[:-1], sent]) == "excluded by the experimenter"


def test_one_answer_to_everything_leaves_out_where_there_are_enough_of_them() -> None:
    twice = replace(design(), trials=Trials(repetitions=2))
    same, few = (
        [replace(r, value=4) if isinstance(r, ItemAnswered) else r for r in records(study, 1)]
        for study in (twice, design())
    )
    assert "one answer" in left_out(same, twice)
    assert left_out(few) == ""  # four equal ratings may be honest
    allowed = replace(twice, exclusion=Exclusion(same_answers=False))
    assert left_out(same, allowed) == ""


def test_a_lost_head_leaves_out_the_trial_and_a_repeated_one_counts() -> None:
    study, found = design(), records(design(), 1)
    ended = next(r for r in found if isinstance(r, TrialEnded))
    at = found.index(ended)
    lost = replace(ended, outcome="head_lost", reason="bus lost")
    gone = participation([*found[:at], lost, *found[at + 1 :]], study, QUESTIONS)
    assert {r.trial for r in gone.answers if "head lost" in r.left_out} == {0}
    again: list[Record] = [TrialBegan(0, 1, ended_condition(found), UTC), replace(ended, attempt=1)]
    repeated = participation([*found[:at], lost, *again, *found[at + 1 :]], study, QUESTIONS)
    assert all(not r.left_out for r in repeated.answers)
    assert repeated.trials[0].attempts == 2


def ended_condition(found: list[Record]) -> str:
    return next(r.condition for r in found if isinstance(r, TrialBegan))


def test_a_page_answered_faster_than_it_can_be_read_is_left_out() -> None:
    found = [
        replace(r, ms=120.0) if isinstance(r, ItemAnswered) and r.trial == 1 else r
        for r in records(design(), 1)
    ]
    one = participation(found, design(), QUESTIONS)
    assert {r.trial for r in one.answers if r.left_out == "answered too fast"} == {1}


def test_an_item_answered_again_counts_once_with_its_last_answer() -> None:
    found = records(design(), 1)
    first = next(r for r in found if isinstance(r, ItemAnswered))
    one = participation([*found[:-1], replace(first, value=2), found[-1]], design(), QUESTIONS)
    (row,) = [r for r in one.answers if (r.trial, r.item) == (first.trial, first.item)]
    assert row.value == 2


def test_scales_are_means_with_reversed_items_turned_round() -> None:
    study = design(questionnaires=("calmness",), hypotheses=())
    found = [
        replace(r, value={"calm": 4, "tense": 2, "easy": 5}[r.item])
        if isinstance(r, ItemAnswered) and r.trial is not None
        else r
        for r in records(study, 1)
    ]
    measure = design_measures(study, QUESTIONS)["calmness.ease"]
    one = participation(found, study, QUESTIONS)
    table = measure_scores(measure, [one], tuple(study.conditions), QUESTIONS)
    assert table.means.tolist() == [[pytest.approx(13 / 3), pytest.approx(13 / 3)]]
    assert item_answers(measure, [one], QUESTIONS).tolist() == [[4, 4, 5], [4, 4, 5]]


def test_what_was_not_answered_is_left_out_and_the_rest_counts() -> None:
    study = replace(design(questionnaires=("paper", "calmness")), may_skip=True)
    measured = design_measures(study, QUESTIONS)
    found = records(study, 1)
    skipped = {("looked_at", "walk"), ("calm", "walk"), ("calm", "centre"), ("easy", "centre")}
    found = [
        replace(r, value=None if (r.item, r.condition) in skipped else 2)
        if isinstance(r, ItemAnswered) and r.trial is not None else r
        for r in found
    ]  # fmt: skip
    one = participation(found, study, QUESTIONS)
    assert [row.left_out for row in one.answers].count("not answered") == 4

    def means(name: str) -> list[float]:
        table = measure_scores(measured[name], [one], tuple(study.conditions), QUESTIONS)
        found: list[float] = table.means[0].tolist()
        return found

    assert means("paper.looked_at") == pytest.approx([np.nan, 2.0], nan_ok=True)
    # Tense is turned round; a scale counts with at least half of its items.
    assert means("calmness.ease") == pytest.approx([3.0, np.nan], nan_ok=True)
    decided = decide_hypotheses(study, QUESTIONS, [one, *people_of(study, 13)[1:]])
    assert [d.n for d in decided] == [13, 12]


def test_choices_that_were_not_made_are_left_out() -> None:
    study = replace(pairs(TWO), may_skip=True)
    people = []
    for number in range(1, 11):
        found = records(study, number)
        if number == 1:
            found = [replace(r, value=None) if isinstance(r, ItemAnswered) else r for r in found]
        people.append(participation(found, study, QUESTIONS))
    assert decide_hypotheses(study, QUESTIONS, people)[0].n == 9


def test_repetitions_are_averaged_and_counted_one_by_one() -> None:
    study = replace(design(), trials=Trials(repetitions=3))
    table = measure_scores(
        design_measures(study, QUESTIONS)["paper.looked_at"], people_of(study, 4),
        tuple(study.conditions), QUESTIONS,
    )  # fmt: skip
    assert table.means.shape == (4, 2) and len(table.answers("walk")) == 12
    assert table.condition_means("walk").mean() == pytest.approx(table.answers("walk").mean())


def test_objective_measures_come_from_the_trials() -> None:
    study = replace(design(), objective=("first_look_s",))
    found = records(study, 1)
    for trial, value in ((0, 1.5), (1, float("nan"))):
        at = next(k for k, r in enumerate(found) if isinstance(r, TrialEnded) and r.trial == trial)
        found.insert(at + 1, TrialMeasured(trial, "walk", {"first_look_s": value}))
    one = participation(found, study, QUESTIONS)
    measure = design_measures(study, QUESTIONS)["first_look_s"]
    table = measure_scores(measure, [one], tuple(study.conditions), QUESTIONS)
    assert sorted(table.means[0].tolist(), key=str) == [1.5, pytest.approx(np.nan, nan_ok=True)]


def test_hypotheses_are_decided_and_corrected_together() -> None:
    study = design()
    found = decided(study, 24, 1.2)
    assert [one.verdict for one in found] == ["supported", "supported"]
    assert [t.key for t in found[0].further_tests] == ["chi_square", "rank_sum"]
    for one in found:
        assert one.test is not None and one.n == 24
        assert one.corrected_p >= one.test.deciding_p and one.means[0] > one.means[1]
        assert one.standardised is not None and one.standardised.low95 > 0.0
        assert {c.assumption.split(" (")[0] for c in one.checks} >= {"differences are symmetric"}


def test_the_figures_are_those_of_scipy_on_the_same_answers() -> None:
    study = design()
    people = people_of(study, 24)
    table = measure_scores(design_measures(study, QUESTIONS)["paper.looked_at"], people, ("walk", "centre"),
                   QUESTIONS)  # fmt: skip
    (_, one) = decide_hypotheses(study, QUESTIONS, people)
    walk, centre = table.condition_means("walk"), table.condition_means("centre")
    expected = stats.wilcoxon(walk, centre, correction=True, method="asymptotic")
    assert one.test is not None
    assert (one.test.statistic, one.test.p) == (expected.statistic, expected.pvalue)
    assert one.further_tests[1].p == stats.mannwhitneyu(walk, centre, method="asymptotic").pvalue
    swapped = stats.permutation_test(
        (walk, centre), lambda a, b, axis: stats.rankdata(
            np.concatenate([a, b], axis=-1), axis=-1)[..., :24].sum(axis=-1),
        permutation_type="samples", n_resamples=4000, rng=np.random.default_rng(1),
    )  # fmt: skip
    assert one.further_tests[1].exact_p == pytest.approx(swapped.pvalue, abs=0.03)


def test_a_difference_of_the_other_sign_is_against_the_hypothesis() -> None:
    turned = (Hypothesis("paper.looked_at", "walk", "centre"),)
    study = design(hypotheses=turned)
    people = people_of(study, 24, -1.2)
    assert decide_hypotheses(study, QUESTIONS, people)[0].verdict == "against"
    assert decided(design(hypotheses=turned), 24, 0.0)[0].verdict == "not supported"


def test_too_few_are_said_to_be_too_few() -> None:
    one = decided(design(participants=24), 4, 2.0)[0]
    assert one.verdict == "too few" and "0.125" in one.too_few
    alone = decided(design(), 1)[0]
    assert alone.test is None and alone.verdict == "too few" and "1 of 24" in alone.too_few
    assert isnan(alone.corrected_p)


@pytest.mark.parametrize("test", ["signed_rank", "rank_sum"])
def test_a_third_condition_that_differs_decides_nothing_between_two_equal_ones(test: Test) -> None:
    """With Friedman's test, 299 of 300 such studies had a verdict on the two."""
    only = (Hypothesis("paper.looked_at", "walk", "centre", test, ("friedman",)),)
    study = design(("walk", "centre", "random"), hypotheses=only)
    two_above = replace(study, hypotheses=(
        Hypothesis("paper.looked_at", "walk", "random"),
        Hypothesis("paper.looked_at", "centre", "random"),
    ))  # fmt: skip
    found = [
        decide_hypotheses(study, QUESTIONS, people_of(two_above, 24, 1.5, seed))[0]
        for seed in range(4)
    ]
    assert all(one.further_tests[0].deciding_p < 0.01 for one in found)
    assert [one.verdict for one in found] == ["not supported"] * 4


def test_a_verdict_has_the_sign_of_the_tests_own_effect() -> None:
    """30 of 34 prefer the walk a little, four the centre by much, so that means differ in sign."""
    study = design(questionnaires=("nine",), hypotheses=(Hypothesis("nine.item", *TWO),))
    nine = Questionnaire("Nine points", "own", "own", {"item": replace(
        PAPER.items["looked_at"], points=11)})  # fmt: skip
    questions = {**QUESTIONS, "nine": nine}
    people = []
    for number in range(1, 35):
        values = {"walk": 6, "centre": 5} if number > 4 else {"walk": 1, "centre": 11}
        answered = [
            replace(r, value=values[r.condition])
            if isinstance(r, ItemAnswered) and r.questionnaire == "nine" else r
            for r in records(study, number, questions=questions)
        ]  # fmt: skip
        people.append(participation(answered, study, questions))
    (one,) = decide_hypotheses(study, questions, people)
    assert one.test is not None and one.test.deciding_p == pytest.approx(0.0014, abs=0.0003)
    assert one.means[0] < one.means[1] and one.test.effect.value > 0.0
    assert one.verdict == "supported"
    said = apa.result_sentence(one, analyse_study("mine", study, questions, "ab", people))
    assert "was above" in said and "have the other sign" in said


def test_choices_are_decided_by_the_exact_sign_test_of_participants() -> None:
    study = pairs()
    people = people_of(study, 30, 0.9)
    (one,) = decide_hypotheses(study, QUESTIONS, people)
    assert one.verdict == "supported" and one.n == 30 and one.means[0] > 0.5
    table = choice_wins(one.measure, people, tuple(study.conditions))
    assert table.sum() == 90 and one.test is not None
    assert one.test.deciding_p == stats.binomtest(int(table[0, 1]), 30).pvalue
    (nobody,) = decide_hypotheses(study, QUESTIONS, [])
    assert nobody.verdict == "too few" and nobody.too_few == "nobody has chosen"


def test_a_participant_counts_once_however_often_he_or_she_chose() -> None:
    """As independent choices, 4 participants with 6 choices each would be significant."""
    study = replace(pairs(TWO), trials=Trials(repetitions=6))
    people = []
    for number in range(1, 5):
        answered = []
        for r in records(study, number):
            if isinstance(r, ItemAnswered) and r.item == "alive":
                r = replace(r, value="first" if r.condition.startswith("walk") else "second")
            answered.append(r)
        people.append(participation(answered, study, QUESTIONS))
    (one,) = decide_hypotheses(study, QUESTIONS, people)
    assert choice_wins(one.measure, people, TWO).tolist() == [[0, 24], [0, 0]]
    assert one.test is not None and one.test.deciding_p == pytest.approx(2 / 2**4)
    assert one.verdict == "too few" and one.n == 4


def test_circles_of_preference_are_counted() -> None:
    circle = np.array([[0, 3, 0], [0, 0, 3], [3, 0, 0]])
    assert circular_triples(circle) == (1, 1)
    assert circular_triples(np.triu(np.ones((7, 7), np.int64), 1)) == (0, 35)


def test_alpha_and_correction_are_the_plans() -> None:
    strict = replace(design(), plan=StatisticalPlan(alpha=0.0001, correction="none"))
    for one in decided(strict, 24, 0.0):
        assert one.test is not None and one.corrected_p == one.test.deciding_p
        assert one.verdict == "not supported"


# --- Tests of a study's statistics: by other programs, by hand and by enumeration


GOLDEN = json.loads(golden.FILE.read_text())
PINGOUIN = importlib.util.find_spec("pingouin") is not None


def ours(rows: np.ndarray) -> dict[str, float]:
    """Return this program's results under the names of the golden file."""
    a, b = rows[:, 0].astype(float), rows[:, 1].astype(float)
    table = chi_square([counts_of(a, 5), counts_of(b, 5)])
    out = {
        f"signed_rank {zeros} {side}": ranks.signed_rank_test(b - a, side == "two-sided", zeros).p
        for zeros in ("wilcox", "pratt")
        for side in ("two-sided", "greater")
    }
    friedman = ranks.friedman_test(rows.astype(float))
    return out | {
        "matched correlation": float(effects.matched_correlation(b - a)),
        "rank_sum two-sided": ranks.rank_sum_test(a, b).p,
        "rank_sum greater": ranks.rank_sum_test(a, b, two_sided=False).p,
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
    found = ranks.rank_sum_test(a, b, paired=True)
    rank = stats.rankdata(np.concatenate([a, b]))
    score = rank[people:] - rank[:people]
    swapped = np.abs(rng.choice((-1.0, 1.0), (4000, people)) @ score)
    assert found.deciding_p == pytest.approx(np.mean(swapped >= abs(score.sum())), abs=0.03)
    assert ranks.rank_sum_test(a, b).deciding_p > found.deciding_p + 0.1


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
    assert ranks.signed_rank_test(b - a).exact_p == pytest.approx(2 / 2**9)
    found = ranks.rank_sum_test(a, b)
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
    assert ranks.friedman_test(rows).exact_p == pytest.approx(np.mean(every), abs=0.01)
    with pytest.raises(ValueError, match="three conditions"):
        ranks.friedman_test(rows[:, :2])


def test_who_answers_alike_everywhere_differs_in_nothing() -> None:
    same = np.full(12, 3.0)
    assert ranks.signed_rank_test(same - same).deciding_p == 1.0
    assert ranks.rank_sum_test(same, same).deciding_p == 1.0
    assert ranks.friedman_test(np.stack([same] * 3, axis=1)).deciding_p == 1.0
    assert isnan(effects.cohens_dz(same - same).value)
    assert isnan(effects.rank_biserial(same - same).low95)
    with pytest.raises(ValueError, match="both sides"):
        ranks.rank_sum_test(same, same[:0])


def test_so_few_that_nothing_could_be_found_are_known_before() -> None:
    five = ranks.signed_rank_test(np.array([1.0, 2, 1, 3, 2]))
    assert five.exact_p == five.least_p == 2 / 2**5 > 0.05
    assert ranks.signed_rank_test(np.array([1.0, 2, 1, 3, 2, 1])).least_p < 0.05


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


# --- Hypotheses about a factor: each participant's means over all conditions of a level


GAZE = Hypothesis("paper.looked_at", "gaze=walk", "gaze=centre")
LIDS = Hypothesis("paper.naturalness", "lids=blink", "lids=stare", also=("rank_sum",))


def crossed(*hypotheses: Hypothesis) -> StudyDesign:
    """Return a study of two factors with two levels each."""
    keys = {
        f"{a}_{b}": {"gaze": a, "lids": b}
        for a, b in product(("walk", "centre"), ("blink", "stare"))
    }
    study = design(tuple(keys), hypotheses=hypotheses)
    return replace(study, conditions={key: Condition(factors=one) for key, one in keys.items()})


def test_a_level_is_all_conditions_that_have_it() -> None:
    study = crossed(GAZE)
    assert study.side("gaze=walk") == ("walk_blink", "walk_stare")
    assert study.side("walk_stare") == ("walk_stare",)
    assert study.side("gaze=nothing") == study.side("walk") == ()
    assert study.condition_pairs(GAZE) == (
        ("walk_blink", "centre_blink"),
        ("walk_stare", "centre_stare"),
    )
    assert study.condition_pairs(LIDS) == (
        ("walk_blink", "walk_stare"),
        ("centre_blink", "centre_stare"),
    )


def test_the_figures_are_those_of_scipy_on_the_means_of_each_participant() -> None:
    study = crossed(GAZE, LIDS)
    people = people_of(study, 24, 0.9)
    gaze, lids = decide_hypotheses(study, QUESTIONS, people)
    answers = {
        (p.participant, row.condition, row.item): float(row.value or 0)
        for p in people for row in p.counted
        if row.trial is not None
    }  # fmt: skip

    def mean(item: str, *conditions: str) -> np.ndarray:
        return np.array(
            [np.mean([answers[p.participant, c, item] for c in conditions]) for p in people]
        )

    walk = mean("looked_at", "walk_blink", "walk_stare")
    centre = mean("looked_at", "centre_blink", "centre_stare")
    expected = stats.wilcoxon(walk, centre, correction=True, method="asymptotic")
    assert gaze.test is not None and gaze.n == 24
    assert (gaze.test.statistic, gaze.test.p) == (expected.statistic, expected.pvalue)
    assert gaze.means == (pytest.approx(walk.mean()), pytest.approx(centre.mean()))
    blink = mean("naturalness", "walk_blink", "centre_blink")
    stare = mean("naturalness", "walk_stare", "centre_stare")
    assert lids.further_tests[0].p == stats.mannwhitneyu(blink, stare, method="asymptotic").pvalue
    assert gaze.verdict == lids.verdict == "supported"


def test_who_misses_a_condition_of_a_level_is_not_compared() -> None:
    study = crossed(GAZE)
    whole = records(study, 1)
    gone = [r for r in whole if not (isinstance(r, ItemAnswered) and r.condition == "walk_stare")]
    people = [*people_of(study, 5)[1:], participation(gone, study, QUESTIONS)]
    (one,) = decide_hypotheses(study, QUESTIONS, people)
    assert one.n == 4


def test_simulated_participants_have_the_effect_between_levels() -> None:
    study = crossed(GAZE, LIDS)
    assert factor_levels(study) == {
        "walk_blink": 2,
        "walk_stare": 1,
        "centre_blink": 1,
        "centre_stare": 0,
    }
    people = people_of(study, 240)
    for one in (GAZE, LIDS):
        found = measure_scores(
            design_measures(study, QUESTIONS)[one.measure],
            people,
            tuple(study.conditions),
            QUESTIONS,
        )
        d = found.condition_means(*study.side(one.better)) - found.condition_means(
            *study.side(one.than)
        )
        # The standard error of d_z (Hedges & Olkin 1985) is sqrt(1/n + d^2/2n).
        assert d.mean() / d.std() == pytest.approx(0.6, abs=3 * sqrt(1 / 240 + 0.18 / 240))


def test_power_is_that_of_means_which_have_hardly_any_ties() -> None:
    one = Hypothesis("paper.looked_at", "walk_blink", "centre_blink")
    level, single = (
        power_claim(
            crossed(each), each, design_measures(crossed(each), QUESTIONS)["paper.looked_at"]
        )
        for each in (GAZE, one)
    )
    assert level.question.points == 0 and single.question.points == 5
    assert level.power > single.power
    assert level.power == power_of(level.question, 24)


def test_the_pre_registration_says_what_is_averaged() -> None:
    said = hypothesis_sentence(GAZE, crossed(GAZE))
    assert (
        "mean of `walk_blink`, `walk_stare` against that of `centre_blink`, `centre_stare`" in said
    )


@pytest.mark.parametrize(
    ("changed", "wanted"),
    [
        ({"better": "gaze=away"}, ("better", "there is walk_blink, walk_stare, ")),
        ({"better": "gaze=away"}, ("better", "lids=stare")),
        ({"than": "lids=stare"}, ("than", "a level of the same factor")),
        ({"than": "centre_blink"}, ("than", "both are to be conditions")),
        ({"also": ("chi_square",)}, ("also.0", "take signed_rank or rank_sum")),
        ({"also": ("friedman",)}, ("also.0", "compares single conditions")),
    ],
)  # fmt: skip
def test_levels_that_cannot_be_compared_are_refused(
    changed: dict[str, object], wanted: tuple[str, str]
) -> None:
    study = crossed(replace(GAZE, **changed))  # type: ignore[arg-type]
    found = dict(consistency_rules(study, QUESTIONS))
    assert wanted[1] in found[f"hypotheses.0.{wanted[0]}"]
    assert not dict(consistency_rules(crossed(GAZE, LIDS), QUESTIONS))


def test_levels_beside_other_levels_of_the_rest_are_refused() -> None:
    study = crossed(GAZE)
    few = {key: one for key, one in study.conditions.items() if key != "centre_stare"}
    (found,) = consistency_rules(replace(study, conditions=few), QUESTIONS)
    assert found[0] == "hypotheses.0.than" and "do not stand beside the same levels" in found[1]
    assert not list(consistency_rules(replace(study, trials=Trials(repetitions=2)), QUESTIONS))


def test_a_factor_alone_names_its_conditions() -> None:
    """Where a level is one condition, it is that condition, whatever decides."""
    study = design(hypotheses=(replace(GAZE, also=("chi_square",)),))
    alone = {key: Condition(factors={"gaze": key}) for key in study.conditions}
    study = replace(study, conditions=alone)
    assert not list(consistency_rules(study, QUESTIONS))
    (one,) = decide_hypotheses(study, QUESTIONS, people_of(study, 24, 1.2))
    by_name = Hypothesis("paper.looked_at", "walk", "centre", also=("chi_square",))
    named = replace(study, hypotheses=(by_name,))
    (same,) = decide_hypotheses(named, QUESTIONS, people_of(named, 24, 1.2))
    assert (one.test, one.further_tests) == (same.test, same.further_tests)
