"""Gaze aversion: looking away from a face while talking, listening and thinking.

A gaze that never leaves a face is a stare. Therefore it alternates between MUTUAL, on the face, and
AWAY, next to it. Durations, amplitudes and directions are those that Lee, Badler & Badler 2002
(Eyes Alive) measured in talking and listening people; while thinking the gaze goes mostly up, for
longer (Andrist et al. 2014). Without a conversation two people who face each other prefer periods
of mutual gaze of 3.3 s (Binetti et al. 2016, n = 498); no measurement of the aversions between them
is known, a listener's short ones are used.

In reported turns shares, rates and directions are those of 19 people in
remote talk (Dembinsky et al. 2024, medians): speaking .45 of the time averted, 13.5 times a minute;
listening .04, 3.2 times; three quarters of the looks go aside, most others up.

An aversion starts when the rest on a part of the face is over, instead of the next shift between
parts, and goes beyond the outline of the face: a near face is wider than the published angles.
"""

from dataclasses import dataclass
from math import atan2, cos, degrees, exp, hypot, inf, log, radians, sin, sqrt
from typing import Annotated, Literal

import numpy as np

from gazerig.gaze.angles import add, cross, dot, norm, scale, sub, unit
from gazerig.gaze.types import AWAY, Target, Vec3
from gazerig.params import Bounds

AversionMode = Literal["none", "talk", "listen", "think", "speaking", "listening", "thinking"]
MODES: tuple[AversionMode, ...] = ("none", "talk", "listen", "think")
"""Modes that a user can choose; the others are those of reported turns."""
_ROLES = ("speaking", "listening", "thinking")
_TIMES_OF: dict[AversionMode, str] = {
    "none": "silent", "talk": "talk", "listen": "listen", "think": "think",
    "speaking": "speaking", "listening": "listening", "thinking": "think",
}  # fmt: skip
"""Mode -> beginning of the names of its times in ``AversionParams``."""

# Share of gaze shifts, percent, to 0, 45, ... 315 deg; 0 is right, 90 up (Eyes Alive).
DIRECTIONS_PERCENT = (15.54, 6.46, 17.69, 7.44, 16.80, 7.89, 20.38, 7.79)
_UP = 2
_SIDE_SPREAD_DEG = 35.0
"""Largest angle between a role's look away and level, or straight up or down."""
_DRIFT_DEG = 0.75
"""Motion of a person during a look away of a reported turn, which must stay beside the face."""
_MODE_TEXT = {"none": "no conversation"}

_HALF_WIDE_M, _HALF_HIGH_M = 0.085, 0.125
"""Half axes of the oval of a face, a little larger than an adult's."""

# A = -6.9 ln(P / 15.7) deg, P uniform in 0..15 % (Eyes Alive).
_SCALE_DEG, _P_TOP, _P_MOST = 6.9, 15.7, 15.0


