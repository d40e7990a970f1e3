"""Saccade profiles: the angle covered as a function of the time since onset.

Three profiles with one interface. ``min_jerk`` is eqs 2-6 of Mitake et al., minimum
jerk with a cap on the speed. ``main_sequence`` has the duration and the early peak of
human saccades. ``literal_frame`` is the rule of Nakamoto & Tsuruno 3.3, 0.8 of the way
in each frame. All are closed forms of the time: a late tick lands on the curve instead
of stretching it. Radians and seconds inside; parameters in degrees and milliseconds.
"""

from dataclasses import dataclass
from math import degrees, exp, log, radians
from typing import Annotated, Literal, Protocol

from gazerig.params import Bounds

MIN_JERK_PEAK = 1.875
"""Peak over mean speed of a minimum-jerk movement."""
_NARROWEST = 1.1
"""Least peak over mean speed of the main-sequence profile: some time goes to its flanks."""
_LITERAL_REST_RAD = radians(0.05)
"""What the 0.8-per-frame rule may leave when its saccade counts as landed."""


@dataclass(frozen=True)
class SaccadeParams:
    """Profile, speed cap L, shortest duration T, and the constants of the other profiles."""

    # fmt: off
    profile: Annotated[Literal["min_jerk", "main_sequence", "literal_frame"],
        "velocity profile of a saccade: minimum jerk (eqs 2-6), the human main sequence, or a fixed share of the way each "
        "frame"] = "min_jerk"
    max_speed_deg_s: Annotated[float, Bounds(10, 1000), "fastest eye speed L; the paper's 8.7266 rad/s is 500 deg/s"] = 500.0
    min_duration_ms: Annotated[float, Bounds(10, 1000), "shortest saccade T of the profile min_jerk"] = 50.0
    human_base_ms: Annotated[float, Bounds(1, 200), "main sequence: duration at amplitude 0"] = 21.0
    human_per_deg_ms: Annotated[float, Bounds(0.1, 20), "main sequence: increase of the duration with amplitude"] = 2.2
    human_peak_over_mean: Annotated[float, Bounds(1.2, 1.875), "main sequence: peak over mean speed, below max_speed_deg_s"] = 1.65
    device_floor_ms: Annotated[float, Bounds(1, 500), "shortest saccade that the servos can make, with the profile main_sequence"] = 20.0
    frame_share: Annotated[float, Bounds(0.05, 0.99), "share of the remaining way per frame of the profile literal_frame"] = 0.8
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


def min_jerk(s: float) -> float:
    """Return f(s) = 6 s^5 - 15 s^4 + 10 s^3, held at 0 before 0 and at 1 after 1 (eq 2, eq 8)."""
    if s <= 0.0:
        return 0.0
    if s >= 1.0:
        return 1.0
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


class MinJerkProfile:
    """Minimum jerk with a cap on the speed (Mitake et al., eqs 2-6)."""

    def __init__(self, max_speed_rad_s: float, shortest_s: float) -> None:
        self._L = max_speed_rad_s
        self._T = shortest_s
        # Eq 3, A' = L / f'(0.5 T), where the paper misprints T' for f': f'(0.5 T) = 1.875 / T.
        self.largest_uncapped_rad = self._L * self._T / MIN_JERK_PEAK

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time from onset to landing."""
        return self._T + self._cruise_s(amplitude_rad)

    def peak_speed_rad_s(self, amplitude_rad: float) -> float:
        """Return the highest speed, never above L."""
        return min(MIN_JERK_PEAK * amplitude_rad / self._T, self._L)

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


class MainSequenceProfile:
    """Duration and skew of human saccades, the speed capped.

    The speed rises like the first half of a minimum-jerk movement, stays at its peak
    for a while, and falls like the second half. Rise and fall share their time .45 to
    .55 up to 10 deg and .25 to .75 from 50 deg on (Collewijn 1988); the time at the
    peak follows from the ratio of peak to mean speed, which the cap lowers.
    """

    def __init__(self, params: SaccadeParams) -> None:
        self._L = radians(params.max_speed_deg_s)
        self._params = params

    def duration_s(self, amplitude_rad: float) -> float:
        """Return the time from onset to landing: max(floor, 21 ms + 2.2 ms a degree)."""
        par = self._params
        human = par.human_base_ms + par.human_per_deg_ms * degrees(amplitude_rad)
        # A low cap needs more time than people do.
        capped = _NARROWEST * amplitude_rad / self._L
        return max(par.device_floor_ms / 1e3, human / 1e3, capped)

    def peak_speed_rad_s(self, amplitude_rad: float) -> float:
        """Return the highest speed, never above L."""
        mean = amplitude_rad / self.duration_s(amplitude_rad)
        return min(self._params.human_peak_over_mean * mean, self._L)

    def displacement_rad(self, amplitude_rad: float, t_s: float) -> float:
        """Return the angle covered ``t_s`` after onset."""
        D = self.duration_s(amplitude_rad)
        if t_s <= 0.0 or amplitude_rad <= 0.0:
            return 0.0
        if t_s >= D:
            return amplitude_rad
        V = self.peak_speed_rad_s(amplitude_rad)
        # A = V (flanks / 1.875 + cruise), flanks + cruise = D.
        flanks = (V * D - amplitude_rad) / (V * (1.0 - 1.0 / MIN_JERK_PEAK))
        rise = flanks * self._skew(amplitude_rad)
        cruise_ends = rise + D - flanks
        if t_s < rise:
            return _flank(V, rise, t_s)
        if t_s < cruise_ends:
            return _flank(V, rise, rise) + V * (t_s - rise)
        return amplitude_rad - _flank(V, flanks - rise, D - t_s)

    def _skew(self, amplitude_rad: float) -> float:
        """Return the share of the rise in the time of rise and fall."""
        over = (degrees(amplitude_rad) - 10.0) / 40.0
        return 0.45 - 0.20 * min(1.0, max(0.0, over))


def _flank(peak_rad_s: float, length_s: float, t_s: float) -> float:
    """Return the angle covered ``t_s`` into half a minimum-jerk movement of that peak speed."""
    whole = 2.0 * length_s
    return peak_rad_s * whole / MIN_JERK_PEAK * min_jerk(t_s / whole) if whole > 0.0 else 0.0


class LiteralFrameProfile:
    """0.8 of the remaining way in each frame (Nakamoto & Tsuruno 3.3), at any tick rate.

    Done at 1 - 0.2^(t / frame), which is the rule at whole frames. It has no cap.
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
    """Displacement of the eye along the great circle as a function of time."""

    def __init__(self, params: SaccadeParams) -> None:
        self.retune(params)

    def retune(self, params: SaccadeParams) -> None:
        """Change the profile or its constants, from the next saccade on."""
        self._profile = _profile(params)

    @property
    def profile(self) -> SaccadeProfile:
        """Return the profile in force, which a saccade under way keeps to its end."""
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
    if params.profile == "main_sequence":
        return MainSequenceProfile(params)
    if params.profile == "literal_frame":
        return LiteralFrameProfile(params.frame_share, params.frame_ms / 1e3)
    return MinJerkProfile(radians(params.max_speed_deg_s), params.min_duration_ms / 1e3)
