"""Faces out of view: they stay in mind where they were, and keep their identity."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from attention_scene import FACE, attention, body, looking, percept

from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.face_memory import FaceMemory
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


def test_a_remembered_face_never_wins_against_a_visible_one() -> None:
    model = attention(face_memory_s=15.0)
    looks(model, [FACE, OTHER], 0.0, 0.5)
    assert {t.id for t in looks(model, [FACE], 0.5, 14.0)} == {1}


def test_a_remembered_face_is_looked_for_when_no_other_is_there() -> None:
    model = attention()
    looks(model, [FACE, OTHER], 0.0, 0.5)
    looks(model, [FACE], 0.5, 1.0)
    alone = [t.id for t in looks(model, [HAND], 1.5, 14.0)]
    # Who is not found is forgotten.
    assert 0.5 < alone.count(2) / 30 < 3.0


@pytest.mark.parametrize("cut", [False, True])
def test_after_a_cut_nobody_is_looked_for_where_they_were(cut: bool) -> None:
    model = attention()
    looks(model, [FACE, OTHER], 0.0, 0.5)
    ids = set()
    for t in 0.5 + np.arange(300) / 30:
        seen = replace(percept(t, HAND), scene=int(cut))
        target = model.choose(seen, looking(), t)
        if t > 1.5:  # by then the choice of a new target has been made
            ids.add(target.id)
    assert ids.isdisjoint({1, 2}) is cut


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
