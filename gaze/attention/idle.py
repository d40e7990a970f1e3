"""Idle gaze without a target: wait, search, then explore the view.

A person who leaves the frame often returns immediately, and a detector has gaps. So the gaze first
stays. Then it searches in steps: towards the side to which the person left, and around the place of
the loss. From a far side it also returns in such steps. If no person is found it explores: one to
two shifts of gaze per second, as people make in front of a scene, with an occasional rest straight
ahead.

A glance goes to a thing in view, or to a recently seen one, or otherwise to a plausible point.
Shifts are mostly small (Malinov 2000: half below 5 deg, 83 % below 15) and more sideways than up or
down, and people look more at the middle of a scene than at its edges. So a shift is drawn from the
present point and accepted by the odds of its end point.

Search points have the kind "search", glances the kind "glance". Each has its own id, -2 - n for the
n-th since the reset, counted over both kinds: a shift is counted when kind or id changes, so every
glance is a shift of gaze. The resting point is "rest" with id -1. Directions are seen from a point
above the neck base at the resting height.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, degrees, exp, hypot, inf, log, pi, radians, sin, sqrt
from typing import Annotated

import numpy as np

from gazerig.gaze.angles import add, angle_between, direction, norm, scale, sub, wrap, yaw_pitch
from gazerig.gaze.types import SEARCH, Angles2, Target, Vec3, body_name
from gazerig.params import Bounds

_STILL: Vec3 = (0.0, 0.0, 0.0)
_AHEAD: Angles2 = (0.0, 0.0)
_TRIES = 12
_THING_HOLDS = 1.6
"""Duration of a glance at a thing divided by that of a glance at a point of the room."""
_PLACES = 16
"""Largest number of remembered things."""
_UPRIGHT = 0.5
"""Size of shifts up or down as a share of those to the side."""
_ROUNDING_DEG = 1e-6
_SHORTEST_S = 0.25  # a shift of gaze with its fixation; people make at most 3 to 4 per second


@dataclass(frozen=True)
class IdleParams:
    """Durations, ranges and the resting point."""

    # fmt: off
    hold_ms: Annotated[float, Bounds(0, 60000), "time for which the gaze stays at the position of a lost target"] = 1000.0
    rest_distance_m: Annotated[float, Bounds(0.3, 20), "distance of the resting point"] = 1.5
    rest_height_m: Annotated[float, Bounds(-1, 3), "height of the resting point above the neck base"] = 0.2
    rest_salience: Annotated[float, Bounds(0, 10), "salience of the resting point"] = 0.2
    explores: Annotated[bool, "glance around while there is no target; otherwise the gaze rests straight ahead"] = True
    coast_ms: Annotated[float, Bounds(0, 2000),
        "longest time for which a target is assumed to continue with its last velocity without new images"] = 200.0
    search_ms: Annotated[float, Bounds(0, 60000), "duration of the search for a lost target after that; 0: no search"] = 3000.0
    search_fixation_ms: Annotated[float, Bounds(100, 10000), "mean duration of one fixation of the search"] = 600.0
    search_aside_deg: Annotated[float, Bounds(0, 90), "how far the search goes towards the side to which the target left"] = 18.0
    search_step_deg: Annotated[float, Bounds(1, 90),
        "mean size of the shifts of a search, and of those back from a far side; each varies by up to a third"] = 15.0
    search_spread_deg: Annotated[float, Bounds(0, 45), "standard deviation of the search points, horizontally"] = 8.0
    leaving_deg_s: Annotated[float, Bounds(0.1, 100), "a target slower than this is not considered to have left to a side"] = 4.0
    reach_deg: Annotated[float, Bounds(5, 180),
        "farthest search direction to the side; a lost target is followed one step farther"] = 70.0
    rest_ms: Annotated[float, Bounds(200, 600_000), "mean time of a rest straight ahead between series of glances"] = 1500.0
    glance_ms: Annotated[float, Bounds(200, 60000), "mean time of a glance"] = 900.0
    spread: Annotated[float, Bounds(0, 3), "standard deviation of all these durations divided by their mean"] = 0.6
    again_share: Annotated[float, Bounds(0, 0.98), "share of glances that are followed by another one without a rest"] = 0.9
    glance_step_deg: Annotated[float, Bounds(0.5, 90), "mean size of the shift of gaze to a glance"] = 13.0
    glance_least_deg: Annotated[float, Bounds(0, 90), "smallest size of such a shift"] = 2.0
    glance_yaw_deg: Annotated[float, Bounds(0, 90),
        "largest angle of a glance to the side, and of its shift; the middle is more frequent"] = 30.0
    glance_pitch_deg: Annotated[float, Bounds(0, 60), "largest angle of a glance up or down"] = 12.0
    thing_share: Annotated[float, Bounds(0, 1), "share of glances at a thing in view or seen recently, if there is one"] = 0.5
    thing_memory_s: Annotated[float, Bounds(0, 3600), "time for which a place where something was seen gets glances"] = 20.0
    # fmt: on

    def __post_init__(self) -> None:
        """Check the range of the glances.

        Raises:
            ValueError: the nearest glance is beyond the farthest.
        """
        if self.glance_least_deg > self.glance_yaw_deg:
            raise ValueError("glance_least_deg must not be above glance_yaw_deg")


class Idle:
    """Idle gaze: the target when attention has none."""

    def __init__(self, params: IdleParams, rng: np.random.Generator | None = None) -> None:
        self._rng = rng
        self._set_params(params)
        self.reset(0.0)

    def _set_params(self, params: IdleParams) -> None:
        self._params = params
        self._eye: Vec3 = (0.0, 0.0, params.rest_height_m)
        self._rest: Vec3 = (params.rest_distance_m, 0.0, params.rest_height_m)

    def reset(self, t_s: float) -> None:
        """Forget the last target."""
        self._t_s = t_s
        self._last: Target | None = None
        self._lost = False
        self._now = self._rest_target(t_s)
        self._until_s = self._search_until_s = t_s
        self._count = 0
        self._gone: Target | None = None
        self._seen: dict[int, tuple[Vec3, float]] = {}
        self._in_view: frozenset[int] = frozenset()

    def retune(self, params: IdleParams) -> None:
        """Change durations and ranges; the present phase continues, its duration scaled."""
        before = self._params
        self._set_params(params)
        since_s, left_s = self._now.at_s, self._until_s - self._now.at_s
        if self._now.kind == "rest":
            self._now = self._rest_target(since_s)
            left_s *= params.rest_ms / before.rest_ms
        elif self._now.kind == "glance":
            left_s *= params.glance_ms / before.glance_ms
        elif self._now.kind != SEARCH:
            # The wait for a lost target.
            left_s += (params.hold_ms - before.hold_ms) / 1e3
            self._search_until_s = since_s + left_s + params.search_ms / 1e3
        if params.explores != before.explores and self._now.kind in ("rest", "glance"):
            self._start_rest(self._t_s)
            left_s = self._until_s - since_s
        if self._lost:  # otherwise the phase before this target has expired
            self._until_s = max(since_s + left_s, self._t_s)

    def remember(self, target: Target) -> None:
        """Record a target that is visible."""
        self._last, self._lost = target, False
        if target.id >= 0:
            self._remember_place(target.id, target.p_world_m, target.at_s)

    def record_seen(self, ids: Sequence[int], p_world_m: Sequence[Vec3], t_s: float) -> None:
        """Record the bodies in view, salient or not."""
        self._in_view = frozenset(ids)
        for id, place in zip(ids, p_world_m, strict=True):
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
        gone, par = self._last, self._params
        self._gone, self._last = gone, None
        self._until_s = self._search_until_s = t_s
        if gone is None or gone.id in self._in_view:  # a still thing in view is not lost
            self._start_rest(t_s)
            return
        coast_s = min(max(0.0, t_s - gone.at_s), par.coast_ms / 1e3) if blind else 0.0
        there = self._reachable(add(gone.p_world_m, scale(gone.v_world_m_s, coast_s)))
        self._now = gone._replace(
            p_world_m=there,
            v_world_m_s=_STILL,
            at_s=t_s,
            why="lost, waiting",
            centre_world_m=None,
            is_lost=True,
        )
        self._gone = gone._replace(p_world_m=there)
        self._until_s = t_s + par.hold_ms / 1e3
        self._search_until_s = self._until_s + par.search_ms / 1e3

    def _start_next_phase(self, t_s: float) -> None:
        """Start the next phase at ``t_s``, when the duration of the last one is over."""
        if self._rng is None:
            self._now, self._until_s = self._rest_target(t_s), float("inf")
        elif self._gone is not None and t_s < self._search_until_s:
            self._search(self._gone, t_s, self._rng)
        elif self._is_far_aside():
            self._look_back(t_s, self._rng)
        elif self._now.kind == "rest" or (
            self._now.kind == "glance" and self._rng.random() < self._params.again_share
        ):
            self._glance(t_s, self._rng)
        else:
            self._start_rest(t_s)

    def _start_rest(self, t_s: float) -> None:
        """Start a rest: look straight ahead."""
        self._gone = None
        self._now = self._rest_target(t_s)
        self._until_s = float("inf")
        if self._rng is not None and self._params.explores:
            self._until_s = t_s + self._time_s(self._params.rest_ms, self._rng)

    def _search(self, gone: Target, t_s: float, rng: np.random.Generator) -> None:
        """Start a search fixation: first a step in the direction of the loss, then around."""
        par, first = self._params, self._now.kind != SEARCH
        rel = sub(gone.p_world_m, self._eye)
        out = self._heading_yaw_pitch(rel, gone.v_world_m_s)
        share = 1.0 if first else float(rng.uniform(-0.2, 1.2))
        # People keep their heads at about the same height: the search goes sideways.
        spread = 0.0 if first and out != (0.0, 0.0) else radians(par.search_spread_deg)
        yaw, pitch = yaw_pitch(rel)
        to_yaw = yaw + share * out[0] + spread * float(rng.standard_normal())
        to_pitch = pitch + share * out[1] + 0.3 * spread * float(rng.standard_normal())
        limit = radians(par.reach_deg)
        here = yaw_pitch(sub(self._now.p_world_m, self._eye))[0]
        step = self._step_rad(rng) * (1.0 if to_yaw >= here else -1.0)
        if abs(here + step) > max(limit, abs(here)):
            step = -step
        place = (
            here + step,
            min(radians(45.0), max(-radians(45.0), to_pitch)),
        )
        self._look(SEARCH, place, norm(rel), t_s, f"looking for {body_name(gone.kind, gone.id)}")
        until_s = t_s + self._time_s(par.search_fixation_ms, rng)
        self._until_s = min(until_s, max(self._search_until_s, t_s + _SHORTEST_S))

    def _reachable(self, point: Vec3) -> Vec3:
        """Return a point, moved to at most one step beyond the range to the side."""
        rel, par = sub(point, self._eye), self._params
        (yaw, pitch), most = yaw_pitch(rel), radians(par.reach_deg + par.search_step_deg)
        if abs(yaw) <= most:
            return point
        return add(self._eye, scale(direction((most if yaw > 0.0 else -most, pitch)), norm(rel)))

    def _step_rad(self, rng: np.random.Generator) -> float:
        """Draw the size of a step of the search, or of one back."""
        return radians(self._params.search_step_deg) * float(rng.uniform(2.0, 4.0)) / 3.0

    def _is_far_aside(self) -> bool:
        """Return whether a search or a look at a thing has ended far from straight ahead."""
        par, yaw = self._params, yaw_pitch(sub(self._now.p_world_m, self._eye))[0]
        most = {SEARCH: par.search_step_deg, "glance": par.glance_yaw_deg + _ROUNDING_DEG}
        return abs(degrees(yaw)) > most.get(self._now.kind, inf)

    def _look_back(self, t_s: float, rng: np.random.Generator) -> None:
        """Take a step back from a far side."""
        par, (yaw, pitch) = self._params, yaw_pitch(sub(self._now.p_world_m, self._eye))
        back = self._step_rad(rng) * (-1.0 if yaw > 0.0 else 1.0)
        place = yaw + back, 0.5 * pitch
        self._look(SEARCH, place, par.rest_distance_m, t_s, "looking back from the side")
        self._until_s = t_s + self._time_s(par.search_fixation_ms, rng)

    def _heading_yaw_pitch(self, rel: Vec3, v_world_m_s: Vec3) -> Angles2:
        """Return the yaw and pitch from the loss towards its heading; 0 for a target at rest."""
        soon = yaw_pitch(add(rel, scale(v_world_m_s, 0.05)))
        now = yaw_pitch(rel)
        yaw, pitch = wrap(soon[0] - now[0]), soon[1] - now[1]
        size, par = hypot(yaw, pitch), self._params
        if size / 0.05 < radians(par.leaving_deg_s):
            return (0.0, 0.0)
        return (
            yaw / size * radians(par.search_aside_deg),
            pitch / size * radians(par.search_aside_deg),
        )

    def _glance(self, t_s: float, rng: np.random.Generator) -> None:
        """Start a glance at something in view, or at a plausible point of the room."""
        par = self._params
        self._until_s = t_s + self._time_s(par.glance_ms, rng)
        here = yaw_pitch(sub(self._now.p_world_m, self._eye))
        things = self._other_places(here, t_s) if rng.random() < par.thing_share else []
        if things:
            rel = sub(things[int(rng.integers(len(things)))], self._eye)
            self._look("glance", yaw_pitch(rel), norm(rel), t_s, "looking at things in view")
            self._until_s = t_s + _THING_HOLDS * (self._until_s - t_s)
            return
        place = self._draw_glance_point(here, rng)
        self._look("glance", place, par.rest_distance_m, t_s, "glancing around, no one in sight")

    def _other_places(self, here: Angles2, t_s: float) -> list[Vec3]:
        """Return the places of things within reach and one shift, except the present target."""
        par, way = self._params, direction(here)
        self._seen = {
            id: (place, at_s)
            for id, (place, at_s) in self._seen.items()
            if t_s - at_s <= par.thing_memory_s
        }
        most, least = radians(par.reach_deg), radians(par.glance_least_deg)
        far = radians(par.glance_yaw_deg)
        return [
            place
            for place, _ in self._seen.values()
            if abs(yaw_pitch(sub(place, self._eye))[0]) <= most
            and least < angle_between(sub(place, self._eye), way) <= far
        ]

    def _draw_glance_point(self, here: Angles2, rng: np.random.Generator) -> Angles2:
        """Draw the next point, by the size of shifts and the preference for the middle."""
        par = self._params
        wide, high = max(par.glance_yaw_deg, 1e-3), max(par.glance_pitch_deg, 1e-3)
        yaw, pitch = degrees(here[0]), degrees(here[1])
        far = _eccentricity_cost(yaw / wide, pitch / high)
        for _ in range(_TRIES):
            more = max(0.0, par.glance_step_deg - par.glance_least_deg)
            size = par.glance_least_deg + more * float(rng.standard_exponential())
            turn = 2.0 * pi * float(rng.random())
            to_yaw = yaw + size * cos(turn)
            to_pitch = pitch + _UPRIGHT * size * sin(turn)
            if max(size, abs(to_yaw)) > wide or abs(to_pitch) > high:
                continue
            odds = exp(min(0.0, far - _eccentricity_cost(to_yaw / wide, to_pitch / high)))
            if rng.random() < odds and hypot(to_yaw - yaw, to_pitch - pitch) >= min(
                par.glance_least_deg, wide
            ):
                return radians(to_yaw), radians(to_pitch)
        return _AHEAD

    def _look(self, kind: str, place: Angles2, distance_m: float, t_s: float, why: str) -> None:
        """Set the target of a search or glance, with a new id."""
        self._count += 1
        point = add(self._eye, scale(direction(place), distance_m))
        salience, name = self._params.rest_salience, -1 - self._count
        self._now = Target(point, _STILL, t_s, kind, name, salience, True, None, 0, why)

    def _rest_target(self, t_s: float) -> Target:
        salience = self._params.rest_salience
        return Target(
            self._rest, _STILL, t_s, "rest", -1, salience, True, None, 0, "no one in sight"
        )

    def _time_s(self, mean_ms: float, rng: np.random.Generator) -> float:
        """Draw a log-normal duration with a mean and the common spread, 0.25 s at least."""
        sigma2 = log(1.0 + self._params.spread**2)
        drawn = mean_ms / 1e3 * exp(sqrt(sigma2) * float(rng.standard_normal()) - 0.5 * sigma2)
        return max(drawn, _SHORTEST_S)


def _eccentricity_cost(yaw_share: float, pitch_share: float) -> float:
    """Return the negative logarithm of a point's share of looks, 0 in the middle."""
    return 2.0 * (yaw_share * yaw_share + pitch_share * pitch_share)
