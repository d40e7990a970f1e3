"""A ball that flies at the face: the lids are shut as it arrives, and the head withdraws.

Fast approach makes people blink before contact (Holmes & Spence 2004 review defensive space), and
startle turns the head away. A ball is held 3 m away and thrown five times at 6 m/s.
"""

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import Figures, MeasuredRun, Runs
from human.swinging_face import HEAD_M

from gazerig.sim_mock.scenes.scene import Thing

WANTED = {
    "balls with a blink, .25 s before to .1 s after, %": (100.0, 100.0),
    "balls from which the head withdraws by 2 deg, %": (100.0, 100.0),
}

_FIRST_S, _EVERY_S, _HELD_S, _THROWS, _SPEED_M_S = 6.0, 8.0, 3.0, 5, 6.0
_FROM_M = ((3.0, 0.0, 0.3), (2.9, 0.6, 0.35), (2.9, -0.6, 0.2), (3.0, 0.25, 0.5), (3.0, -0.3, 0.1))
_GONE_M, _SHUT = 0.12, 0.5
_BLINKS_S, _WITHDRAWS_S, _WITHDRAWS_DEG = (-0.25, 0.1), (-0.3, 0.6), 2.0


class Balls(EmptyScene):
    """One ball after the other, held and then thrown to the middle of the eyes."""

    name = "balls at the face"
    round_s = 3600.0

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the ball, if one is held or flies."""
        number, since_s = divmod(t_s - _FIRST_S + _HELD_S, _EVERY_S)
        if not 0 <= number < _THROWS:
            return ()
        start, end = np.array(_FROM_M[int(number)]), np.array(HEAD_M)
        way_m = float(np.linalg.norm(end - start))
        share = max(0.0, since_s - _HELD_S) * _SPEED_M_S / way_m
        if share > 1.0 - _GONE_M / way_m:
            return ()
        x, y, z = (start + share * (end - start)).tolist()
        return (Thing(int(number), "ball", (x, y, z), 0.06),)


def measure(runs: Runs) -> Figures:
    """Return the shares over all throws and seeds."""
    lasts_s = _FIRST_S + _EVERY_S * (_THROWS - 1) + 3.0
    ahead = {"gaze.idle.explores": False}  # it sees the balls
    thrown = runs(Balls(), lasts_s, lasts_s, overrides=ahead)
    found = np.array([answer(one, n) for one in thrown for n in range(_THROWS)])
    blinked, withdrawn = 100.0 * found.mean(axis=0)
    return {
        "balls with a blink, .25 s before to .1 s after, %": blinked,
        "balls from which the head withdraws by 2 deg, %": withdrawn,
    }


def answer(one: MeasuredRun, number: int) -> tuple[bool, bool]:
    """Return whether the lids are shut as a ball arrives, and whether the head is drawn back."""
    ball = one.truth_deg(f"thing {number}")
    there = np.flatnonzero(np.isfinite(ball[:, 0]))
    comes_s = one.t_s[there[-1]]
    lids = one.trace.column("lid")[slice(*np.searchsorted(one.t_s, np.add(comes_s, _BLINKS_S)))]
    first, last = np.searchsorted(one.t_s, np.add(comes_s, _WITHDRAWS_S))
    up = one.head_deg[first:last, 1]  # a neck draws the head back by lifting the chin
    return bool(lids.min() < _SHUT), bool(up.max() - up[0] > _WITHDRAWS_DEG)
