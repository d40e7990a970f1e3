"""Reaction times: how long after something new wins attention the target changes."""

from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from attention_scene import FACE, body, looking, percept
from attention_scene import attention as make_attention

FRAME_S, TICK_S, DELAY_S = 1 / 30, 1 / 200, 0.06
REACHES = body(2, "hand", (0.8, 0.3, -0.05), (0.0, 1.0, 0.0))
NEARS = body(2, "hand", (0.8, 0.0, -0.1), (-1.0, 0.0, 0.1))


MEDIAN: Any = SimpleNamespace(standard_normal=lambda: 0.0)
"""Draws the median reaction time."""


def attention(rng=MEDIAN, dwell_ms=0.0):
    return make_attention(rng=rng, min_dwell_ms=dwell_ms)


class Viewer:
    """Attention before a camera that shows frames late and now and then."""

    def __init__(self, model):
        self.model = model
        self._t_s = 0.0
        self._shown: list[tuple[float, list[Any]]] = []

    def show(self, rows, for_s, tick_s=TICK_S):
        """Show bodies; return what is looked at, tick by tick: time since, kind and id."""
        return list(self._looks(rows, for_s, tick_s))

    def _looks(self, rows, for_s, tick_s=TICK_S):
        start_s = self._t_s
        self._shown.append((start_s, rows))
        for k in range(round(for_s / tick_s)):
            t_s = start_s + k * tick_s
            exposed_s = int((t_s - DELAY_S) / FRAME_S + 1e-9) * FRAME_S
            target = self.model.choose(self._percept(exposed_s), looking(), t_s)
            yield k * tick_s, target.kind, target.id
        self._t_s = start_s + round(for_s / tick_s) * tick_s

    def _percept(self, exposed_s):
        before = [rows for since_s, rows in self._shown if since_s <= exposed_s + 1e-9]
        return percept(exposed_s, *before[-1]) if before and exposed_s >= 0.0 else None

    def reaction_s(self, rows, kind):
        """Return the time from showing something to the first look at it."""
        return next(t_s for t_s, looked_at, _ in self._looks(rows, 0.8) if looked_at == kind)


@cache
def reactions(nearer, count):
    times = []
    for seed in range(count):
        viewer = Viewer(attention(np.random.default_rng(seed)))
        viewer.show([FACE], 2.5, FRAME_S)
        times.append(viewer.reaction_s([FACE, NEARS if nearer else REACHES], "hand"))
    return np.array(times)


def test_e70_reactions_are_those_of_people():
    times = reactions(False, 120)
    assert 0.15 <= np.median(times) <= 0.25
    assert (times < 0.1).mean() <= 0.05
    assert ((times > 0.11) & (times < 0.23)).mean() > 0.9
    # Log-normal: the logarithms scatter as given, and their tails are alike.
    assert np.log(times).std() == pytest.approx(0.15, abs=0.03)


def test_e70_what_comes_nearer_is_answered_sooner():
    aside, nearer = np.median(reactions(False, 120)[:40]), np.median(reactions(True, 40))
    assert nearer == pytest.approx(0.65 * aside, abs=0.01)


def test_what_has_gone_before_its_time_is_not_looked_at():
    viewer = Viewer(attention())
    viewer.show([FACE], 2.5)
    assert {kind for _, kind, _ in viewer.show([FACE, REACHES], 0.05)} == {"face"}
    assert {kind for _, kind, _ in viewer.show([FACE], 0.5)} == {"face"}


def test_what_wins_meanwhile_takes_over_the_time():
    viewer = Viewer(attention())
    viewer.show([FACE], 2.5)
    viewer.show([FACE, REACHES], 0.05)
    faster = body(3, "hand", (0.8, -0.3, -0.05), (0.0, 4.0, 0.0))
    looks = viewer.show([FACE, faster], 0.3)
    first = next((t_s, id) for t_s, kind, id in looks if kind == "hand")
    assert first == (pytest.approx(0.1, abs=TICK_S), 3)


def test_the_shortest_time_on_a_target_and_the_reaction_run_side_by_side():
    viewer = Viewer(attention(dwell_ms=300.0))
    viewer.show([FACE], 0.2)  # looked at from 0.15 s on
    assert viewer.reaction_s([FACE, REACHES], "hand") == pytest.approx(0.25, abs=0.006)


def test_a_change_of_behaviour_waits_for_nothing():
    viewer = Viewer(attention())
    place = body(9, "attack_target", (0.8, -0.2, 0.0))
    viewer.show([FACE], 2.5)
    viewer.model.top_down.behave("attack")
    assert viewer.reaction_s([FACE, place], "attack_target") == pytest.approx(0.06, abs=TICK_S)
