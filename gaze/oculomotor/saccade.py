"""Saccade profiles: the angle covered as a function of the time since onset.

Three profiles with one interface. ``human`` has the duration, the peak speed and the early peak of
human saccades. ``min_jerk`` is eqs 2-6 of Mitake et al., minimum jerk with a cap on the speed.
``literal_frame`` is the rule of Nakamoto & Tsuruno 3.3, 0.8 of the distance in each frame. All are
closed forms of the time: a late tick lands on the curve instead of stretching it. Radians and
seconds inside; parameters in degrees.
"""

from dataclasses import dataclass
from math import degrees, exp, log, radians, sqrt
from typing import Annotated, Literal, Protocol

from gazerig.gaze.minimum_jerk import PEAK_SPEED, min_jerk
from gazerig.params import Bounds

_FLANK_PEAK_ACCELERATION = 1.5396
"""Highest acceleration of half a minimum-jerk movement, times its time, over its speed."""
_HURRY = 0.75
"""Shortest rise divided by that in which the servos reach people's peak speed at their
acceleration.
"""
_BASE_S, _PER_DEG_S = 0.025, 0.0025
"""Duration of people's saccades at amplitude 0, and its increase with amplitude."""
_PEAK_DEG_S, _PEAK_SCALE_DEG = 530.0, 11.0
"""V and A0 of their peak speed, V (1 - exp(-A / A0))."""
_SHORTEST_S = 0.05
"""T of eqs 2-6."""
_FRAME_SHARE, _FRAME_S = 0.8, 0.0111
"""Share of the remaining distance per frame (3.3); the authors' display showed 90 a second."""
_FRAME_RATE_1_S = -log(1.0 - _FRAME_SHARE) / _FRAME_S
_LITERAL_REST_RAD = radians(0.05)
"""Remaining distance at which a saccade of the 0.8-per-frame rule counts as landed."""


@dataclass(frozen=True)
class SaccadeParams:
    """Profile, speed cap L, and what the eye servos follow."""

    # fmt: off
    profile: Annotated[Literal["human", "min_jerk", "literal_frame"],
        "velocity profile of a saccade: human duration and peak speed, minimum jerk (eqs 2-6), or a "
        "fixed share of the distance per frame"] = "human"
    max_speed_deg_s: Annotated[float, Bounds(10, 1000), "fastest eye speed L; the paper's 8.7266 rad/s is 500 deg/s"] = 500.0
    max_acceleration_deg_s2: Annotated[float, Bounds(100, 200_000),
        "highest acceleration that the eye servos follow; human saccades that need more take longer"] = 44000.0
    # fmt: on


class SaccadeProfile(Protocol):
    """The interface of the saccade profiles; amplitudes and angles in radians."""

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time from onset to landing."""
        ...

    def displacement_rad(self, amplitude_rad: float, t_s: float) -> float:
        """Return the angle covered ``t_s`` after onset."""
        ...


class MinJerkProfile:
    """Minimum jerk with a cap on the speed (Mitake et al., eqs 2-6)."""

    def __init__(self, max_speed_rad_s: float, shortest_s: float) -> None:
        self._L = max_speed_rad_s
        self._T = shortest_s
        # Eq 3, A' = L / f'(0.5 T), where the paper misprints T' for f': f'(0.5 T) = 1.875 / T.
        self.largest_uncapped_rad = self._L * self._T / PEAK_SPEED

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time from onset to landing."""
        return self._T + self._cruise_s(amplitude_rad)

    def displacement_rad(self, amplitude_rad: float, t_s: float) -> float:
        """Return the angle covered ``t_s`` after onset (eqs 5 and 6)."""
        T, A = self._T, amplitude_rad
        cruise = self._cruise_s(A)
        if cruise == 0.0:
            return A * min_jerk(t_s / T)
        uncapped = self.largest_uncapped_rad
        if t_s < 0.5 * T:
            return uncapped * min_jerk(t_s / T)
        if t_s < 0.5 * T + cruise:
            return self._L * t_s + 0.5 * uncapped - 0.5 * self._L * T
        return uncapped * min_jerk((t_s - cruise) / T) + A - uncapped

    def _cruise_s(self, amplitude_rad: float) -> float:
        """Return the time at full speed, (A - A') / L; eq 4's t_f is 0.5 T later."""
        return max(0.0, (amplitude_rad - self.largest_uncapped_rad) / self._L)


