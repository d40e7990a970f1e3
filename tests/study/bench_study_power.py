"""Share of significant simulated studies: without an effect, and next to the claimed power.

Run by hand: ``nice -n 10 python tests/study/bench_study_power.py``. Each of 2,000 studies takes the
path of all: participants answer, their records become rows, the design's rules leave some out, the
planned test decides. The claim is that of ``gazerig study design``. Chance alone moves a share of
2,000 studies by .005 (one standard error at .05) and by .009 at .8. Intervals of effects decide
nothing; they are left out, as they take most of the time.
"""

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from math import nan
from pathlib import Path
from sys import path
from typing import NamedTuple

path.insert(0, str(Path(__file__).parents[1]))

import study_records
from study_records import design, pairs, records

from gazerig.features.study.decisions import decide_hypotheses
from gazerig.features.study.design import (
    Condition,
    Exclusion,
    Hypothesis,
    StatisticalPlan,
    StudyDesign,
    Test,
    Trials,
)
from gazerig.features.study.participation import participation
from gazerig.features.study.power import power_claim
from gazerig.features.study.scores import design_measures
from gazerig.features.study.simulation import Population
from gazerig.features.study.statistics import effects

STUDIES = 2000
QUESTIONS = {
    key: replace(
        one, items={k: v for k, v in one.items.items() if k not in ("naturalness", "sure")}
    )
    for key, one in study_records.QUESTIONS.items()
}
"""Without the items that nothing here tests, which would take half of the time."""
TWO, THREE = ("walk", "centre"), ("walk", "centre", "random")


class Planned(NamedTuple):
    """A study to be simulated.

    study: its hypotheses define which conditions are higher
    tested: the hypothesis that is decided, None: the study's first
    """

    name: str
    study: StudyDesign
    population: Population
    tested: Hypothesis | None = None


def null_studies() -> list[Planned]:
    """Return studies in which the compared conditions are equal."""
    own, contrast = Population(0.0, preference_sd=1.0), Population(0.0, contrast_sd=3.0)
    equal = Population(0.0)
    lower = tuple(Hypothesis("paper.looked_at", key, "random") for key in TWO)
    found = [Planned(f"signed_rank, n = {n}", rating("signed_rank", n), equal) for n in (9, 24, 40)]
    found += [
        Planned("signed_rank, a third condition lower, n = 24",
                planned_for(design(THREE, hypotheses=lower), 24), Population(1.5),
                Hypothesis("paper.looked_at", *TWO)),
        Planned("signed_rank, 4 repetitions, own preferences, n = 24",
                repeated(rating("signed_rank", 24)), own),
        Planned("signed_rank, strong contrasts, n = 24", rating("signed_rank", 24), contrast),
        Planned("signed_rank, mean of three items, n = 24", scale(24), equal),
        Planned("signed_rank, levels of a factor, own preferences, n = 24",
                levels("signed_rank", 24), own),
        Planned("rank_sum, n = 24", rating("rank_sum", 24), equal),
        Planned("rank_sum, 4 repetitions, own preferences, n = 24",
                repeated(rating("rank_sum", 24)), own),
        Planned("rank_sum, strong contrasts, n = 24", rating("rank_sum", 24), contrast),
        Planned("rank_sum, levels of a factor, own preferences, n = 24",
                levels("rank_sum", 24), own),
        Planned("sign, one choice, n = 24", choice(TWO, 24), equal),
        Planned("sign, 4 choices, own preferences, n = 24", repeated(choice(TWO, 24)), own),
        Planned("sign, 4 choices, own preferences, three conditions, n = 24",
                repeated(choice(THREE, 24)), own),
    ]  # fmt: skip
    return found


def studies_with_effects() -> list[Planned]:
    """Return studies of each deciding test, of few and of many participants."""
    found = [
        Planned(f"signed_rank, n = {n}, d_z = {d}", rating("signed_rank", n), Population(d))
        for n, d in ((12, 0.8), (24, 0.4), (24, 0.6), (26, 0.6), (40, 0.5))
    ]
    six = Population(0.6)
    found += [
        Planned("signed_rank, mean of three items, n = 24, d_z = 0.6", scale(24), six),
        Planned("signed_rank, 4 repetitions, n = 24, d_z = 0.6",
                repeated(rating("signed_rank", 24)), six),
        Planned("rank_sum, n = 24, d_z = 0.6", rating("rank_sum", 24), six),
        Planned("rank_sum, n = 32, d_z = 0.6", rating("rank_sum", 32), six),
        Planned("sign, one choice, n = 24, d_z = 0.6", choice(TWO, 24), six),
        Planned("sign, one choice, n = 37, d_z = 0.6", choice(TWO, 37), six),
        Planned("sign, 4 choices, n = 24, d_z = 0.3", repeated(choice(TWO, 24)), Population(0.3)),
    ]  # fmt: skip
    return found


