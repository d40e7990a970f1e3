"""Faces out of view: they stay in mind where they were, and keep their identity."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from attention_scene import FACE, attention, body, looking, percept

from gazerig.gaze.attention import Attention
from gazerig.gaze.face_memory import FaceMemory
from gazerig.gaze.types import Target

OTHER = body(2, "face", (1.0, 0.6, 0.0))
HAND = body(3, "hand", (0.8, 0.5, -0.1), (0.0, 1.0, 0.0))


def looks(model: Attention, rows: list[Any], start_s: float, seconds: float) -> list[Target]:
    times = start_s + np.arange(round(30 * seconds)) / 30
    return [model.choose(percept(t, *rows), looking(), t) for t in times]


@pytest.mark.parametrize(("memory_s", "kind"), [(15.0, "face"), (0.0, "hand")])
def test_when_a_thing_is_lost_the_gaze_returns_to_the_face_that_was_there(
    memory_s: float, kind: str
) -> None:
    model = attention(face_memory_s=memory_s)
    looks(model, [FACE], 0.0, 0.5)
    assert looks(model, [FACE, HAND], 0.5, 0.5)[-1].kind == "hand"
    assert looks(model, [HAND], 1.0, 1.0)[-1].kind == "hand"
    after = looks(model, [], 2.0, 0.5)[-1]
    assert after.kind == kind
    if kind == "face":
        assert after.p_world_m == FACE[2]


def test_of_two_people_of_whom_one_is_out_of_view_both_are_looked_at() -> None:
    """The camera sees only the one that the head is turned to."""
    shares = {}
    for memory_s in (15.0, 0.0):
        model, at, ids = attention(face_memory_s=memory_s), 1, []
        for k in range(900):
            rows = [FACE, OTHER] if k < 15 else [FACE] if at == 1 else [OTHER]
            target = model.choose(percept(k / 30, *rows), looking(), k / 30)
            at = target.id if target.kind == "face" else at
            ids.append(target.id)
        shares[memory_s] = [ids.count(one) / len(ids) for one in (1, 2)]
    assert min(shares[15.0]) > 0.3
    assert min(shares[0.0]) < 0.1


def test_who_is_not_found_is_forgotten_and_who_is_lost_is_searched_for() -> None:
    model = attention()
    looks(model, [FACE, OTHER], 0.0, 0.5)
    alone = [t.id for t in looks(model, [FACE], 0.5, 10.0)]
    assert 2 in alone
    gone = 0.5 + alone.index(2) / 30
    found = [t.id for t in looks(model, [FACE], 10.5, 10.0)]
    assert 0.5 < alone.count(2) / 30 < 1.2 and 2 not in found, gone
    # The one that is looked at while it leaves is nowhere to be remembered.
    last = looks(model, [], 20.5, 3.0)
    assert last[5].why == "lost, waiting" and last[-1].kind != "face"


@pytest.mark.parametrize("cut", [False, True])
def test_after_a_cut_nobody_is_looked_for_where_they_were(cut: bool) -> None:
    model = attention()
    looks(model, [FACE, OTHER], 0.0, 0.5)
    stranger = body(7, "face", (1.0, -0.3, 0.0))
    ids = set()
    for t in 0.5 + np.arange(300) / 30:
        seen = replace(percept(t, stranger), scene=int(cut))
        target = model.choose(seen, looking(), t)
        if t > 1.5:  # by then the choice of a new target has been made
            ids.add(target.id)
    assert (ids == {7}) is cut


def test_memory_lasts_as_long_as_it_is_told_and_no_longer() -> None:
    memory = FaceMemory()
    both, one = percept(0.0, FACE, OTHER).bodies, percept(0.0, FACE).bodies
    assert memory.step(both, 1, 0.0, 5.0) is both
    assert memory.step(one, 1, 1.0, 5.0).ids == (1, 2)
    assert memory.step(one, 1, 5.0, 5.0).ids == (1, 2)
    assert memory.step(one, 1, 5.1, 5.0) is one
    memory.step(both, 1, 6.0, 5.0)
    memory.reset()
    assert memory.step(one, 1, 6.1, 5.0) is one
