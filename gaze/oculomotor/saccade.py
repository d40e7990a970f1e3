"""Saccade profiles: the angle covered as a function of the time since onset.

Four profiles with one interface. ``human`` has the duration, the peak speed and the early peak of
human saccades. ``main_sequence`` has one ratio of peak to mean speed instead of a measured peak
speed. ``min_jerk`` is eqs 2-6 of Mitake et al., minimum jerk with a cap on the speed.
``literal_frame`` is the rule of Nakamoto & Tsuruno 3.3, 0.8 of the distance in each frame. All are
closed forms of the time: a late tick lands on the curve instead of stretching it. Radians and
seconds inside; parameters in degrees and milliseconds.
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
_LITERAL_REST_RAD = radians(0.05)
"""Remaining distance at which a saccade of the 0.8-per-frame rule counts as landed."""


@dataclass(frozen=True)
class SaccadeParams:
    """Profile, speed cap L, shortest duration T, and the constants of the other profiles."""

    # fmt: off
    profile: Annotated[Literal["human", "main_sequence", "min_jerk", "literal_frame"],
        "velocity profile of a saccade: human duration and peak speed, human duration alone, minimum jerk (eqs 2-6), or a "
        "fixed share of the distance per frame"] = "human"
    max_speed_deg_s: Annotated[float, Bounds(10, 1000), "fastest eye speed L; the paper's 8.7266 rad/s is 500 deg/s"] = 500.0
    min_duration_ms: Annotated[float, Bounds(10, 1000), "shortest saccade T of the profile min_jerk"] = 50.0
    max_acceleration_deg_s2: Annotated[float, Bounds(100, 200_000),
        "highest acceleration that the eye servos follow; human and main_sequence saccades that need more take longer"] = 44000.0
    human_base_ms: Annotated[float, Bounds(1, 200), "human, main_sequence: duration at amplitude 0"] = 25.0
    human_per_deg_ms: Annotated[float, Bounds(0.1, 20), "human, main_sequence: increase of the duration with amplitude"] = 2.5
    human_peak_deg_s: Annotated[float, Bounds(10, 1000), "human: peak speed V of large saccades, V (1 - exp(-A / A0))"] = 530.0
    human_peak_scale_deg: Annotated[float, Bounds(0.5, 90), "human: amplitude A0 in that peak speed"] = 11.0
    human_peak_over_mean: Annotated[float, Bounds(1.2, 1.875), "main_sequence: peak over mean speed, below max_speed_deg_s"] = 1.65
    device_floor_ms: Annotated[float, Bounds(1, 500),
        "shortest saccade that the servos can make, with the profiles human and main_sequence"] = 20.0
    frame_share: Annotated[float, Bounds(0.05, 0.99), "share of the remaining distance per frame of the profile literal_frame"] = 0.8
    frame_ms: Annotated[float, Bounds(1, 200), "length of such a frame; the authors' display showed 90 a second"] = 11.1
    # fmt: on


class SaccadeProfile(Protocol):
    """The interface of the saccade profiles; amplitudes and angles in radians."""

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time from onset to landing."""
        ...

    def peak_speed_rad_s(self, amplitude_rad: float) -> float:
        """Return the highest speed."""
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

    def peak_speed_rad_s(self, amplitude_rad: float) -> float:
        """Return the highest speed, never above L."""
        return min(PEAK_SPEED * amplitude_rad / self._T, self._L)

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

    The duration is human_base_ms + human_per_deg_ms A and the peak speed
    human_peak_deg_s (1 - exp(-A / human_peak_scale_deg)), as one source measured them.

    The speed rises like the first half of a minimum-jerk movement, stays at its peak for a while,
    and falls like the second half. The rise has .25 of the time of rise and fall up to 10 deg and
    .11 from 38 deg on; the time at the peak follows from the ratio of peak to mean speed. A shaft
    lags most while it accelerates: on it the middle of the peak is at .45 of a saccade of 10 deg
    and at .39 of one of 20, as in people (Collewijn et al. 1988). Such a short rise makes a saccade
    of 20 deg a tenth longer. Servos that would lose more than that have a longer rise, at most .38
    and .14 of that time.
    """

    def __init__(self, params: SaccadeParams) -> None:
        self._L = radians(params.max_speed_deg_s)
        self._most_rad_s2 = radians(params.max_acceleration_deg_s2)
        self._params = params

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time from onset to landing, no shorter than the servos allow."""
        return self._shape(amplitude_rad)[0]

    def peak_speed_rad_s(self, amplitude_rad: float) -> float:
        """Return the highest speed, never above L."""
        return self._shape(amplitude_rad)[1]

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
        par, A, most = self._params, amplitude_rad, self._most_rad_s2
        D = (par.human_base_ms + par.human_per_deg_ms * degrees(A)) / 1e3
        D = max(D, par.device_floor_ms / 1e3)
        if A <= 0.0:
            return D, 0.0, 0.5 * D, D
        share = self._rise_share(A, self._peak_rad_s(A, D), D)
        # A = V (flanks / 1.875 + cruise), flanks + cruise = D. Without a cruise, the speed at the
        # highest acceleration:
        reached = sqrt(PEAK_SPEED * A * most * share / _FLANK_PEAK_ACCELERATION)
        V = min(self._peak_rad_s(A, D), self._L, reached)
        # Limited speed or acceleration needs more time than people's saccades.
        shortest = _FLANK_PEAK_ACCELERATION * V / (most * share)
        D = max(D, A / V + shortest * (1.0 - 1.0 / PEAK_SPEED))
        V = min(V, PEAK_SPEED * A / D)
        flanks = (V * D - A) / (V * (1.0 - 1.0 / PEAK_SPEED))
        return D, V, flanks * share, flanks

    def _rise_share(self, amplitude_rad: float, peak_rad_s: float, duration_s: float) -> float:
        """Return the share of the rise in the time of rise and fall."""
        over = min(1.0, max(0.0, (degrees(amplitude_rad) - 10.0) / 28.0))
        flanks = (peak_rad_s * duration_s - amplitude_rad) / (1.0 - 1.0 / PEAK_SPEED)
        if flanks <= 0.0:
            return 0.38 - 0.24 * over
        needed = _FLANK_PEAK_ACCELERATION * peak_rad_s * peak_rad_s / (self._most_rad_s2 * flanks)
        return min(0.38 - 0.24 * over, max(0.25 - 0.14 * over, _HURRY * needed))

    def _peak_rad_s(self, amplitude_rad: float, duration_s: float) -> float:
        """Return the peak speed of people at an amplitude."""
        par = self._params
        share = 1.0 - exp(-degrees(amplitude_rad) / par.human_peak_scale_deg)
        return radians(par.human_peak_deg_s) * share


