"""Breathing: a slow sway of the neck, like that of a person at rest.

Pitch of 0.5 to 1.5 deg at 0.2 to 0.3 Hz; people judge heads that breathe slowly while idle as more
alive. The sway is added to the head model's angles, and the eyes compensate it, so the gaze stays
on its target.
"""

from dataclasses import dataclass
from math import cos, pi, radians, sin
from typing import Annotated

from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.gaze.types import Angles3
from gazerig.params import Bounds

_STILL: Angles3 = (0.0, 0.0, 0.0)
_GLIDE_S = 1.0  # time in which a retuned breath reaches its new depth


@dataclass(frozen=True)
class BreathingParams:
    """Amplitude and rate."""

    # fmt: off
    pitch_deg: Annotated[float, Bounds(0, 5), "amplitude of the head's pitch with breathing; 0: none"] = 0.6
    roll_deg: Annotated[float, Bounds(0, 5), "amplitude of the head's roll, a quarter of a breath later; 0: none"] = 0.0
    rate_hz: Annotated[float, Bounds(0.02, 1), "breaths per second"] = 0.25
    # fmt: on


class Breathing:
    """Sway of the neck as a closed form of the time."""

    def __init__(self, params: BreathingParams) -> None:
        self._set_params(params)
        self.reset(0.0)

    def _set_params(self, params: BreathingParams) -> None:
        self._pitch_rad = radians(params.pitch_deg)
        self._roll_rad = radians(params.roll_deg)
        self._rate_hz = params.rate_hz

    def reset(self, t_s: float) -> None:
        """Start to breathe: the amplitude grows from 0 within the first breath."""
        self._start_s = self._t_s = self._retuned_s = t_s
        self._shown = self._left = _STILL

    def retune(self, params: BreathingParams) -> None:
        """Change amplitude and rate; the phase of the breath is continuous."""
        breaths = (self._t_s - self._start_s) * self._rate_hz
        self._set_params(params)
        self._start_s = self._t_s - breaths / self._rate_hz
        pitch, roll = self._sway(self._t_s)[1:]
        self._left = (0.0, self._shown[1] - pitch, self._shown[2] - roll)
        self._retuned_s = self._t_s

    def step(self, t_s: float) -> Angles3:
        """Return the (yaw, pitch, roll) to add to the head's; yaw is always 0."""
        self._t_s = t_s
        self._shown = self._sway(t_s)
        if self._left != _STILL:  # remainder of a retune, which decays within a second
            kept = 1.0 - min_jerk((t_s - self._retuned_s) / _GLIDE_S)
            _, pitch, roll = self._shown
            self._shown = (0.0, pitch + kept * self._left[1], roll + kept * self._left[2])
            if kept == 0.0:
                self._left = _STILL
        return self._shown

    def _sway(self, t_s: float) -> Angles3:
        breaths = (t_s - self._start_s) * self._rate_hz
        if breaths <= 0.0 or (self._pitch_rad == 0.0 and self._roll_rad == 0.0):
            return _STILL
        depth, turn = min_jerk(breaths) if breaths < 1.0 else 1.0, 2.0 * pi * breaths
        if self._roll_rad == 0.0:
            return (0.0, depth * self._pitch_rad * sin(turn), 0.0)
        return (0.0, depth * self._pitch_rad * sin(turn), -depth * self._roll_rad * cos(turn))
