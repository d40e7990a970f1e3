"""Search for the parameters that put most of the report's measures inside their bands.

The search minimises the number of measures outside their bands, each graded by its distance
(``gazerig.features.lab.sweep.run_outcome.grade``), so that a step towards a band counts, too.
"""

import json
from collections import Counter
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from gazerig.config.parameters import differences, nest
from gazerig.config.save_text import params_text
from gazerig.config.schema import NO_CHARACTER, load_rig
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.analysis.human_norms import BANDS, BY_KEY
from gazerig.features.lab.sweep.axes import Axis, Point, latin_shares, point_at
from gazerig.features.lab.sweep.run_outcome import REPORT, VERDICT, Outcome, grade
from gazerig.gaze.types import Floats
from gazerig.robot.app.options import RunOptions

Scores = Callable[[Sequence[Point]], Sequence[float]]
"""Returns the score of each point; the search minimises it."""

_LEAST = 8


def search_best(scores: Scores, axes: Sequence[Axis], start: Point, count: int, seed: int) -> None:
    """Search for the lowest score by differential evolution (Storn & Price 1997).

    Begins with a Latin hypercube, and ``start`` if it is on the axes.
    """
    from scipy.optimize import differential_evolution  # its import takes half a second of CPU time

    members = max(_LEAST, 2 * len(axes))
    rng = np.random.default_rng(seed)
    first = latin_shares(len(axes), members, rng)
    if all(axis.contains(start[axis.key]) for axis in axes):
        first[0] = [axis.share(start[axis.key]) for axis in axes]

    def many(columns: Floats) -> Floats:
        points = [point_at(axes, shares) for shares in np.atleast_2d(columns.T)]
        return np.array(scores(points))

    differential_evolution(
        many, [(0.0, 1.0)] * len(axes), init=first, maxiter=max(1, round(count / members) - 1),
        vectorized=True, updating="deferred", polish=False, tol=0.0, rng=rng,
    )  # fmt: skip


Runner = Callable[[Sequence[Point]], Sequence[Sequence[Outcome]]]
"""Runs points; returns the outcomes of each, one for each seed."""
_JUDGED = ("pass", "outside")


class Trial(NamedTuple):
    """One tried point.

    Attributes:
        point: its parameters.
        score: graded measures outside, mean of the seeds.
        outside: number of measures outside or no longer decidable, mean of the seeds.
        failed: why a run failed, "" if none did.
    """

    point: Point
    score: float
    outside: float
    failed: str = ""


class SweepFit(NamedTuple):
    """The result of a search.

    Attributes:
        counted: keys of the measures that count: those with a verdict for the rig's own values.
        start: the rig's own values.
        best: the lowest score; of equal ones the first.
        trials: all points in the order of the trials, the rig's own first.
    """

    counted: tuple[str, ...]
    start: Trial
    best: Trial
    trials: tuple[Trial, ...]


def fit_settings(
    run: Runner, axes: Sequence[Axis], start: Point, count: int, seed: int
) -> SweepFit:
    """Search the axes for the best point.

    The same arguments and outcomes make the same search, so an interrupted search is repeated from
    the kept runs.

    Raises:
        SetupError: the rig's own values cannot be run, or no measure has enough events.
    """
    own = run([start])[0]
    counted = counted_measures(own)
    tried = {_key(start): make_trial(start, own, counted)}

    def scores(points: Sequence[Point]) -> list[float]:
        fresh = list({_key(one): one for one in points if _key(one) not in tried}.values())
        for point, outcomes in zip(fresh, run(fresh), strict=True):
            tried[_key(point)] = make_trial(point, outcomes, counted)
        return [tried[_key(point)].score for point in points]

    search_best(scores, axes, start, count, seed)
    trials = tuple(tried.values())
    return SweepFit(counted, trials[0], min(trials, key=lambda trial: trial.score), trials)


def counted_measures(outcomes: Sequence[Outcome]) -> tuple[str, ...]:
    """Return the measures with a verdict in at least half of the runs.

    Raises:
        SetupError: a run failed, or there are none.
    """
    failed = next((one.failure for one in outcomes if one.failure), "")
    if failed:
        raise SetupError(f"the rig's own values cannot be run: {failed}")
    judged = Counter(
        band.key
        for one in outcomes
        for band in BANDS
        if one.figures.get(f"{VERDICT}{band.key}") in _JUDGED
    )
    counted = tuple(band.key for band in BANDS if 2 * judged[band.key] >= len(outcomes))
    if not counted:
        raise SetupError("the runs are too short: no measure has enough events; give --seconds")
    return counted


def make_trial(point: Point, outcomes: Sequence[Outcome], counted: Sequence[str]) -> Trial:
    """Return the score of a point's runs; a failed run makes the worst possible score."""
    failed = next((one.failure for one in outcomes if one.failure), "")
    if failed:
        return Trial(point, len(counted) + 1.0, float(len(counted)), failed)
    grades = []
    for one in outcomes:
        for key in counted:
            verdict, value = one.figures.get(f"{VERDICT}{key}"), one.figures.get(f"{REPORT}{key}")
            if verdict not in _JUDGED or not isinstance(value, int | float):
                grades.append(1.0)  # too few events remain
            elif verdict == "outside":
                grades.append(grade(value, BY_KEY[key].low, BY_KEY[key].high))
    n = len(outcomes)
    return Trial(point, sum(grades) / n, sum(x > 0.0 for x in grades) / n)


def _key(point: Point) -> str:
    return json.dumps(point)


SNIPPET = "best.yaml"


def yaml_snippet(options: RunOptions, point: Point) -> str:
    """Return the values of a point as YAML that ``gazerig run RIG --character FILE`` takes.

    A run has only one character, so the changes of the runs' own character are included.
    """
    plain = load_rig(options.rig, NO_CHARACTER, options.profile)
    whole = load_rig(options.rig, options.character, options.profile)
    return params_text(nest(differences(plain, whole) | dict(point)))