def rating(test: Test, n: int) -> StudyDesign:
    """Return a study with one hypothesis about one item."""
    return planned_for(
        design(hypotheses=(Hypothesis("paper.looked_at", "walk", "centre", test),)), n
    )


def scale(n: int) -> StudyDesign:
    """Return a study with one hypothesis about the mean of three items."""
    one = Hypothesis("calmness.ease", "walk", "centre")
    return planned_for(design(questionnaires=("calmness",), hypotheses=(one,)), n)


def levels(test: Test, n: int) -> StudyDesign:
    """Return a study of two crossed factors with one hypothesis about the levels of one."""
    cells = [(gaze, lids) for gaze in ("moving", "still") for lids in ("blinks", "stares")]
    conditions = {f"{a}_{b}": Condition(factors={"gaze": a, "lids": b}) for a, b in cells}
    one = Hypothesis("paper.looked_at", "gaze=moving", "gaze=still", test)
    study = design(tuple(conditions), hypotheses=(one,))
    return planned_for(replace(study, conditions=conditions), n)


def choice(conditions: tuple[str, ...], n: int) -> StudyDesign:
    """Return a study of choices between pairs."""
    return planned_for(pairs(conditions), n)


def repeated(study: StudyDesign) -> StudyDesign:
    """Return a study in which each condition or pair is shown four times."""
    return replace(study, trials=Trials(repetitions=4))


def planned_for(study: StudyDesign, n: int) -> StudyDesign:
    """Return a study for n participants; no one is left out by chance."""
    plan = StatisticalPlan(participants=n)
    return replace(study, plan=plan, after=(), exclusion=Exclusion(same_answers=False))


def is_significant(one: Planned, seed: int) -> bool:
    """Return whether one simulated study is significant, uncorrected, with either sign."""
    population = replace(one.population, seed=seed)
    people = [
        participation(records(one.study, k, population, QUESTIONS), one.study, QUESTIONS)
        for k in range(1, one.study.plan.participants + 1)
    ]
    study = replace(one.study, hypotheses=(one.tested or one.study.hypotheses[0],))
    (found,) = decide_hypotheses(study, QUESTIONS, people)
    return found.test is not None and found.test.deciding_p <= one.study.plan.alpha


def _count(one: Planned, seeds: range) -> int:
    effects.bootstrap_interval = lambda *_, **__: (nan, nan)
    return sum(is_significant(one, seed) for seed in seeds)


def main() -> None:
    """Print the rates of false positives, and the claimed and the measured power."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--studies", type=int, default=STUDIES)
    count = parser.parse_args().studies
    with ProcessPoolExecutor(2) as pool:

        def share(one: Planned) -> float:
            halves = (range(0, count, 2), range(1, count, 2))
            return sum(pool.map(_count, (one, one), halves)) / count

        print(f"{'no effect':68}{'false positives':>16}{'s':>7}", flush=True)
        for one in null_studies():
            began = time.perf_counter()
            print(f"{one.name:68}{share(one):16.3f}{time.perf_counter() - began:7.1f}", flush=True)
        print(f"{'effect':68}{'claimed':>8}{'found':>8}{'s':>7}", flush=True)
        for one in studies_with_effects():
            began = time.perf_counter()
            study = one.study
            plan = replace(study.plan, effect=one.population.effect)
            hypothesis = study.hypotheses[0]
            known = design_measures(study, QUESTIONS)[hypothesis.measure]
            said = power_claim(replace(study, plan=plan), hypothesis, known).power
            found = share(one)
            took = time.perf_counter() - began
            print(f"{one.name:68}{said:8.3f}{found:8.3f}{took:7.1f}", flush=True)


if __name__ == "__main__":
    main()
