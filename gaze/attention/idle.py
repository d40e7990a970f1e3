"""Idle gaze without a target: wait, search, then explore the view.

A person who leaves the frame often returns immediately, and a detector has gaps. So the gaze first
stays. Then it searches in steps: towards the side to which the person left, and around the place of
the loss. If no person is found it looks back from a far side and explores: one to two shifts of
gaze per second, as people make in front of a scene, with an occasional rest straight ahead. A
camera sees a part of the room: every few seconds the head turns far to one side, to the left and to
the right in turn.

A glance goes to a thing in view, or to a recently seen one, or otherwise to a plausible point.
Shifts are mostly small (Malinov 2000: half below 5 deg, 83 % below 15) and more sideways than up or
down, and people look more at the middle of a scene than at its edges. So a shift is drawn from the
present point and accepted by the odds of its end point.

Search points have the kind "search", glances the kind "glance". Each has its own id, -2 - n for the
n-th since the reset, counted over both kinds: a shift is counted when kind or id changes, so every
glance is a shift of gaze. The resting point is "rest" with id -1. Directions are seen from a point
above the neck base at the resting height.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from math import cos, degrees, exp, hypot, inf, pi, radians, sin
from typing import Annotated

import numpy as np
from msgspec.structs import replace

from gazerig.gaze.angles import add, angle_between, direction, norm, scale, sub, wrap, yaw_pitch
from gazerig.gaze.draws import draw_lognormal
from gazerig.gaze.types import SEARCH, Angles2, Target, Vec3, body_name
from gazerig.params import Bounds

REST_M: Vec3 = (1.5, 0.0, 0.2)
"""The resting point, in the world."""

_STILL: Vec3 = (0.0, 0.0, 0.0)
_EYE: Vec3 = (0.0, 0.0, REST_M[2])
_AHEAD: Angles2 = (0.0, 0.0)
_SALIENCE = 0.2
"""Salience of idle targets."""
_SPREAD = 0.6
"""Standard deviation of all durations divided by their mean."""
_SHORTEST_S = 0.25  # a shift of gaze with its fixation; people make at most 3 to 4 per second
_ROUNDING_DEG = 1e-6

_COAST_S = 0.2
"""Longest time for which a target is assumed to continue with its last velocity without images."""
SEARCH_S = 3.0
"""Duration of the search for a lost target."""
_SEARCH_FIXATION_S = 0.6
_SEARCH_DEG = 15.0
"""Mean size of the shifts of a search, which varies by up to a third."""
_SEARCH_SPREAD_DEG = 8.0
_LEAVING_DEG_S = 4.0
"""A target slower than this is not considered to have left to a side."""

_REST_S, _GLANCE_S = 1.0, 0.8
"""Mean time of a rest straight ahead between series of glances, and of a glance."""
_ASIDE_S, _STAYS_ASIDE_S = (2.5, 4.0), (1.2, 1.6)
"""Range of the time between looks as far to one side as the reach, and of their duration."""
_FIRST_REST_S = 0.6
"""Time at the start after which the head looks about, as nobody is ahead."""
_AGAIN = 0.9
"""Share of glances that are followed by another one without a rest."""
_GLANCE_DEG, _LEAST_DEG = 13.0, 2.0
"""Mean and smallest size of the shift of gaze to a glance."""
_TRIES = 12
_UPRIGHT = 0.5
"""Size of shifts up or down as a share of those to the side."""
_THING_SHARE = 0.7
"""Share of glances at a thing in view or seen within this time, if there is one."""
_THING_MEMORY_S = 20.0
_THING_HOLDS = 1.6
"""Duration of a glance at a thing divided by that of a glance at a point of the room."""
_PLACES = 16
"""Largest number of remembered things."""


@dataclass(frozen=True)
class IdleParams:
    """Reach of the gaze without a target, and the time before it looks for one."""

    # fmt: off
    reach_deg: Annotated[float, Bounds(5, 180),
        "farthest search direction to the side; a lost target is followed one step farther; glances stay within 6/7 of it "
        "and within 30 deg"] = 70.0
    explores: Annotated[bool,
        "search for a lost target, and glance around while there is none; otherwise the gaze rests straight ahead"] = True
    hold_ms: Annotated[float, Bounds(0, 60000), "time for which the gaze stays at the position of a lost target"] = 1000.0
    # fmt: on

    @property
    def glance_deg(self) -> Angles2:
        """Return the largest angles of a glance to the side, and up or down.

        The former is also the largest size of its shift; the middle is more frequent.
        """
        return min(30.0, self.reach_deg * 6.0 / 7.0), min(12.0, self.reach_deg * 9.0 / 28.0)


class Idle:
    """Idle gaze: the target when attention has none.

    params: the present parameters
    """

    def __init__(self, params: IdleParams, rng: np.random.Generator) -> None:
        self._rng = rng
        self.params = params
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Forget the last target."""
        self._t_s = t_s
        self._last: Target | None = None
        self._lost = False
        self._now = _idle_target("rest", -1, REST_M, t_s, "no one in sight")
        self._until_s = self._search_until_s = t_s
        self._count = 0
        self._side, self._aside_s = -1.0, t_s
        self._gone: Target | None = None
        self._seen: dict[int, tuple[Vec3, float]] = {}
        self._in_view: frozenset[int] = frozenset()

    def retune(self, params: IdleParams) -> None:
        """Change the parameters, from the next phase on."""
        changed, self.params = params.explores != self.params.explores, params
        if changed and not self._now.is_lost:
            self._start_rest(self._t_s)

    def remember(self, target: Target) -> None:
        """Record a target that is visible."""
        self._last, self._lost = target, False
        if target.id >= 0:
            self._remember_place(target.id, target.p_world_m, target.at_s)

    def record_seen(self, places: Mapping[int, Vec3], t_s: float) -> None:
        """Record the bodies in view by their ids, salient or not."""
        self._in_view = frozenset(places)
        for id, place in places.items():
            self._remember_place(id, place, t_s)

    def forget_places(self) -> None:
        """Forget the bodies in view, as the scene has changed."""
        self._seen, self._in_view = {}, frozenset()

    def _remember_place(self, id: int, place: Vec3, t_s: float) -> None:
        self._seen.pop(id, None)
        self._seen[id] = place, t_s
        if len(self._seen) > _PLACES:
            del self._seen[next(iter(self._seen))]

    def step(self, t_s: float, blind: bool = True) -> Target:
        """Return the target while nothing is visible: wait, search, rest or glance.

        blind: no images arrive, and a lost target may have moved on; otherwise it has left the
            image or is hidden near its last position
        """
        self._t_s = t_s
        if not self._lost:
            self._start_waiting(t_s, blind)
        while t_s >= self._until_s:
            self._start_next_phase(self._until_s)
        return self._now

    def _start_waiting(self, t_s: float, blind: bool) -> None:
        """Start to wait for a lost target, at its last or extrapolated position."""
        self._lost = True
        gone, self._last = self._last, None
        if gone is None or gone.id in self._in_view:  # a still thing in view is not lost
            self._start_rest(t_s)
            return
        coast_s = min(max(0.0, t_s - gone.at_s), _COAST_S) if blind else 0.0
        there = self._reachable(add(gone.p_world_m, scale(gone.v_world_m_s, coast_s)))
        self._now = replace(
            gone,
            p_world_m=there,
            v_world_m_s=_STILL,
            at_s=t_s,
            why="lost, waiting",
            centre_world_m=None,
            is_lost=True,
        )
        self._gone = replace(gone, p_world_m=there)
        self._until_s = t_s + self.params.hold_ms / 1e3
        self._search_until_s = self._until_s + SEARCH_S
        self._aside_s = self._search_until_s + _ASIDE_S[0]

    def _start_next_phase(self, t_s: float) -> None:
        """Start the next phase at ``t_s``, when the duration of the last one is over."""
        if not self.params.explores:
            self._start_rest(t_s)
        elif self._gone is not None and t_s < self._search_until_s:
            self._search(self._gone, t_s)
        elif self._is_far_aside():
            self._glance(SEARCH, _AHEAD, t_s)
        elif t_s >= self._aside_s:
            self._look_aside(t_s)
        elif self._now.kind == "rest" or (self._gone is None and self._rng.random() < _AGAIN):
            self._glance("glance", self._yaw_pitch_now(), t_s)
        else:
            self._start_rest(t_s)

    def _start_rest(self, t_s: float) -> None:
        """Start a rest: look straight ahead."""
        self._gone = None
        self._now = _idle_target("rest", -1, REST_M, t_s, "no one in sight")
        rest_s = self._draw_s(_REST_S) if self._count else _FIRST_REST_S
        self._until_s = t_s + rest_s if self.params.explores else inf

    def _search(self, gone: Target, t_s: float) -> None:
        """Start a search fixation: first a step in the direction of the loss, then around."""
        rng, first = self._rng, self._now.kind != SEARCH
        rel = sub(gone.p_world_m, _EYE)
        out = self._heading_yaw_pitch(rel, gone.v_world_m_s)
        share = 1.0 if first else float(rng.uniform(-0.2, 1.2))
        # People keep their heads at about the same height: the search goes sideways.
        spread = 0.0 if first and out != (0.0, 0.0) else radians(_SEARCH_SPREAD_DEG)
        yaw, pitch = yaw_pitch(rel)
        to_yaw = yaw + share * out[0] + spread * float(rng.standard_normal())
        to_pitch = pitch + share * out[1] + 0.3 * spread * float(rng.standard_normal())
        limit = radians(self.params.reach_deg)
        here = self._yaw_pitch_now()[0]
        size = radians(_SEARCH_DEG) * float(rng.uniform(2.0, 4.0)) / 3.0
        step = size if to_yaw >= here else -size
        if abs(here + step) > max(limit, abs(here)):
            step = -step
        place = here + step, min(radians(45.0), max(-radians(45.0), to_pitch))
        self._look(SEARCH, place, norm(rel), t_s, f"looking for {body_name(gone.kind, gone.id)}")
        until_s = t_s + self._draw_s(_SEARCH_FIXATION_S)
        self._until_s = min(until_s, max(self._search_until_s, t_s + _SHORTEST_S))

    def _reachable(self, point: Vec3) -> Vec3:
        """Return a point, moved to at most one step beyond the range to the side."""
        rel = sub(point, _EYE)
        (yaw, pitch), most = yaw_pitch(rel), radians(self.params.reach_deg + _SEARCH_DEG)
        if abs(yaw) <= most:
            return point
        return add(_EYE, scale(direction((most if yaw > 0.0 else -most, pitch)), norm(rel)))

    def _yaw_pitch_now(self) -> Angles2:
        return yaw_pitch(sub(self._now.p_world_m, _EYE))

    def _is_far_aside(self) -> bool:
        """Return whether a search or a look at a thing has ended far from straight ahead."""
        most_deg = _SEARCH_DEG if self._gone else self.params.glance_deg[0] + _ROUNDING_DEG
        aside_deg = abs(degrees(self._yaw_pitch_now()[0]))
        return self._now.kind in (SEARCH, "glance") and aside_deg > most_deg

    def _look_aside(self, t_s: float) -> None:
        """Look far to the other side."""
        self._side = -self._side
        place = self._side * radians(self.params.reach_deg), 0.0
        self._look(SEARCH, place, REST_M[0], t_s, "looking about, no one in sight")
        self._until_s = t_s + float(self._rng.uniform(*_STAYS_ASIDE_S))
        self._aside_s = self._until_s + float(self._rng.uniform(*_ASIDE_S))

    def _heading_yaw_pitch(self, rel: Vec3, v_world_m_s: Vec3) -> Angles2:
        """Return the yaw and pitch from the loss towards its heading; 0 for a target at rest."""
        soon = yaw_pitch(add(rel, scale(v_world_m_s, 0.05)))
        now = yaw_pitch(rel)
        yaw, pitch = wrap(soon[0] - now[0]), soon[1] - now[1]
        size, aside = hypot(yaw, pitch), radians(min(18.0, self.params.reach_deg / 2.0))
        if size / 0.05 < radians(_LEAVING_DEG_S):
            return (0.0, 0.0)
        return yaw / size * aside, pitch / size * aside

    def _glance(self, kind: str, here: Angles2, t_s: float) -> None:
        """Start a glance from a point at something in view, or at a plausible point of the room."""
        rng, glance_s = self._rng, self._draw_s(_GLANCE_S)
        things = self._other_places(here, t_s) if rng.random() < _THING_SHARE else []
        if things:
            rel = sub(things[int(rng.integers(len(things)))], _EYE)
            self._look(kind, yaw_pitch(rel), norm(rel), t_s, "looking at things in view")
            glance_s *= _THING_HOLDS
        else:
            place = self._draw_glance_point(here)
            self._look(kind, place, REST_M[0], t_s, "glancing around, no one in sight")
        self._until_s = t_s + glance_s

    def _other_places(self, here: Angles2, t_s: float) -> list[Vec3]:
        """Return the places of things within reach and one shift, except the present target."""
        most, far = radians(self.params.reach_deg), radians(self.params.glance_deg[0])
        least, way = radians(_LEAST_DEG), direction(here)
        return [
            place
            for place, at_s in self._seen.values()
            if t_s - at_s <= _THING_MEMORY_S
            and abs(yaw_pitch(sub(place, _EYE))[0]) <= most
            and least < angle_between(sub(place, _EYE), way) <= far
        ]

    def _draw_glance_point(self, here: Angles2) -> Angles2:
        """Draw the next point, by the size of shifts and the preference for the middle."""
        rng, (wide, high) = self._rng, self.params.glance_deg
        yaw, pitch = degrees(here[0]), degrees(here[1])
        far = _eccentricity_cost(yaw / wide, pitch / high)
        for _ in range(_TRIES):
            size = _LEAST_DEG + (_GLANCE_DEG - _LEAST_DEG) * float(rng.standard_exponential())
            turn = 2.0 * pi * float(rng.random())
            to_yaw = yaw + size * cos(turn)
            to_pitch = pitch + _UPRIGHT * size * sin(turn)
            if max(size, abs(to_yaw)) > wide or abs(to_pitch) > high:
                continue
            odds = exp(min(0.0, far - _eccentricity_cost(to_yaw / wide, to_pitch / high)))
            if rng.random() < odds and hypot(to_yaw - yaw, to_pitch - pitch) >= _LEAST_DEG:
                return radians(to_yaw), radians(to_pitch)
        return _AHEAD

    def _look(self, kind: str, place: Angles2, distance_m: float, t_s: float, why: str) -> None:
        """Set the target of a search or glance, with a new id."""
        self._count += 1
        point = add(_EYE, scale(direction(place), distance_m))
        self._now = _idle_target(kind, -1 - self._count, point, t_s, why)

    def _draw_s(self, mean_s: float) -> float:
        """Draw a log-normal duration with a mean and the common spread, 0.25 s at least."""
        return max(draw_lognormal(self._rng, mean_s, _SPREAD), _SHORTEST_S)


def _idle_target(kind: str, id: int, p_world_m: Vec3, t_s: float, why: str) -> Target:
    return Target(p_world_m, _STILL, t_s, kind, id, _SALIENCE, True, None, 0, why)


def _eccentricity_cost(yaw_share: float, pitch_share: float) -> float:
    """Return the negative logarithm of a point's share of looks, 0 in the middle."""
    return 2.0 * (yaw_share * yaw_share + pitch_share * pitch_share)
