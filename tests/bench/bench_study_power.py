"""How often simulated studies find what is there, beside what their design claims.

Run by hand: ``python tests/bench/bench_study_power.py``. Each of 500 studies goes the way of all:
participants answer, their records become rows, the design's rules leave some out, the planned test
decides. The claim is that of ``gazerig study design``. Chance alone moves a share of 500 by .022
(one standard error at .5), .018 at .8.
"""

import argparse
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from sys import path
from typing import NamedTuple

path.insert(0, str(Path(__file__).parents[1]))

from study_records import QUESTIONS, design, pairs, records

from gazerig.robot.study.decisions import decisions
from gazerig.robot.study.design import Exclusion, Hypothesis, StatisticalPlan, StudyDesign, Test
from gazerig.robot.study.measures import measures
from gazerig.robot.study.participation import participation
from gazerig.robot.study.power import claim
from gazerig.robot.study.simulation import Population

STUDIES = 500


class Planned(NamedTuple):
    """A study to be simulated."""

    name: str
    study: StudyDesign


def planned() -> list[Planned]:
    """Return studies of each test, of few and of many participants, of effects and of none."""
    found = [
        Planned(f"signed-rank, n = {n}, d_z = {d}", rating("signed_rank", n, d))
        for n, d in ((12, 0.8), (24, 0.0001), (24, 0.4), (24, 0.6), (26, 0.6), (40, 0.5))
    ]
    found.append(Planned("signed-rank, a scale's mean, n = 24, d_z = 0.6", scale(24, 0.6)))
    found += [
        Planned(f"{name}, n = 24, d_z = 0.6", rating(test, 24, 0.6))
        for name, test in (
            ("rank-sum", "rank_sum"), ("chi-square", "chi_square"),
            ("ordinal mixed", "ordinal_mixed"),
        )
    ]  # fmt: skip
    found.append(Planned("Bradley-Terry, n = 24, d_z = 0.6", choice(24, 0.6)))
    return found


def rating(test: Test, n: int, effect: float) -> StudyDesign:
    """Return a study with one hypothesis about one item."""
    one = Hypothesis("paper.looked_at", "walk", "centre", test)
    return planned_for(design(hypotheses=(one,)), n, effect)


def scale(n: int, effect: float) -> StudyDesign:
    """Return a study with one hypothesis about the mean of three items."""
    one = Hypothesis("calmness.ease", "walk", "centre")
    return planned_for(design(questionnaires=("calmness",), hypotheses=(one,)), n, effect)


def choice(n: int, effect: float) -> StudyDesign:
    """Return a study of choices between two conditions."""
    return planned_for(pairs(("walk", "centre")), n, effect)


def planned_for(study: StudyDesign, n: int, effect: float) -> StudyDesign:
    """Return a study for n participants who show an effect; nobody is left out by chance."""
    plan = StatisticalPlan(participants=n, effect=effect)
    return replace(study, plan=plan, exclusion=Exclusion(same_answers=False))


def found_in(study: StudyDesign, seed: int) -> bool:
    """Return whether one simulated study supports its hypothesis."""
    population = Population(study.plan.effect, seed=seed)
    people = [
        participation(records(study, k, population), study, QUESTIONS)
        for k in range(1, study.plan.participants + 1)
    ]
    (one,) = decisions(study, QUESTIONS, people)
    return one.verdict in ("supported", "against")


def _some(study: StudyDesign, seeds: range) -> int:
    return sum(found_in(study, seed) for seed in seeds)


def main() -> None:
    """Print what was claimed and what was found."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--studies", type=int, default=STUDIES)
    count = parser.parse_args().studies
    print(f"{'study':52}{'claimed':>9}{'found':>8}{'apart':>8}{'s':>7}")
    with ProcessPoolExecutor(2) as pool:
        for one in planned():
            began = time.perf_counter()
            known = measures(one.study, QUESTIONS)
            (hypothesis,) = one.study.hypotheses
            said = claim(one.study, hypothesis, known[hypothesis.measure]).power
            halves = (range(0, count, 2), range(1, count, 2))
            hits = sum(pool.map(_some, (one.study, one.study), halves))
            share = hits / count
            took = time.perf_counter() - began
            print(f"{one.name:52}{said:9.3f}{share:8.3f}{share - said:+8.3f}{took:7.1f}")


if __name__ == "__main__":
    main()
