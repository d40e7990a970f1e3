"""Tests of what becomes of a study's records: rows, exclusions, scores and decided hypotheses."""

from dataclasses import replace
from math import isnan

import numpy as np
import pytest
from scipy import stats
from study_records import PAPER, QUESTIONS, UTC, design, pairs, records

from gazerig.features.study.analysis import analyse_study, circular_triples
from gazerig.features.study.decisions import Decision, decisions
from gazerig.features.study.design import (
    Exclusion,
    Hypothesis,
    StatisticalPlan,
    StudyDesign,
    Test,
    Trials,
)
from gazerig.features.study.measures import measures
from gazerig.features.study.participation import Participation, participation
from gazerig.features.study.questionnaire import Questionnaire
from gazerig.features.study.records import (
    Closed,
    Consented,
    ItemAnswered,
    Measured,
    Record,
    TrialBegan,
    TrialEnded,
)
from gazerig.features.study.report import apa
from gazerig.features.study.scores import item_answers, scores, wins
from gazerig.features.study.simulation import Population

TWO = ("walk", "centre")


def people_of(
    study: StudyDesign, count: int, effect: float = 0.6, seed: int = 0
) -> list[Participation]:
    population = Population(effect, seed=seed)
    return [
        participation(records(study, k, population), study, QUESTIONS) for k in range(1, count + 1)
    ]


def decided(study: StudyDesign, count: int, effect: float = 0.6) -> tuple[Decision, ...]:
    return decisions(study, QUESTIONS, people_of(study, count, effect))


def left_out(found: list[Record], study: StudyDesign | None = None) -> str:
    return participation(found, study or design(), QUESTIONS).left_out


def test_answers_become_rows_and_practice_does_not_count() -> None:
    study = design()
    found = records(study, 1)
    practice = ItemAnswered(-1, "walk", "paper", "naturalness", 5, 900.0, UTC)
    one = participation([*found[:2], practice, *found[2:]], study, QUESTIONS)
    assert [row.left_out for row in one.answers].count("practice") == 1
    # Two trials of two items, and the remarks at the end.
    assert len(one.counted) == 5 and one.left_out == "" and one.how == "finished"
    with pytest.raises(ValueError, match="begins with"):
        participation(found[1:], study, QUESTIONS)


def test_who_is_left_out_as_a_whole() -> None:
    found = records(design(), 1)
    assert (
        left_out([found[0], Consented(False, False, False, UTC), *found[2:]]) == "did not consent"
    )
    assert left_out(found[:-1]) == "did not finish"
    kept = replace(design(), exclusion=Exclusion(incomplete="keep"))
    assert left_out(found[:-1], kept) == ""
    gone = Closed("withdrawn", "felt unwell", UTC)
    assert left_out([*found[:-1], gone], kept) == "withdrew: felt unwell"
    sent = Closed("excluded", "", UTC)
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
    measure = measures(study, QUESTIONS)["calmness.ease"]
    one = participation(found, study, QUESTIONS)
    table = scores(measure, [one], tuple(study.conditions), QUESTIONS)
    assert table.means.tolist() == [[pytest.approx(13 / 3), pytest.approx(13 / 3)]]
    assert item_answers(measure, [one], QUESTIONS).tolist() == [[4, 4, 5], [4, 4, 5]]


def test_what_was_not_answered_is_left_out_and_the_rest_counts() -> None:
    study = replace(design(questionnaires=("paper", "calmness")), may_skip=True)
    measured = measures(study, QUESTIONS)
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
        table = scores(measured[name], [one], tuple(study.conditions), QUESTIONS)
        found: list[float] = table.means[0].tolist()
        return found

    assert means("paper.looked_at") == pytest.approx([np.nan, 2.0], nan_ok=True)
    # Tense is turned round; a scale counts with at least half of its items.
    assert means("calmness.ease") == pytest.approx([3.0, np.nan], nan_ok=True)
    decided = decisions(study, QUESTIONS, [one, *people_of(study, 13)[1:]])
    assert [d.n for d in decided] == [13, 12]


def test_choices_that_were_not_made_are_left_out() -> None:
    study = replace(pairs(TWO), may_skip=True)
    people = []
    for number in range(1, 11):
        found = records(study, number)
        if number == 1:
            found = [replace(r, value=None) if isinstance(r, ItemAnswered) else r for r in found]
        people.append(participation(found, study, QUESTIONS))
    assert decisions(study, QUESTIONS, people)[0].n == 9


