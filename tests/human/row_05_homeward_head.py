"""The head after a shift back: never past the target, and no further for less interest.

A thing is looked at 60 deg aside, then one at 25 deg on the same side, with the head's law of eq 7
at the least, a middling and the highest interest, and with the default law. Angles are the
measured neck's, from where it was when the nearer thing became the target to where it is 0.75 s
later; what comes after that brings an eccentric eye back, whatever the law.
"""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from fakes.scenes import EmptyScene
from human.lights import at_yaw
from human.measured_run import MeasuredRun, Runner

from gazerig.sim_mock.scenes.scene import Thing

_STAGES = ((0.0, 60.0), (4.0, 25.0))
"""From when on the thing is at which yaw."""

_TURNED_S = 0.75
_INTERESTS = (0.2, 0.5, 1.0)

WANTED = {
    "past the target, deg": (0.0, 1.5),
    "less interest turns further by, deg": (0.0, 1.5),
    "default law: homeward by Stahl, measured less expected, deg": (-3.0, 3.0),
}


class ThereAndBack(EmptyScene):
    """A thing 60 deg to the left, then one at 25 deg."""

    name = "there-and-back"
    round_s = 7.0

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the one thing that is there now."""
        rounds, since_s = divmod(t_s, self.round_s)
        number = sum(since_s >= start_s for start_s, _ in _STAGES) - 1
        place = at_yaw(_STAGES[number][1])
        return (Thing(10 * int(rounds) + number, "ball", place, 0.05),)


SCENE = ThereAndBack()


def measure(run: Runner, seconds: float, seeds: Sequence[int]) -> dict[str, float]:
    """Return how far past the target and how much further for less interest, at most."""
    eq_7 = [
        _shifts([_of(run, seed, min(seconds, 24.0), interest, "attention") for seed in seeds])
        for interest in _INTERESTS
    ]
    law = _shifts([_of(run, seed, min(seconds, 24.0), 0.5, "stahl") for seed in seeds])
    turned = [float(np.median(one[:, 1])) for one in eq_7]
    every = np.concatenate([*eq_7, law])
    expected = 0.77 * np.maximum(0.0, law[:, 0] - 17.9)
    return {
        "past the target, deg": float(max(0.0, (every[:, 2] - every[:, 0]).max())),
        "less interest turns further by, deg": max(
            0.0, *(less - more for less, more in pairwise(turned))
        ),
        "default law: homeward by Stahl, measured less expected, deg": float(
            np.median(law[:, 1] - expected)
        ),
    }


def _of(run: Runner, seed: int, seconds: float, interest: float, model: str) -> MeasuredRun:
    return run(
        SCENE,
        seed=seed,
        seconds=seconds,
        overrides={
            "gaze.head.goal_model": model,
            "gaze.drift": "none",
            "gaze.top_down.rules.wait.look_at": "ball",
            "gaze.top_down.rules.wait.salience": interest,
            "gaze.bottom_up.onset_salience": 0.0,
            "camera.horizontal_field_deg": 140.0,  # so that both are seen from anywhere
        },
    )


def _shifts(runs: Sequence[MeasuredRun]) -> np.ndarray:
    """Return (n, 3) arc from the head to the nearer thing, turned by it after a while, at most."""
    rows = []
    for one in runs:
        yaw, goes = one.head_deg[:, 0], one.target_deg[:, 0]
        for k in np.flatnonzero(np.diff(one.shift)) + 1:
            after = (one.t_s >= one.t_s[k]) & (one.t_s <= one.t_s[k] + _TURNED_S)
            if one.t_s[-1] < one.t_s[k] + _TURNED_S or not goes[k] < 35.0 < 50.0 < goes[k - 1]:
                continue
            way = yaw[k] - yaw[after]
            rows.append((yaw[k] - goes[k], way[-1], way.max()))
    return np.array(rows).reshape(-1, 3)