class HumanProfile:
    """Duration, peak speed and skew of human saccades; speed and acceleration capped.

    The duration is 25 ms + 2.5 ms A and the peak speed 530 deg/s (1 - exp(-A / 11 deg)), as one
    source measured them.

    The speed rises like the first half of a minimum-jerk movement, stays at its peak for a while,
    and falls like the second half. The rise has .25 of the time of rise and fall up to 10 deg and
    .11 from 38 deg on; the time at the peak follows from the ratio of peak to mean speed. A shaft
    lags most while it accelerates: on it the middle of the peak is at .45 of a saccade of 10 deg
    and at .39 of one of 20, as in people (Collewijn et al. 1988). Such a short rise makes a saccade
    of 20 deg a tenth longer. Servos that would lose more than that have a longer rise, at most .38
    and .14 of that time.
    """

    def __init__(self, max_speed_rad_s: float, most_rad_s2: float) -> None:
        self._L, self._most_rad_s2 = max_speed_rad_s, most_rad_s2

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time from onset to landing, no shorter than the servos allow."""
        return self._shape(amplitude_rad)[0]

    def displacement_rad(self, amplitude_rad: float, t_s: float) -> float:
        """Return the angle covered ``t_s`` after onset."""
        if t_s <= 0.0 or amplitude_rad <= 0.0:
            return 0.0
        D, V, rise, flanks = self._shape(amplitude_rad)
        if t_s >= D:
            return amplitude_rad
        cruise_ends = rise + D - flanks
        if t_s < rise:
            return _flank(V, rise, t_s)
        if t_s < cruise_ends:
            return _flank(V, rise, rise) + V * (t_s - rise)
        return amplitude_rad - _flank(V, flanks - rise, D - t_s)

    def _shape(self, amplitude_rad: float) -> tuple[float, float, float, float]:
        """Return duration, peak speed, time of the rise, and of rise and fall together."""
        A, most = amplitude_rad, self._most_rad_s2
        D = _BASE_S + _PER_DEG_S * degrees(A)
        if A <= 0.0:
            return D, 0.0, 0.5 * D, D
        peak = radians(_PEAK_DEG_S) * (1.0 - exp(-degrees(A) / _PEAK_SCALE_DEG))
        share = self._rise_share(A, peak, D)
        # A = V (flanks / 1.875 + cruise), flanks + cruise = D. Without a cruise, the speed at the
        # highest acceleration:
        reached = sqrt(PEAK_SPEED * A * most * share / _FLANK_PEAK_ACCELERATION)
        V = min(peak, self._L, reached)
        # Limited speed or acceleration needs more time than people's saccades.
        shortest = _FLANK_PEAK_ACCELERATION * V / (most * share)
        D = max(D, A / V + shortest * (1.0 - 1.0 / PEAK_SPEED))
        V = min(V, PEAK_SPEED * A / D)
        flanks = (V * D - A) / (V * (1.0 - 1.0 / PEAK_SPEED))
        return D, V, flanks * share, flanks

    def _rise_share(self, amplitude_rad: float, peak_rad_s: float, duration_s: float) -> float:
        over = min(1.0, max(0.0, (degrees(amplitude_rad) - 10.0) / 28.0))
        flanks = (peak_rad_s * duration_s - amplitude_rad) / (1.0 - 1.0 / PEAK_SPEED)
        if flanks <= 0.0:
            return 0.38 - 0.24 * over
        needed = _FLANK_PEAK_ACCELERATION * peak_rad_s * peak_rad_s / (self._most_rad_s2 * flanks)
        return min(0.38 - 0.24 * over, max(0.25 - 0.14 * over, _HURRY * needed))


def _flank(peak_rad_s: float, length_s: float, t_s: float) -> float:
    """Return the angle covered ``t_s`` into half a minimum-jerk movement of that peak speed."""
    whole = 2.0 * length_s
    return peak_rad_s * whole / PEAK_SPEED * min_jerk(t_s / whole) if whole > 0.0 else 0.0


class LiteralFrameProfile:
    """0.8 of the remaining distance in each frame (Nakamoto & Tsuruno 3.3), at any tick rate.

    The covered share is 1 - 0.2^(t / frame), which is the rule at whole frames. It has no cap.
    """

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time until 0.05 deg remain, one frame at least."""
        ratio = max(1.0, amplitude_rad / _LITERAL_REST_RAD)
        return max(_FRAME_S, log(ratio) / _FRAME_RATE_1_S)

    def displacement_rad(self, amplitude_rad: float, t_s: float) -> float:
        """Return the angle covered ``t_s`` after onset."""
        if t_s <= 0.0:
            return 0.0
        if t_s >= self.duration_s(amplitude_rad):
            return amplitude_rad
        return amplitude_rad * (1.0 - exp(-_FRAME_RATE_1_S * t_s))


class SaccadeModel:
    """The present profile; a saccade in flight keeps its own to its end.

    max_speed_rad_s, max_acceleration_rad_s2: limits of a saccade that is bent in flight
    """

    def __init__(self, params: SaccadeParams) -> None:
        self.retune(params)

    def retune(self, params: SaccadeParams) -> None:
        """Change the profile or its limits, from the next saccade on."""
        self.max_speed_rad_s = radians(params.max_speed_deg_s)
        self.max_acceleration_rad_s2 = radians(params.max_acceleration_deg_s2)
        self.profile: SaccadeProfile
        if params.profile == "human":
            self.profile = HumanProfile(self.max_speed_rad_s, self.max_acceleration_rad_s2)
        elif params.profile == "min_jerk":
            self.profile = MinJerkProfile(self.max_speed_rad_s, _SHORTEST_S)
        else:
            self.profile = LiteralFrameProfile()
