"""Action planner of a boxing match: guard, attack or wait (Mitake et al. 3.2, 3.3.3).

The paper takes the three behaviours from the action planner of an earlier boxing game, which it
does not describe and which has access to both bodies. This planner uses only percepts, one after
the other.

guard   A fist approaches the head directly and arrives soon. The gaze follows it until it stops.
attack  The opponent is within reach, no fist approaches, and a place is open: no hand is near the
        line to it; for a moment after a punch less room suffices. The gaze is on the place before
        the blow.
wait    Anything else.

No place is open while the position of a hand is unknown. A hand that left the picture while it
moved away from the face is taken to be lowered.

Time to contact is distance over closing speed. The eye obtains it from the image alone, as the size
of the image over the rate of its growth (Lee 1976, Perception 5, 437-459), and people time their
hitting and catching by it (Lee, Young, Reddish, Lough & Clayton 1983, Quarterly Journal of
Experimental Psychology 35A, 333-346). World frame, metres, seconds.
"""

from collections.abc import Sequence
from math import dist, inf, sqrt
from typing import NamedTuple

import numpy as np

from gazerig.gaze.angles import add, cross, dot, norm, scale, sub
from gazerig.gaze.types import PARTS, Bodies, Face, Percept, Vec3, body_name, vec

ACTIONS = ("wait", "guard", "attack")
FISTS = ("hand", "glove")
"""Kinds of bodies that strike and protect."""
HANDS = 2
CHEST_M: Vec3 = (0.0, 0.0, -0.30)
"""The middle of the chest from the tip of the nose of a person who stands upright."""

_STILL: Vec3 = (0.0, 0.0, 0.0)
_CONTACT_S, _CONTACT_M = 0.45, 0.3
"""Guard is against a fist that arrives within this time; a fist this near to the head has arrived.
"""
_CLOSING_M_S, _MISS_M = 0.8, 0.2
"""A fist that approaches more slowly is no punch, nor one that would pass the middle of the eyes
farther away: half a head and half a fist.
"""
_REACTION_S = 0.03
"""A possible punch must have approached for this long, unless its speed is certain."""
_RELEASE = 1.5
"""Guard ends when the fist fails these limits by more than this factor."""
_GUARD_S = 0.3
"""Shortest time on guard."""
_REACH_M = 1.3
"""An opponent whose face is farther away is not attacked."""
_OPEN_M, _OPENING_S = 0.28, 0.2
"""A place is open if every hand has been this far from the line to it for this long."""
_COUNTER_S, _COUNTER = 0.3, 0.6
"""For this time after a guard, this share of that distance suffices at once."""
_ATTACK_S, _REST_S = 0.6, 0.8
"""Duration of the look at the place before the blow has landed; shortest time to the next."""
_MEMORY_S = 0.6
"""An unseen hand is remembered for this long: where it was, or lowered if it moved away from the
face.
"""
_SURE_SD = 2.0
"""A speed is certain if it exceeds its limit by this number of standard deviations."""
_LONGEST_GAP_S = 0.5
"""Duration without a frame after which every action ends."""
_ARM_M = 0.9
"""A hand farther than this from a face belongs to another person."""
_DROPS_M_S, _LOWERED_M = 0.25, 0.7
"""A hand that is lost while it moves away from the face faster than this goes on in its direction,
to this distance: an arm that hangs with a bent elbow.
"""


class Plan(NamedTuple):
    """Action and reason.

    body_id: the approaching fist, on guard; -1 otherwise
    p_world_m, v_world_m_s: the place to hit, in an attack; None otherwise
    """

    action: str
    why: str
    body_id: int = -1
    p_world_m: Vec3 | None = None
    v_world_m_s: Vec3 = _STILL

    @property
    def text(self) -> str:
        """Return action and reason."""
        return f"{self.action}: {self.why}"


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


