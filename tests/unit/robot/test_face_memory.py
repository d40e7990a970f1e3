"""Faces out of view: they stay in mind where they were, and keep their identity."""

from typing import Any

import numpy as np
import pytest
from attention_scene import FACE, IDENTITY, attention, body, looking, percept
from msgspec import structs

from gazerig.gaze.attention.attention import Attention
from gazerig.gaze.attention.face_memory import FaceMemory
from gazerig.gaze.types import Face, Target, Vec3

OTHER = body(2, "face", (1.0, 0.6, 0.0))
HAND = body(3, "hand", (0.8, 0.5, -0.1), (0.0, 1.0, 0.0))


def looks(
    model: Attention,
    rows: list[Any],
    start_s: float,
    seconds: float,
    speaker: int | None = None,
) -> list[Target]:
    times = start_s + np.arange(round(30 * seconds)) / 30
    seen = (percept(t, *rows) for t in times)
    p: Vec3 = (1.0, 0.0, 0.0)
    faces = (Face(speaker, p, p, IDENTITY, (p,) * 8, 0.9, speaks=True),) if speaker else ()
    return [
        model.choose(structs.replace(one, faces=faces), looking(), one.captured_s) for one in seen
    ]


@pytest.mark.parametrize(("social", "kind"), [("people", "face"), ("none", "hand")])
def test_when_a_thing_is_lost_the_gaze_returns_to_the_face_that_was_there(social, kind):
    model = attention(social=social)
    looks(model, [FACE], 0.0, 2.5)
    assert looks(model, [FACE, HAND], 2.5, 0.5)[-1].kind == "hand"
    looks(model, [HAND], 3.0, 1.0)
    after = looks(model, [], 4.0, 0.5)[-1]
    assert after.kind == kind
    if kind == "face":
        assert after.p_world_m == FACE[2]


def test_a_remembered_face_is_looked_for_when_no_other_is_there():
    model = attention()
    looks(model, [FACE, OTHER], 0.0, 0.5)
    looks(model, [FACE], 0.5, 1.0)
    alone = [t.id for t in looks(model, [HAND], 1.5, 14.0)]
    # Missing people are forgotten.
    assert 0.5 < alone.count(2) / 30 < 3.0


@pytest.mark.parametrize("cut", [False, True])
def test_after_a_cut_nobody_is_looked_for_where_they_were(cut):
    model = attention()
    looks(model, [FACE, OTHER], 0.0, 0.5)
    ids = set()
    for t in 0.5 + np.arange(300) / 30:
        seen = structs.replace(percept(t, HAND), scene=int(cut))
        target = model.choose(seen, looking(), t)
        if t > 1.5:  # by then the choice of a new target has been made
            ids.add(target.id)
    assert ids.isdisjoint({1, 2}) is cut


def test_memory_lasts_as_long_as_it_is_told_and_no_longer():
    memory = FaceMemory()
    both, one = percept(0.0, HAND, OTHER).bodies.rows(), percept(0.0, HAND).bodies.rows()
    assert memory.step(both, 3, 0.0) == both
    assert memory.step(one, 3, 1.0).ids == (3, 2)
    assert memory.step(one, 3, 60.0).ids == (3, 2)
    assert memory.step(one, 3, 60.1) == one


@pytest.mark.parametrize("talked", [False, True])
def test_the_gaze_goes_to_who_is_out_of_view_but_not_during_a_turn_of_talk(talked):
    model = attention()
    looks(model, [FACE, OTHER], 0.0, 0.5)
    during = [t.id for t in looks(model, [FACE], 0.5, 2.0, speaker=1 if talked else None)]
    after = [t.id for t in looks(model, [FACE], 2.5, 4.0)]
    assert 2 in during + after and after[-1] == 1  # who is not found is forgotten
    if talked:
        assert 2 not in during and after.index(2) <= 0.5 * 30
