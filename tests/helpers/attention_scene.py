"""Bodies about a head that attends to them."""

from math import radians
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np

from gazerig.gaze.angles import rotation
from gazerig.gaze.attention.attention import Attention, AttentionParams
from gazerig.gaze.attention.bottom_up import BottomUp, BottomUpParams
from gazerig.gaze.attention.idle import Idle, IdleParams
from gazerig.gaze.attention.top_down import TopDown, TopDownParams
from gazerig.gaze.types import Bodies, Floats, GazeState, Percept, Target, Vec3

IDENTITY = rotation((0.0, 0.0, 0.0))

NO_STAYS: Any = SimpleNamespace(standard_normal=lambda: -99.0)
"""Draws no additional times of looks."""


def looking(eye_yaw_deg: float = 0.0) -> GazeState:
    eye = (radians(eye_yaw_deg), 0.0)
    return GazeState(
        (0, 0, 0), (0, 0, 0), eye, eye, IDENTITY, (0, 0, 0), (0, 0.03, 0), (0, -0.03, 0), 1.0, 1.0
    )


Row = tuple[int, str, tuple[float, ...], tuple[float, ...]]
"""Number, kind, place and velocity of a body."""


def body(id: int, kind: str, p: Vec3, v: Vec3 = (0, 0, 0)) -> Row:
    return id, kind, p, v


def percept(t: float, *rows: Row) -> Percept:
    ids, kinds, places, speeds = zip(*rows, strict=True) if rows else ((), (), (), ())
    n = len(ids)
    return Percept(
        t,
        Bodies(
            ids,
            kinds,
            np.array(places, float).reshape(n, 3),
            np.array(speeds, float).reshape(n, 3),
            np.zeros((n, 3)),
            np.full(n, 0.1),
        ),
    )


class Terms(NamedTuple):
    """Salience of n bodies, term by term: (n,) arrays."""

    translation: Floats
    looming: Floats
    rotation: Floats
    onset: Floats
    total: Floats


def salience(
    model: BottomUp,
    seen: Bodies,
    t_s: float,
    v_eye: Vec3 = (0.0, 0.0, 0.0),
    gaze: Vec3 = (1.0, 0.0, 0.0),
    in_view: bool = True,
) -> Terms:
    rows = model.step(seen.rows(), (0.0, 0.0, 0.0), t_s, v_eye, gaze, seen.ids if in_view else ())
    return Terms(*(np.array([getattr(row, name) for row in rows]) for name in Terms._fields))


def attention(
    top_down: TopDownParams | None = None,
    rng: np.random.Generator | None = None,
    stays: np.random.Generator = NO_STAYS,
    **params: Any,
) -> Attention:
    """Return attention that changes its target at once without a generator for its reactions."""
    reaction = "none" if rng is None else "people"
    return Attention(
        AttentionParams(**{"reaction": reaction, **params}),
        BottomUp(BottomUpParams()),
        TopDown(top_down or TopDownParams()),
        Idle(IdleParams(explores=False), np.random.default_rng(0)),
        rng or np.random.default_rng(0),
        stays,
    )


FACE = body(1, "face", (1.0, 0.0, 0.0))


def waving(speed: float, x: float = 0.8) -> Row:
    """Return a hand beside the face that moves sideways."""
    return body(2, "hand", (x, 0.3, -0.05), (0.0, speed, 0.0))


def look(model: Attention, t: float, *rows: Row) -> Target:
    """Return what is looked at among these bodies, seen at once."""
    return model.choose(percept(t, *rows), looking(), t)