class ActionPlanner:
    """Action planner, stepped once for each new percept."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget the opponent and the present action."""
        self._hands: list[SeenHand] = []
        self.plan = Plan("wait", "no one is in view")
        self._since_s = self._at_s = self._guard_end_s = self._attack_end_s = -inf
        self._comes: tuple[int, float] | None = None
        self._open: tuple[str, float] | None = None
        self._place = ""

    def step(self, percept: Percept, p_eye: Vec3, t_s: float, asked: str | None = None) -> Plan:
        """Return the next action.

        Args:
            percept: the new percept.
            p_eye: middle of the robot's eyes.
            t_s: present time, seconds; the percept is older.
            asked: the action that the user has chosen; None: the planner decides.
        """
        if t_s - self._at_s > _LONGEST_GAP_S:
            self.reset()
        self._at_s = t_s
        threat = self._threat(percept, p_eye, t_s)
        near = [(dist(face.p_world_m, p_eye), face.id, face) for face in percept.faces]
        away_m, _, face = min(near, default=(inf, -1, None), key=lambda one: one[:2])
        if away_m > _REACH_M:
            face = None
        found = []
        if face is not None:
            self._hands = remember_hands(self._hands, percept.bodies, face, t_s)
            if len(self._hands) >= HANDS or asked is not None:
                found = hit_places(face, self._hands, p_eye)
        if asked is not None:
            self.plan = self._user_plan(asked, percept, face, found, p_eye)
            self._since_s = t_s
        elif threat is not None:
            self.plan = self._guard(threat, t_s)
        elif self.plan.action != "guard" or t_s - self._since_s >= _GUARD_S:
            if self.plan.action == "guard":
                self._guard_end_s = t_s
            self.plan = self._attack(face, found, t_s)
        return self.plan

    def _user_plan(
        self,
        asked: str,
        percept: Percept,
        face: Face | None,
        found: list[HitTarget],
        p_eye: Vec3,
    ) -> Plan:
        """Return the user's action, for the place with most room or the nearest fist."""
        why = "asked for"
        if asked == "attack" and face is not None:
            return Plan(asked, why, -1, found[0].p_world_m, face.v_world_m_s)
        if asked == "guard" and (fists := approaches(percept.bodies, p_eye)):
            return Plan(asked, why, min(fists, key=lambda one: one.away_m).id)
        return Plan(asked, why)

    def _threat(self, percept: Percept, p_eye: Vec3, t_s: float) -> Approach | None:
        """Return the first fist to arrive of those that have approached for the reaction time."""
        guarded, late_s = self.plan.body_id, max(0.0, t_s - percept.captured_s)
        coming = [
            one
            for one in approaches(percept.bodies, p_eye, late_s)
            if _is_punch(one, _RELEASE if one.id == guarded else 1.0)
        ]
        if not coming:
            self._comes = None
            return None
        first = min(coming, key=lambda one: (one.contact_s, one.id))
        if self._comes is None or self._comes[0] != first.id:
            self._comes = first.id, percept.captured_s
        ready = percept.captured_s - self._comes[1] >= _REACTION_S - 1e-9
        sure = first.closing_m_s - _SURE_SD * first.closing_sd_m_s >= _CLOSING_M_S
        return first if sure or ready or self.plan.action == "guard" else None

    def _guard(self, threat: Approach, t_s: float) -> Plan:
        if self.plan.action != "guard":
            self._since_s = t_s
        self._open = None
        why = f"{body_name(threat.kind, threat.id)} arrives in {threat.contact_s:.2f} s"
        return Plan("guard", why, threat.id)

    def _attack(self, face: Face | None, found: list[HitTarget], t_s: float) -> Plan:
        """Begin an attack, continue it, or wait."""
        now = self.plan
        if now.action == "attack":
            if t_s - self._since_s < _ATTACK_S:
                there = [place for place in found if place.name == self._place]
                if face is None or not there:  # missed for a frame
                    return now
                return now._replace(p_world_m=there[0].p_world_m, v_world_m_s=face.v_world_m_s)
            self._attack_end_s = t_s
        counters = t_s - self._guard_end_s < _COUNTER_S
        if face is None:
            why = "no opponent within reach"
        elif not found:
            why = "not both hands of the opponent are known"
        elif found[0].clear_m < _OPEN_M * (_COUNTER if counters else 1.0):
            closed = f"the opponent's guard is closed ({found[0].clear_m:.2f} m)"
            why = f"no fist approaches, and {closed}"
        else:
            return self._strike(found[0], face.v_world_m_s, counters, t_s)
        self._open = None
        return Plan("wait", why)

    def _strike(self, best: HitTarget, v_m_s: Vec3, counters: bool, t_s: float) -> Plan:
        """Attack a place that has been open for long enough."""
        if self._open is None or self._open[0] != best.name:
            self._open = best.name, t_s
        if not counters and t_s - self._open[1] < _OPENING_S - 1e-9:
            return Plan("wait", f"no fist approaches; {best.name} opens")
        if t_s - self._attack_end_s < _REST_S:
            return Plan("wait", f"{best.name} is open, but the last attack has just ended")
        self._since_s, self._place = t_s, best.name
        after = " after a punch" if counters else ""
        why = f"{best.name} is open{after} ({best.clear_m:.2f} m from any hand)"
        return Plan("attack", why, -1, best.p_world_m, v_m_s)


