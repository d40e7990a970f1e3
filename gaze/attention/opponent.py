"""Observation of an opponent in a boxing match: approaching fists and open places.

Time to contact is distance over closing speed. The eye obtains it from the image alone, as the size
of the image over the rate of its growth (Lee 1976, Perception 5, 437-459), and people time their
hitting and catching by it (Lee, Young, Reddish, Lough & Clayton 1983, Quarterly Journal of
Experimental Psychology 35A, 333-346). World frame, metres, seconds.
"""

from collections.abc import Sequence
from math import inf, sqrt
from typing import NamedTuple

import numpy as np

from gazerig.gaze.angles import add, cross, dot, norm, scale, sub
from gazerig.gaze.types import PARTS, Bodies, Face, Vec3, vec

FISTS = ("hand", "glove")
"""Kinds of bodies that strike and protect."""

CHEST_M: Vec3 = (0.0, 0.0, -0.30)
"""The middle of the chest from the tip of the nose of a person who stands upright."""

_ARM_M = 0.9
"""A hand farther than this from a face belongs to another person."""
_DROPS_M_S, _LOWERED_M = 0.25, 0.7
"""A hand that is lost while it moves away from the face faster than this goes on in its direction,
to this distance: an arm that hangs with a bent elbow.
"""
HANDS = 2


class Approach(NamedTuple):
    """Approach of a fist.

    away_m: distance from the eye
    contact_s: time to contact at its present speed; inf if it does not approach
    miss_m: distance from the eye at which its straight line passes
    closing_sd_m_s: standard deviation of the closing speed; inf if unknown
    """

    id: int
    kind: str
    away_m: float
    contact_s: float
    miss_m: float
    closing_m_s: float
    closing_sd_m_s: float


class SeenHand(NamedTuple):
    """A hand of the opponent at its last position.

    off_m: its position relative to the face then
    recedes: whether it was moving away from the face
    """

    id: int
    off_m: Vec3
    seen_s: float
    recedes: bool = False


class HitTarget(NamedTuple):
    """A place to hit; clear_m: distance of the nearest hand from the line to it."""

    name: str
    p_world_m: Vec3
    clear_m: float


def approaches(bodies: Bodies, p_eye: Vec3, contact_m: float, late_s: float) -> list[Approach]:
    """Return the approach of each fist.

    Args:
        bodies: contents of one frame.
        p_eye: middle of the eyes.
        contact_m: a fist this near has arrived.
        late_s: age of the frame.
    """
    found = []
    for row, kind in enumerate(bodies.kinds):
        if kind not in FISTS:
            continue
        p, v = vec(bodies.p_world_m[row]), vec(bodies.v_world_m_s[row])
        rel = sub(p, p_eye)
        away_m, speed_m_s = norm(rel), norm(v)
        closing_m_s = -dot(v, rel) / max(away_m, 1e-6)
        contact_s, miss_m = inf, inf
        if closing_m_s > 0.0:
            contact_s = max(0.0, max(0.0, away_m - contact_m) / closing_m_s - late_s)
            miss_m = norm(cross(rel, v)) / speed_m_s
        sd = _radial_speed_sd_m_s(bodies, row, scale(rel, 1.0 / max(away_m, 1e-6)))
        found.append(Approach(bodies.ids[row], kind, away_m, contact_s, miss_m, closing_m_s, sd))
    return found


def _radial_speed_sd_m_s(bodies: Bodies, row: int, sight: Vec3) -> float:
    """Return the standard deviation of a body's speed along a direction, inf if unknown."""
    if bodies.pv_cov is None:
        return inf
    return sqrt(max(0.0, float(np.array(sight) @ bodies.pv_cov[row][3:, 3:] @ np.array(sight))))


def nearest_face(faces: Sequence[Face], p_eye: Vec3, within_m: float) -> Face | None:
    """Return the nearest face within reach, None without one."""
    near = [(norm(sub(face.p_world_m, p_eye)), face.id, face) for face in faces]
    away_m, _, face = min(near, default=(inf, -1, None), key=lambda one: one[:2])
    return face if away_m <= within_m else None


class OpponentHands:
    """Last positions of the opponent's two hands.

    A motion detector does not detect a hand at rest, and it may give another number to a hand that
    moves again. So the newest unseen hands are remembered, up to two hands in all. A hand that left
    the picture while it moved away from the face is taken to be lowered.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget both hands."""
        self._known: list[SeenHand] = []

    def step(self, bodies: Bodies, face: Face, memory_s: float, t_s: float) -> list[SeenHand]:
        """Return the known hands, those seen now first.

        Args:
            bodies: contents of one frame.
            face: the opponent's face in it.
            memory_s: a hand unseen for longer is forgotten.
            t_s: time of the frame.
        """
        seen = []
        for row, kind in enumerate(bodies.kinds):
            if kind in FISTS:
                off = sub(vec(bodies.p_world_m[row]), face.p_world_m)
                away_m = norm(off)
                if away_m <= _ARM_M:
                    v = sub(vec(bodies.v_world_m_s[row]), face.v_world_m_s)
                    recedes = dot(v, off) > _DROPS_M_S * away_m
                    seen.append(SeenHand(bodies.ids[row], off, t_s, recedes))
        # An opponent has two hands: a later, third one belongs to another person or is an arm.
        before = {hand.id for hand in self._known}
        seen = sorted(seen, key=lambda hand: hand.id not in before)[:HANDS]
        ids = {hand.id for hand in seen}
        rest = [
            _lowered(hand)
            for hand in self._known
            if hand.id not in ids and t_s - hand.seen_s <= memory_s
        ]
        # A hand with a new number is most likely the nearest known one.
        for hand in seen:
            if rest and hand.id not in {one.id for one in self._known}:
                rest.remove(min(rest, key=lambda one: norm(sub(one.off_m, hand.off_m))))
        rest.sort(key=lambda one: -one.seen_s)
        self._known = [*seen, *rest[: max(0, HANDS - len(seen))]]
        return self._known


def _lowered(hand: SeenHand) -> SeenHand:
    """Return an unseen hand, lowered if it was lost while it moved away from the face."""
    away_m = norm(hand.off_m)
    if not hand.recedes or away_m >= _LOWERED_M:
        return hand
    return hand._replace(off_m=scale(hand.off_m, _LOWERED_M / max(away_m, 1e-6)))


def hit_places(face: Face, hands: Sequence[SeenHand], p_eye: Vec3) -> list[HitTarget]:
    """Return the places to hit, those with the most room around the line first."""
    known = dict(zip(PARTS, face.parts_world_m, strict=False))
    spots = {
        "chest": add(face.p_world_m, CHEST_M),
        "left side of the face": known.get("FL", face.p_world_m),
        "right side of the face": known.get("FR", face.p_world_m),
    }
    found = [
        HitTarget(name, p, min((_distance_from_line(add(face.p_world_m, hand.off_m), p_eye, p) for hand in hands),
                           default=inf))
        for name, p in spots.items()
    ]  # fmt: skip
    return sorted(found, key=lambda place: -place.clear_m)


def _distance_from_line(p: Vec3, start: Vec3, end: Vec3) -> float:
    """Return the distance of a point from the line between two others."""
    along, rel = sub(end, start), sub(p, start)
    share = min(1.0, max(0.0, dot(rel, along) / max(dot(along, along), 1e-9)))
    return norm(sub(rel, scale(along, share)))