@dataclass(frozen=True)
class AversionParams:
    """Durations of mutual gaze and of aversion, and the amplitudes of the latter."""

    # fmt: off
    silent_mutual_s: Annotated[float, Bounds(0, 60),
        "without a conversation: mean time on the face, the median being 3.3 s; 0: never looks away"] = 3.62
    silent_mutual_sd_s: Annotated[float, Bounds(0.1, 60), "without a conversation: standard deviation of the time on the face"] = 1.63
    silent_away_s: Annotated[float, Bounds(0.1, 60), "without a conversation: mean time away"] = 0.60
    silent_away_sd_s: Annotated[float, Bounds(0.1, 60), "without a conversation: standard deviation of the time away"] = 0.30
    talk_mutual_s: Annotated[float, Bounds(0.1, 60), "talking: mean time on the face"] = 3.13
    talk_mutual_sd_s: Annotated[float, Bounds(0.1, 60), "talking: standard deviation of the time on the face"] = 3.16
    talk_away_s: Annotated[float, Bounds(0.1, 60), "talking: mean time away"] = 0.93
    talk_away_sd_s: Annotated[float, Bounds(0.1, 60), "talking: standard deviation of the time away"] = 0.80
    listen_mutual_s: Annotated[float, Bounds(0.1, 60), "listening: mean time on the face"] = 7.92
    listen_mutual_sd_s: Annotated[float, Bounds(0.1, 60), "listening: standard deviation of the time on the face"] = 1.57
    listen_away_s: Annotated[float, Bounds(0.1, 60), "listening: mean time away"] = 0.43
    listen_away_sd_s: Annotated[float, Bounds(0.1, 60), "listening: standard deviation of the time away"] = 0.24
    think_mutual_s: Annotated[float, Bounds(0.1, 60), "thinking: mean time on the face"] = 1.50
    think_mutual_sd_s: Annotated[float, Bounds(0.1, 60), "thinking: standard deviation of the time on the face"] = 0.80
    think_away_s: Annotated[float, Bounds(0.1, 60), "thinking: mean time away"] = 3.54
    think_away_sd_s: Annotated[float, Bounds(0.1, 60), "thinking: standard deviation of the time away"] = 1.26
    longest_mutual_s: Annotated[float, Bounds(0.5, 14.9), "longest time on the face; beyond 15 s it is a stare"] = 14.5
    min_dwell_s: Annotated[float, Bounds(0.05, 2), "shortest time on the face or away, because eyes and servos need time to move"] = 0.2
    least_deg: Annotated[float, Bounds(0, 20),
        "smallest angle of looking away; with 0, as in the published distribution, half of the looks away would still be on the "
        "face"] = 5.0
    beside_deg: Annotated[float, Bounds(0, 20),
        "smallest angle between a look away and the outline of the face, which for a near face is farther out than least_deg"] = 2.0
    talk_most_deg: Annotated[float, Bounds(1, 60), "largest angle of looking away while talking or thinking"] = 27.5
    listen_most_deg: Annotated[float, Bounds(1, 60), "largest angle of looking away while listening or without a conversation"] = 22.7
    speaking_mutual_s: Annotated[float, Bounds(0.1, 60), "reported speech: mean time on the face"] = 3.2
    speaking_mutual_sd_s: Annotated[float, Bounds(0.1, 60), "reported speech: standard deviation of the time on the face"] = 1.6
    speaking_away_s: Annotated[float, Bounds(0.1, 60), "reported speech: mean time away"] = 2.0
    speaking_away_sd_s: Annotated[float, Bounds(0.1, 60), "reported speech: standard deviation of the time away"] = 0.9
    listening_mutual_s: Annotated[float, Bounds(0.1, 60), "reported listening: mean time on the face"] = 14.0
    listening_mutual_sd_s: Annotated[float, Bounds(0.1, 60), "reported listening: standard deviation of the time on the face"] = 3.0
    listening_away_s: Annotated[float, Bounds(0.1, 60), "reported listening: mean time away"] = 0.65
    listening_away_sd_s: Annotated[float, Bounds(0.1, 60), "reported listening: standard deviation of the time away"] = 0.3
    role_least_deg: Annotated[float, Bounds(0, 20), "smallest angle of looking away in reported turns"] = 7.5
    side_share: Annotated[float, Bounds(0, 1), "share of looks away that go aside in reported turns"] = 0.78
    up_share: Annotated[float, Bounds(0, 1), "share of those that go up; the rest goes down"] = 0.15
    think_up_share: Annotated[float, Bounds(0, 1), "share of looks away that go up while thinking; the others go in any direction"] = 0.8
    # fmt: on

    def __post_init__(self) -> None:
        """Check the order of the limits.

        Raises:
            ValueError: the nearest aversion is beyond a farthest one.
        """
        most = min(self.talk_most_deg, self.listen_most_deg)
        for name in ("least_deg", "role_least_deg"):
            if getattr(self, name) > most:
                raise ValueError(f"{name} must not be above talk_most_deg or listen_most_deg")
        if self.side_share + self.up_share > 1.0:
            raise ValueError("side_share and up_share must not be above 1 together")


