"""Hypotheses about a factor: each participant's means over all conditions of a level."""

from dataclasses import replace
from itertools import product
from math import sqrt

import numpy as np
import pytest
from scipy import stats
from study_records import QUESTIONS, design, records

from gazerig.features.study.decisions import decisions
from gazerig.features.study.design import Condition, Hypothesis, StudyDesign, Trials
from gazerig.features.study.measures import measures
from gazerig.features.study.participation import Participation, participation
from gazerig.features.study.power import power_claim, power_of
from gazerig.features.study.preregistration_text import sentence
from gazerig.features.study.records import ItemAnswered
from gazerig.features.study.rules import consistency_rules
from gazerig.features.study.scores import scores
from gazerig.features.study.simulation import Population, levels

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


def people_of(study: StudyDesign, count: int, effect: float = 0.6) -> list[Participation]:
    population = Population(effect)
    return [
        participation(records(study, k, population), study, QUESTIONS) for k in range(1, count + 1)
    ]


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
    gaze, lids = decisions(study, QUESTIONS, people)
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
    assert lids.also[0].p == stats.mannwhitneyu(blink, stare, method="asymptotic").pvalue
    assert gaze.verdict == lids.verdict == "supported"


def test_who_misses_a_condition_of_a_level_is_not_compared() -> None:
    study = crossed(GAZE)
    whole = records(study, 1)
    gone = [r for r in whole if not (isinstance(r, ItemAnswered) and r.condition == "walk_stare")]
    people = [*people_of(study, 5)[1:], participation(gone, study, QUESTIONS)]
    (one,) = decisions(study, QUESTIONS, people)
    assert one.n == 4


def test_simulated_participants_have_the_effect_between_levels() -> None:
    study = crossed(GAZE, LIDS)
    assert levels(study) == {"walk_blink": 2, "walk_stare": 1, "centre_blink": 1, "centre_stare": 0}
    people = people_of(study, 240)
    for one in (GAZE, LIDS):
        found = scores(
            measures(study, QUESTIONS)[one.measure], people, tuple(study.conditions), QUESTIONS
        )
        d = found.column(*study.side(one.better)) - found.column(*study.side(one.than))
        # The standard error of d_z (Hedges & Olkin 1985) is sqrt(1/n + d^2/2n).
        assert d.mean() / d.std() == pytest.approx(0.6, abs=3 * sqrt(1 / 240 + 0.18 / 240))


def test_power_is_that_of_means_which_have_hardly_any_ties() -> None:
    one = Hypothesis("paper.looked_at", "walk_blink", "centre_blink")
    level, single = (
        power_claim(crossed(each), each, measures(crossed(each), QUESTIONS)["paper.looked_at"])
        for each in (GAZE, one)
    )
    assert level.question.points == 0 and single.question.points == 5
    assert level.power > single.power
    assert level.power == power_of(level.question, 24)


def test_the_pre_registration_says_what_is_averaged() -> None:
    said = sentence(GAZE, crossed(GAZE))
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
    (one,) = decisions(study, QUESTIONS, people_of(study, 24, 1.2))
    by_name = Hypothesis("paper.looked_at", "walk", "centre", also=("chi_square",))
    named = replace(study, hypotheses=(by_name,))
    (same,) = decisions(named, QUESTIONS, people_of(named, 24, 1.2))
    assert (one.test, one.also) == (same.test, same.also)