class MainSequenceProfile(HumanProfile):
    """Saccades like the human ones, with one ratio of peak to mean speed for all amplitudes."""

    def _peak_rad_s(self, amplitude_rad: float, duration_s: float) -> float:
        """Return the peak speed for an amplitude and a duration."""
        return self._params.human_peak_over_mean * amplitude_rad / duration_s


def _flank(peak_rad_s: float, length_s: float, t_s: float) -> float:
    """Return the angle covered ``t_s`` into half a minimum-jerk movement of that peak speed."""
    whole = 2.0 * length_s
    return peak_rad_s * whole / PEAK_SPEED * min_jerk(t_s / whole) if whole > 0.0 else 0.0


class LiteralFrameProfile:
    """0.8 of the remaining distance in each frame (Nakamoto & Tsuruno 3.3), at any tick rate.

    The covered share is 1 - 0.2^(t / frame), which is the rule at whole frames. It has no cap.
    """

    def __init__(self, share: float, frame_s: float) -> None:
        self._rate_1_s = -log(1.0 - share) / frame_s
        self._frame_s = frame_s

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time until 0.05 deg remain, one frame at least."""
        ratio = max(1.0, amplitude_rad / _LITERAL_REST_RAD)
        return max(self._frame_s, log(ratio) / self._rate_1_s)

    def peak_speed_rad_s(self, amplitude_rad: float) -> float:
        """Return the highest speed, which is the first."""
        return amplitude_rad * self._rate_1_s

    def displacement_rad(self, amplitude_rad: float, t_s: float) -> float:
        """Return the angle covered ``t_s`` after onset."""
        if t_s <= 0.0:
            return 0.0
        if t_s >= self.duration_s(amplitude_rad):
            return amplitude_rad
        return amplitude_rad * (1.0 - exp(-self._rate_1_s * t_s))


class SaccadeModel:
    """Displacement of the eye along the great circle as a function of time.

    max_speed_rad_s, max_acceleration_rad_s2: limits of a saccade that is bent in flight
    """

    def __init__(self, params: SaccadeParams) -> None:
        self.retune(params)

    def retune(self, params: SaccadeParams) -> None:
        """Change the profile or its constants, from the next saccade on."""
        self._profile = _profile(params)
        self.max_speed_rad_s = radians(params.max_speed_deg_s)
        self.max_acceleration_rad_s2 = radians(params.max_acceleration_deg_s2)

    @property
    def profile(self) -> SaccadeProfile:
        """Return the present profile; a saccade in flight keeps its own to its end."""
        return self._profile

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time from onset to landing."""
        return self._profile.duration_s(amplitude_rad)

    def peak_speed_rad_s(self, amplitude_rad: float) -> float:
        """Return the highest speed."""
        return self._profile.peak_speed_rad_s(amplitude_rad)

    def displacement_rad(self, amplitude_rad: float, t_s: float) -> float:
        """Return the angle covered ``t_s`` after onset."""
        return self._profile.displacement_rad(amplitude_rad, t_s)


def _profile(params: SaccadeParams) -> SaccadeProfile:
    """Return the profile that the parameters name."""
    if params.profile == "human":
        return HumanProfile(params)
    if params.profile == "main_sequence":
        return MainSequenceProfile(params)
    if params.profile == "literal_frame":
        return LiteralFrameProfile(params.frame_share, params.frame_ms / 1e3)
    return MinJerkProfile(radians(params.max_speed_deg_s), params.min_duration_ms / 1e3)