def _is_punch(one: Approach, ratio: float) -> bool:
    """Return whether a fist moves like a punch; ratio: tolerance."""
    return (
        one.contact_s < ratio * _CONTACT_S
        and one.closing_m_s * ratio >= _CLOSING_M_S
        and one.miss_m <= ratio * _MISS_M
    )


def approaches(bodies: Bodies, p_eye: Vec3, late_s: float = 0.0) -> list[Approach]:
    """Return the approach of each fist.

    Args:
        bodies: contents of one frame.
        p_eye: middle of the eyes.
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
        contact_s, miss_m, closing_sd_m_s = inf, inf, inf
        if closing_m_s > 0.0:
            contact_s = max(0.0, max(0.0, away_m - _CONTACT_M) / closing_m_s - late_s)
            miss_m = norm(cross(rel, v)) / speed_m_s
        if bodies.v_cov is not None:
            sight = np.array(scale(rel, 1.0 / max(away_m, 1e-6)))
            variance = float(sight @ bodies.v_cov[row] @ sight)
            closing_sd_m_s = sqrt(max(0.0, variance))
        found.append(
            Approach(bodies.ids[row], kind, away_m, contact_s, miss_m, closing_m_s, closing_sd_m_s)
        )
    return found


def remember_hands(
    known: Sequence[SeenHand], bodies: Bodies, face: Face, t_s: float
) -> list[SeenHand]:
    """Return the opponent's hands, those seen now first.

    A motion detector does not detect a hand at rest, and it may give another number to a hand that
    moves again. So the newest unseen hands are remembered, up to two hands in all. A hand that left
    the picture while it moved away from the face is taken to be lowered.

    Args:
        known: the hands of the frame before.
        bodies: contents of one frame.
        face: the opponent's face in it.
        t_s: time of the frame.
    """
    seen = []
    for row, kind in enumerate(bodies.kinds):
        off = sub(vec(bodies.p_world_m[row]), face.p_world_m)
        away_m = norm(off)
        if kind in FISTS and away_m <= _ARM_M:
            v = sub(vec(bodies.v_world_m_s[row]), face.v_world_m_s)
            recedes = dot(v, off) > _DROPS_M_S * away_m
            seen.append(SeenHand(bodies.ids[row], off, t_s, recedes))
    # An opponent has two hands: a later, third one belongs to another person or is an arm.
    before = {hand.id for hand in known}
    seen = sorted(seen, key=lambda hand: hand.id not in before)[:HANDS]
    ids = {hand.id for hand in seen}
    rest = [
        _lowered(hand) for hand in known if hand.id not in ids and t_s - hand.seen_s <= _MEMORY_S
    ]
    # A hand with a new number is most likely the nearest known one.
    for hand in seen:
        if rest and hand.id not in before:
            rest.remove(min(rest, key=lambda one: norm(sub(one.off_m, hand.off_m))))
    rest.sort(key=lambda one: -one.seen_s)
    return [*seen, *rest[: HANDS - len(seen)]]


def _lowered(hand: SeenHand) -> SeenHand:
    """Return an unseen hand, lowered if it was lost while it moved away from the face."""
    away_m = norm(hand.off_m)
    if not hand.recedes or away_m >= _LOWERED_M:
        return hand
    return hand._replace(off_m=scale(hand.off_m, _LOWERED_M / max(away_m, 1e-6)))


def hit_places(face: Face, hands: Sequence[SeenHand], p_eye: Vec3) -> list[HitTarget]:
    """Return the places to hit, those with the most room around the line first."""
    known = dict(zip(PARTS, face.parts_world_m, strict=True))
    spots = {
        "chest": add(face.p_world_m, CHEST_M),
        "left side of the face": known["FL"],
        "right side of the face": known["FR"],
    }
    found = [
        HitTarget(name, p, min((_distance_from_line(add(face.p_world_m, hand.off_m), p_eye, p) for hand in hands),
                           default=inf))
        for name, p in spots.items()
    ]  # fmt: skip
    return sorted(found, key=lambda place: -place.clear_m)


def _distance_from_line(p: Vec3, start: Vec3, end: Vec3) -> float:
    along, rel = sub(end, start), sub(p, start)
    share = min(1.0, max(0.0, dot(rel, along) / max(dot(along, along), 1e-9)))
    return norm(sub(rel, scale(along, share)))