class Aversion:
    """Semi-Markov process MUTUAL <-> AWAY on faces; other targets pass unchanged."""

    def __init__(self, params: AversionParams, rng: np.random.Generator) -> None:
        self._rng = rng
        self.retune(params)
        self._mode: AversionMode = "none"
        self.reset(0.0)

    def retune(self, params: AversionParams) -> None:
        """Change durations and angles, from the next aversion on."""
        self._params = params
        self._times = {mode: _times_s(params, of) for mode, of in _TIMES_OF.items()}

    def reset(self, t_s: float) -> None:
        """Forget the face; the conversation mode stays."""
        self._face: int | None = None
        self._until_s = t_s
        self._away: Vec3 | None = None
        self._away_shift = 0
        self._averts_s: float | None = None
        self._away_s = t_s
        self._shifts = 0
        self._last: tuple[Target, Target] | None = None

    @property
    def mode(self) -> AversionMode:
        """The present conversation mode."""
        return self._mode

    def converse(
        self, mode: AversionMode, t_s: float, averts: bool = False, away_s: float | None = None
    ) -> None:
        """Set the conversation mode: talk, listen, think or none, or that of a reported turn.

        A change returns the gaze to the face. Thinking averts it immediately, as in people.

        mode: the mode
        t_s: present time
        averts: the gaze is averted now, without waiting for the end of a rest on the face; an
            aversion in progress continues
        away_s: duration of that aversion; None: as drawn from the mode's distribution

        Raises:
            ValueError: there is no such mode.
        """
        if mode not in self._times:
            raise ValueError(f"no conversation mode {mode!r}; modes: {', '.join(MODES)}")
        if mode == self._mode and not averts:
            return
        self._mode, self._averts_s = mode, None
        if averts:
            duration_s = self._time_s(*self._times[mode][2:]) if away_s is None else away_s
            if self._away is None:
                self._averts_s, self._until_s = duration_s, t_s
            else:
                self._until_s = t_s + duration_s
            return
        self._return()
        if self._face is not None:
            self._until_s = t_s if mode == "think" else t_s + self._mutual_s()
            if mode in _ROLES:  # the look began in an earlier turn: together they are no stare
                longest_s = self._away_s + self._params.longest_mutual_s
                self._until_s = min(self._until_s, max(t_s, longest_s))

    def keep_face(self, t_s: float, until_s: float) -> None:
        """Return to the face now, and stay there until a time."""
        self._return()
        self._averts_s = None
        if self._face is not None:
            self._until_s = max(until_s, t_s)

    def step(
        self,
        target: Target,
        p_world_head_m: Vec3,
        t_s: float,
        ordered: bool = False,
        rests_until_s: float = -inf,
    ) -> Target:
        """Return the target itself, or a place next to the face during an aversion.

        A place next to a face has kind "away", the id of the face, the face's centre as centre (the
        head stays with the person) and its own shift number, which increases on leaving and on
        returning. An unchanged target includes the shifts of earlier aversions in its count.

        A lost face that the gaze is waiting for gets no aversion.

        ordered: a user has chosen the target, from which only a conversation averts the gaze
        rests_until_s: end of the rest on a part of the face, which the gaze does not leave
            sooner; inf while it is moving there
        """
        kept = (ordered and self._mode == "none") or target.is_lost
        face = target.id if target.kind == "face" and not kept else None
        if face != self._face:
            self._attend(face, t_s)
        if self._until_s == inf and self._times[self._mode][0] > 0.0 and self._face is not None:
            self._until_s = t_s + self._mutual_s()  # aversion is allowed only from now on
        leaves = self._away is not None or t_s >= rests_until_s or self._averts_s is not None
        if self._face is not None and t_s >= self._until_s and leaves:
            self._turn(target, p_world_head_m, t_s)
        if self._away is not None:
            self._away_s = t_s
            centre = _centre_of_target(target)
            if self._mode in _ROLES and self._is_on_face(self._away, centre, p_world_head_m):
                self._avert(target, p_world_head_m)  # the person has moved into the look away
            return self._away_target(target, self._away, t_s)
        if self._shifts == 0:
            return target
        return self._with_shifts(target)

    def _with_shifts(self, target: Target) -> Target:
        """Return a target with the shifts of aversions added, made once for many ticks."""
        last, shift = self._last, target.shift + self._shifts
        if last is None or last[0] is not target or last[1].shift != shift:
            last = self._last = target, target._replace(shift=shift)
        return last[1]

    def _attend(self, face: int | None, t_s: float) -> None:
        """Start mutual gaze with another face; end an aversion if there is no face."""
        self._face, self._away_s = face, t_s
        self._return()
        if face is not None and self._averts_s is None:
            self._until_s = t_s + self._mutual_s()

    def _turn(self, target: Target, p_world_head_m: Vec3, t_s: float) -> None:
        """Switch between face and aversion when the drawn duration is over."""
        if self._away is not None:
            self._return()
            self._until_s = t_s + self._mutual_s()
            return
        self._avert(target, p_world_head_m)
        away_s, self._averts_s = self._averts_s, None
        if away_s is None:
            away_s = self._time_s(*self._times[self._mode][2:])
        self._until_s = t_s + away_s

    def _avert(self, target: Target, p_world_head_m: Vec3) -> None:
        """Look at a new place next to the face."""
        self._away = self._draw_place(_centre_of_target(target), p_world_head_m)
        self._shifts += 1
        self._away_shift = target.shift + self._shifts

    def _return(self) -> None:
        if self._away is not None:
            self._away = None
            self._shifts += 1

    def _away_target(self, target: Target, away: Vec3, t_s: float) -> Target:
        """Return the target of an aversion."""
        return target._replace(
            p_world_m=away,
            v_world_m_s=(0.0, 0.0, 0.0),
            at_s=t_s,
            kind=AWAY,
            top_down=True,
            part=None,
            shift=self._away_shift,
            why=f"looking away from face {target.id} ({_MODE_TEXT.get(self._mode, self._mode)})",
            centre_world_m=_centre_of_target(target),
        )

    def _draw_place(self, face: Vec3, p_world_head_m: Vec3) -> Vec3:
        """Draw a point next to the face, at the distance of the face."""
        rel = sub(face, p_world_head_m)
        ahead, right, up = _axes_to(rel)
        way = radians(self._draw_direction_deg())
        angle = radians(self._angle_deg(face_extent_deg(way, norm(rel))))
        aside = add(scale(right, cos(way)), scale(up, sin(way)))
        looking = add(scale(ahead, cos(angle)), scale(aside, sin(angle)))
        return add(p_world_head_m, scale(looking, norm(rel)))

    def _is_on_face(self, away: Vec3, face: Vec3, p_world_head_m: Vec3) -> bool:
        """Return whether a place is closer to the outline of a face than a look away may be."""
        rel, to_away = sub(face, p_world_head_m), sub(away, p_world_head_m)
        ahead, right, up = _axes_to(rel)
        x, y, z = dot(to_away, ahead), dot(to_away, right), dot(to_away, up)
        edge_deg = face_extent_deg(atan2(z, y), norm(rel))
        return degrees(atan2(hypot(y, z), x)) < edge_deg + self._params.beside_deg - _DRIFT_DEG

    def _angle_deg(self, edge_deg: float) -> float:
        """Draw the amplitude of an aversion past the edge of the face, in degrees."""
        par = self._params
        near = self._mode in ("listen", "listening", "none")
        least, drift = par.least_deg, 0.0
        if self._mode in _ROLES:
            least, drift = par.role_least_deg, _DRIFT_DEG
        least = max(least, edge_deg + par.beside_deg + drift)
        most = max(least, par.listen_most_deg if near else par.talk_most_deg)
        # The law's P, restricted to amplitudes of at least the required one; never 0.
        p_most = min(_P_MOST, _P_TOP * exp(-least / _SCALE_DEG))
        p = (1.0 - float(self._rng.random())) * p_most
        return min(most, -_SCALE_DEG * log(p / _P_TOP))

    def _draw_direction_deg(self) -> float:
        """Draw the direction, 0 right and 90 up: a sector of the table, uniform within it."""
        if self._mode in _ROLES:
            return self._draw_role_direction_deg()
        if self._mode == "think" and self._rng.random() < self._params.think_up_share:
            sector = _UP
        else:
            sector = self._draw_sector()
        return 45.0 * sector + float(self._rng.uniform(-22.5, 22.5))

    def _draw_role_direction_deg(self) -> float:
        """Draw the direction of a reported turn's look away: aside, up or down."""
        par, draw = self._params, float(self._rng.random())
        spread = float(self._rng.uniform(-_SIDE_SPREAD_DEG, _SIDE_SPREAD_DEG))
        if draw < par.side_share:
            return spread + (0.0 if draw < 0.5 * par.side_share else 180.0)
        return spread + (90.0 if draw < par.side_share + par.up_share else 270.0)

    def _draw_sector(self) -> int:
        draw = float(self._rng.random()) * sum(DIRECTIONS_PERCENT)
        for sector, share in enumerate(DIRECTIONS_PERCENT):
            draw -= share
            if draw < 0.0:
                return sector
        return len(DIRECTIONS_PERCENT) - 1  # rounding

    def _mutual_s(self) -> float:
        """Draw a duration of mutual gaze, infinite if the mode has no aversions."""
        mean, sd, _, _ = self._times[self._mode]
        if mean == 0.0:
            return inf
        return min(self._params.longest_mutual_s, self._time_s(mean, sd))

    def _time_s(self, mean_s: float, sd_s: float) -> float:
        """Draw from the log-normal distribution with a given mean and standard deviation."""
        sigma2 = log(1.0 + (sd_s / mean_s) ** 2)
        drawn = mean_s * exp(sqrt(sigma2) * float(self._rng.standard_normal()) - 0.5 * sigma2)
        return max(drawn, self._params.min_dwell_s)


def _times_s(params: AversionParams, of: str) -> tuple[float, float, float, float]:
    """Return mean and standard deviation of the times on the face, and of those away."""
    mutual_s, mutual_sd_s, away_s, away_sd_s = (
        float(getattr(params, f"{of}_{name}"))
        for name in ("mutual_s", "mutual_sd_s", "away_s", "away_sd_s")
    )
    return mutual_s, mutual_sd_s, away_s, away_sd_s


def face_extent_deg(way_rad: float, distance_m: float) -> float:
    """Return the extent of a face from its centre, degrees, in a direction (0 right, pi/2 up)."""
    across, up = cos(way_rad) / _HALF_WIDE_M, sin(way_rad) / _HALF_HIGH_M
    return degrees(atan2(1.0 / hypot(across, up), distance_m))


def _axes_to(rel: Vec3) -> tuple[Vec3, Vec3, Vec3]:
    """Return the unit vectors towards a point, to the right of it, and up."""
    ahead = unit(rel)
    right = unit(cross(ahead, (0.0, 0.0, 1.0)))
    return ahead, right, cross(right, ahead)


def _centre_of_target(target: Target) -> Vec3:
    return target.p_world_m if target.centre_world_m is None else target.centre_world_m
