"""Saccade profile: minimum jerk with a cap on the speed (Mitake et al., eqs 2-6).

Closed forms of the time since onset: a late tick lands on the curve instead of
stretching it. Radians and seconds inside; parameters in degrees and milliseconds.
"""

from dataclasses import dataclass, field
from math import radians


@dataclass(frozen=True)
class SaccadeParams:
    """Speed cap L and shortest duration T."""

    max_speed_deg_s: float = field(
        default=500.0,
        metadata={
            "low": 10.0,
            "high": 1000.0,
            "unit": "deg/s",
            "says": "fastest eye speed L; the paper's 8.7266 rad/s is 500 deg/s",
        },
    )
    shortest_ms: float = field(
        default=50.0,
        metadata={"low": 10.0, "high": 1000.0, "unit": "ms", "says": "shortest saccade T"},
    )


def min_jerk(s: float) -> float:
    """Give f(s) = 6 s^5 - 15 s^4 + 10 s^3, held at 0 before 0 and at 1 after 1 (eq 2, eq 8)."""
    if s <= 0.0:
        return 0.0
    if s >= 1.0:
        return 1.0
    return s * s * s * (10.0 + s * (6.0 * s - 15.0))


class Saccade:
    """Displacement of the eye along the great circle as a function of time."""

    def __init__(self, params: SaccadeParams) -> None:
        """Take L and T."""
        self._L = radians(params.max_speed_deg_s)
        self._T = params.shortest_ms / 1000.0
        # Eq 3, A' = L / f'(0.5 T), where the paper misprints T' for f': f'(0.5 T) = 1.875 / T.
        self.largest_uncapped_rad = self._L * self._T / 1.875

    def duration_s(self, amplitude_rad: float) -> float:
        """Give the time from onset to landing."""
        return self._T + self._cruise_s(amplitude_rad)

    def peak_speed_rad_s(self, amplitude_rad: float) -> float:
        """Give the highest speed, never above L."""
        return min(1.875 * amplitude_rad / self._T, self._L)

    def displacement_rad(self, amplitude_rad: float, t_s: float) -> float:
        """Give the angle covered ``t_s`` after onset (eqs 5 and 6)."""
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
        """Give the time at full speed, (A - A') / L; eq 4's t_f is 0.5 T later."""
        return max(0.0, (amplitude_rad - self.largest_uncapped_rad) / self._L)