def test_repetitions_are_averaged_and_counted_one_by_one() -> None:
    study = replace(design(), trials=Trials(repetitions=3))
    table = scores(
        measures(study, QUESTIONS)["paper.looked_at"], people_of(study, 4),
        tuple(study.conditions), QUESTIONS,
    )  # fmt: skip
    assert table.means.shape == (4, 2) and len(table.answers("walk")) == 12
    assert table.column("walk").mean() == pytest.approx(table.answers("walk").mean())


def test_objective_measures_come_from_the_trials() -> None:
    study = replace(design(), objective=("first_look_s",))
    found = records(study, 1)
    for trial, value in ((0, 1.5), (1, float("nan"))):
        at = next(k for k, r in enumerate(found) if isinstance(r, TrialEnded) and r.trial == trial)
        found.insert(at + 1, Measured(trial, "walk", {"first_look_s": value}))
    one = participation(found, study, QUESTIONS)
    measure = measures(study, QUESTIONS)["first_look_s"]
    table = scores(measure, [one], tuple(study.conditions), QUESTIONS)
    assert sorted(table.means[0].tolist(), key=str) == [1.5, pytest.approx(np.nan, nan_ok=True)]


def test_hypotheses_are_decided_and_corrected_together() -> None:
    study = design()
    found = decided(study, 24, 1.2)
    assert [one.verdict for one in found] == ["supported", "supported"]
    assert [t.key for t in found[0].also] == ["chi_square", "rank_sum"]
    for one in found:
        assert one.test is not None and one.n == 24
        assert one.corrected_p >= one.test.deciding_p and one.means[0] > one.means[1]
        assert one.standardised is not None and one.standardised.low95 > 0.0
        assert {c.assumption.split(" (")[0] for c in one.checks} >= {"differences are symmetric"}


def test_the_figures_are_those_of_scipy_on_the_same_answers() -> None:
    study = design()
    people = people_of(study, 24)
    table = scores(measures(study, QUESTIONS)["paper.looked_at"], people, ("walk", "centre"),
                   QUESTIONS)  # fmt: skip
    (_, one) = decisions(study, QUESTIONS, people)
    walk, centre = table.column("walk"), table.column("centre")
    expected = stats.wilcoxon(walk, centre, correction=True, method="asymptotic")
    assert one.test is not None
    assert (one.test.statistic, one.test.p) == (expected.statistic, expected.pvalue)
    assert one.also[1].p == stats.mannwhitneyu(walk, centre, method="asymptotic").pvalue
    swapped = stats.permutation_test(
        (walk, centre), lambda a, b, axis: stats.rankdata(
            np.concatenate([a, b], axis=-1), axis=-1)[..., :24].sum(axis=-1),
        permutation_type="samples", n_resamples=4000, rng=np.random.default_rng(1),
    )  # fmt: skip
    assert one.also[1].exact_p == pytest.approx(swapped.pvalue, abs=0.03)


def test_a_difference_of_the_other_sign_is_against_the_hypothesis() -> None:
    turned = (Hypothesis("paper.looked_at", "walk", "centre"),)
    study = design(hypotheses=turned)
    people = people_of(study, 24, -1.2)
    assert decisions(study, QUESTIONS, people)[0].verdict == "against"
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
        decisions(study, QUESTIONS, people_of(two_above, 24, 1.5, seed))[0] for seed in range(4)
    ]
    assert all(one.also[0].deciding_p < 0.01 for one in found)
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
    (one,) = decisions(study, questions, people)
    assert one.test is not None and one.test.deciding_p == pytest.approx(0.0014, abs=0.0003)
    assert one.means[0] < one.means[1] and one.test.effect.value > 0.0
    assert one.verdict == "supported"
    said = apa.sentence(one, analyse_study("mine", study, questions, "ab", people))
    assert "was above" in said and "have the other sign" in said


def test_choices_are_decided_by_the_exact_sign_test_of_participants() -> None:
    study = pairs()
    people = people_of(study, 30, 0.9)
    (one,) = decisions(study, QUESTIONS, people)
    assert one.verdict == "supported" and one.n == 30 and one.means[0] > 0.5
    table = wins(one.measure, people, tuple(study.conditions))
    assert table.sum() == 90 and one.test is not None
    assert one.test.deciding_p == stats.binomtest(int(table[0, 1]), 30).pvalue
    (nobody,) = decisions(study, QUESTIONS, [])
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
    (one,) = decisions(study, QUESTIONS, people)
    assert wins(one.measure, people, TWO).tolist() == [[0, 24], [0, 0]]
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
