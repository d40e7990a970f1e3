"""Reaction: from a hand that appears next to a face to the measured start of the gaze to it."""

from math import pi, sin
from typing import NamedTuple

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import Figures, MeasuredRun, Runs

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import ScenePerson, Thing, min_jerk

_FIRST_S, _EVERY_S, _SHOWN_S = 5.0, 3.4, 1.3
_LATEST_S, _STILL_DEG_S, _EXPRESS_MS = 0.7, 35.0, 120.0
_LEAST_S = 100.0
"""Of a run, in which eight hands come nearer: a shift may begin as a hand appears."""

WANTED = {
    "appears: answered, %": (95.0, 100.0),
    "appears: median, ms": (150.0, 250.0),
    "appears: between 150 and 250 ms, %": (60.0, 100.0),
    "appears: logarithms' standard deviation": (0.08, 0.35),
    "comes nearer fast: answered, %": (95.0, 100.0),
    "comes nearer fast: median, ms": (100.0, 200.0),
    "express (below 120 ms), %": (0.0, 5.0),
}


class Appearance(NamedTuple):
    """A hand that is there from ``start_s`` on; near: it rushes at the robot."""

    start_s: float
    side: float
    near: bool

    def place(self, t_s: float) -> Vec3:
        """Return the place of the hand."""
        since_s = t_s - self.start_s
        y = self.side * (0.22 + 0.01 * sin(2 * pi * 1.0 * since_s))
        if not self.near:
            return (0.75, y, 0.05)
        return (0.95 - 0.5 * min_jerk(min(1.0, since_s / 0.45 + 0.25)), 0.8 * y, 0.08)


def appearances(until_s: float) -> list[Appearance]:
    """Return when and where hands appear; their times have no common period with the frames."""
    out, k = [], 0
    while (start_s := _FIRST_S + _EVERY_S * k + 0.4 * (0.618034 * k % 1.0)) + _SHOWN_S < until_s:
        out.append(Appearance(start_s, 1.0 if k % 2 else -1.0, k % 3 == 2))
        k += 1
    return out


class Appearing(EmptyScene):
    """A person before the robot, and hands that appear out of nothing."""

    name = "appearing-hands"
    round_s = 3600.0

    def __init__(self) -> None:
        self._hands = appearances(self.round_s)

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the person."""
        face = (0.95, 0.008 * sin(2 * pi * 0.17 * t_s), 0.22)
        return (ScenePerson(face, (pi, -0.08), None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the hand that is shown now."""
        for number, hand in enumerate(self._hands):
            if hand.start_s <= t_s < hand.start_s + _SHOWN_S:
                return (Thing(number, "hand", hand.place(t_s), 0.06),)
        return ()


def reaction_ms(run: MeasuredRun, hand: int, share: float) -> float | None:
    """Return the time from a hand's appearance to the start of the gaze towards it; None: never.

    share: of the way to the hand that the gaze must go
    """
    there = run.truth_deg(f"thing {hand}")
    shown = np.flatnonzero(np.isfinite(there[:, 0]))
    if not len(shown):
        return None
    first = shown[0]
    window = slice(first, first + np.searchsorted(run.t_s[first:], run.t_s[first] + _LATEST_S))
    # The way to the hand at that time: neither a correction nor a look away is a reaction.
    way, done = there[window] - run.gaze_deg[first], run.gaze_deg[window] - run.gaze_deg[first]
    near = np.flatnonzero((done * way).sum(axis=1) > share * (way * way).sum(axis=1))
    if not len(near) or near[0] == 0:
        return None
    speed = np.linalg.norm(np.gradient(run.gaze_deg[window], run.t_s[window], axis=0), axis=1)
    rests = np.flatnonzero(speed[: near[0]] < _STILL_DEG_S)
    onset = rests[-1] + 1 if len(rests) else 0
    return 1e3 * float(run.t_s[first + onset] - run.t_s[first])


def measure(runs: Runs) -> Figures:
    """Return medians and shares over all hands and seeds."""
    found: dict[bool, list[float]] = {False: [], True: []}
    count = {False: 0, True: 0}
    for made in runs(Appearing(), least_s=_LEAST_S):
        for number, hand in enumerate(appearances(max(runs.seconds, _LEAST_S) - 0.5)):
            count[hand.near] += 1
            each = reaction_ms(made, number, 0.5 if hand.near else 0.8)  # a near one goes on
            if each is not None:
                found[hand.near].append(each)
    still, near = np.array(found[False]), np.array(found[True])
    both = np.concatenate((still, near))
    return {
        "appears: answered, %": 100.0 * len(still) / max(1, count[False]),
        "appears: median, ms": np.median(still),
        "appears: between 150 and 250 ms, %": 100.0 * ((still >= 150) & (still <= 250)).mean(),
        "appears: logarithms' standard deviation": np.log(still[still > 0.0]).std(),
        "comes nearer fast: answered, %": 100.0 * len(near) / max(1, count[True]),
        "comes nearer fast: median, ms": np.median(near),
        "express (below 120 ms), %": 100.0 * (both < _EXPRESS_MS).mean(),
    }
