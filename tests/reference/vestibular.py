"""Vestibulo-ocular reflex by signals of rotation and translation, for the reference model.

The robot's gaze is planned in space instead, which compensates the same motions exactly (the
gaze-feedback hypothesis, Daye 2015). Radians, metres, seconds.
"""

from collections import deque
from math import cos, degrees, exp, inf, sin

from gazerig.gaze.types import Angles2, Angles3


class SemicircularCanals:
    """Head velocity as the reflex receives it: delayed and high-passed.

    A high-pass in the place of the semicircular canals and their velocity storage; it
    also takes the bias off a gyroscope.
    """

    def __init__(self, delay_s: float, storage_s: float) -> None:
        self._delay_s, self._storage_s = delay_s, storage_s
        self.reset()

    def reset(self) -> None:
        """Start with the head at rest."""
        self._slow = 0.0
        self._past: deque[float] = deque()

    def step(self, head_rate_rad_s: float, dt_s: float) -> float:
        """Return the rate that the reflex acts on now."""
        if self._storage_s > 0.0:
            kept = exp(-dt_s / self._storage_s)
            self._slow = kept * self._slow + (1.0 - kept) * head_rate_rad_s
        self._past.append(head_rate_rad_s - self._slow)
        delay = round(self._delay_s / dt_s)
        while len(self._past) > delay + 1:
            self._past.popleft()
        return self._past[0] if len(self._past) == delay + 1 else 0.0


def gate(amplitude_rad: float, since_landing_s: float = -inf) -> float:
    """Return the share of the reflex left during a gaze shift and after its landing.

    1 - min(0.9, 0.017 A) for A degrees while it lasts (negative times), back to 1 with
    a time constant of 40 ms after.
    """
    suppressed = min(0.9, 0.017 * degrees(amplitude_rad))
    return 1.0 - suppressed * exp(-max(0.0, since_landing_s) / 0.04)


def near_gain(ahead_m: float, distance_m: float) -> float:
    """Return the eye turn per head turn that fixates a point: 1 + r / d.

    ahead_m: how far the eye sits ahead of the head's axis; distance_m: eye to point
    """
    return 1.0 + ahead_m / distance_m


def distance_m(vergence_rad: float, interocular_m: float) -> float:
    """Return the distance at which both lines of sight meet, I / V (Zhang); never beyond 100 m."""
    return interocular_m / max(vergence_rad, interocular_m / 100.0)


def translational_rad_s(
    eye_rad: float, ahead_m_s: float, left_m_s: float, distance_m: float
) -> float:
    """Return the eye rate against a translation of the head, in the head's frame."""
    return -(left_m_s * cos(eye_rad) - ahead_m_s * sin(eye_rad)) / distance_m


def negated(eye_rad: Angles2, head_before_rad: Angles3, head_rad: Angles3) -> Angles2:
    """Return the eye angles of the rule (-x, -y, -z) (Nakamoto & Tsuruno 3.4), literally.

    It is the inverse of the head's turn for one axis only; with two it errs by degrees.
    """
    return (
        eye_rad[0] - (head_rad[0] - head_before_rad[0]),
        eye_rad[1] - (head_rad[1] - head_before_rad[1]),
    )
