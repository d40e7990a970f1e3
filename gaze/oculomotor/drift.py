"""Drift of a head that is held still: breathing, and small random sway.

People judge heads that breathe slowly while idle as more alive. A breath is a slow swing of the
head's pitch; people at rest breathe at 0.2 to 0.3 Hz.

A head at rest wanders by some tenths of a degree, more the slower: its power falls with frequency.
Each axis is a sum of octaves, as in Perlin's noise for figures (Perlin 1995): an octave moves by
minimum jerk from one random value to the next, in about its period. Octaves of equal size have the
spectrum 1/f between the fastest and the slowest. Values are bounded, position, speed and
acceleration are continuous, and the draws do not depend on the rate of the ticks.

A speaker's head moves all the time, more with the voice, mostly below 3 Hz (Hadar, Steiner, Grant
& Rose 1983). So further, faster octaves are added while the head speaks, larger where the speech is
louder. Their size is a choice: a shipped conversational robot moves pitch and yaw by 2 to 4 deg.

The drift is added to the head model's angles, and the eyes compensate it, so the gaze stays on its
target. The goal of a neck servo at rest moves by about a tenth of an encoder step (.088 deg) in a
tick of 5 ms.
"""

from collections.abc import Sequence
from math import pi, radians, sin, sqrt
from typing import Literal

import numpy as np

from gazerig.gaze.angles import add, scale
from gazerig.gaze.minimum_jerk import MinimumJerkBlend, Quintic, min_jerk
from gazerig.gaze.types import Angles3

DriftLaw = Literal["people", "none"]

_STILL: Angles3 = (0.0, 0.0, 0.0)
_GLIDE_S = 1.0
"""Time in which the drift begins or ends during a run."""
_BREATH_RAD, _BREATH_HZ = radians(0.6), 0.25
"""Amplitude of the head's pitch, people's is 0.5 to 1.5 deg; and breaths per second."""
_SWAY_RAD = radians(0.6), radians(0.4), radians(0.6)
"""Standard deviations of yaw, pitch and roll; people's are .2 to 1.5 deg."""
_PERIODS_S = 1.5, 3.0, 6.0, 12.0, 24.0
"""Mean times of the octaves' movements; shorter ones make servos audible."""
_SPEECH_RAD = radians(1.3), radians(1.3), radians(0.8)
"""Standard deviations of a speaker's additional yaw, pitch and roll."""
_SPEECH_PERIODS_S = 0.5, 0.8, 1.3
"""Those of its octaves: the fastest movement takes .25 s, half a cycle of 2 Hz; the voice hides
the servos.
"""
_SPEECH_GLIDE_S = 0.6
"""Time in which a speaker's motion begins, ends and follows the loudness."""
_LEAST_SHARE, _BY_LOUDNESS = 0.3, 2.0
"""Share of a speaker's motion in pauses, and its increase with the loudness, up to 1."""
_VARIANCE = 0.264
"""Mean variance of an octave of size 1: uniform values -1..1, joined by minimum jerk."""


class Drift:
    """Breathing and random sway of yaw, pitch and roll, and a speaker's motion.

    Args:
        law: "people", or "none".
        rng: random generator of the sway's values and times.
    """

    def __init__(self, law: DriftLaw, rng: np.random.Generator) -> None:
        self._rng = rng
        self._law = law
        self.reset(0.0)

    def reset(self, t_s: float) -> None:
        """Start at the centre; the depth of a breath grows from 0 within the first one."""
        self._start_s = t_s
        self._share = MinimumJerkBlend((float(self._law == "people"),), _GLIDE_S)
        self._wander = _Wander(_SWAY_RAD, _PERIODS_S, self._rng, t_s)
        self._speech_share = MinimumJerkBlend((0.0,), _SPEECH_GLIDE_S)
        (speech_rng,) = self._rng.spawn(1)
        self._speech = _Wander(_SPEECH_RAD, _SPEECH_PERIODS_S, speech_rng, t_s)

    def retune(self, law: DriftLaw) -> None:
        """Begin or end gradually."""
        self._law = law
        self._share.move_to((float(law == "people"),))

    def speak(self, loudness: float | None) -> None:
        """Begin or end a speaker's motion gradually.

        loudness: loudness of the speech, 0..1; None: the head does not speak
        """
        share = 0.0 if loudness is None else min(1.0, _LEAST_SHARE + _BY_LOUDNESS * loudness)
        self._speech_share.move_to((share,))

    def step(self, t_s: float) -> Angles3:
        """Return the (yaw, pitch, roll) to add to the head's."""
        (share,), (speech_share,) = self._share.step(t_s), self._speech_share.step(t_s)
        if share == 0.0:
            return _STILL
        breaths = max(0.0, (t_s - self._start_s) * _BREATH_HZ)
        breath_rad = min_jerk(breaths) * _BREATH_RAD * sin(2.0 * pi * breaths)
        yaw, pitch, roll = self._wander.step(t_s)
        drift = share * yaw, share * (breath_rad + pitch), share * roll
        if speech_share == 0.0:
            return drift
        return add(drift, scale(self._speech.step(t_s), share * speech_share))


class _Wander:
    """Random motion of three axes, each a sum of octaves of equal size.

    sds_rad: standard deviations of the axes; periods_s: mean times of the octaves' movements
    """

    def __init__(
        self, sds_rad: Angles3, periods_s: Sequence[float], rng: np.random.Generator, t_s: float
    ) -> None:
        self._rng, self._until_s = rng, t_s
        sizes_rad = scale(sds_rad, 1.0 / sqrt(_VARIANCE * len(periods_s)))
        self._axes = [[_Octave(size, s, t_s) for s in periods_s] for size in sizes_rad]

    def step(self, t_s: float) -> Angles3:
        """Return the sum of the octaves of each axis: one polynomial until any of them ends."""
        if t_s >= self._until_s:
            rows = [[one.rest(t_s, self._rng) for one in octaves] for octaves in self._axes]
            self._sums = [[*map(sum, zip(*row, strict=True))] for row in rows]
            self._from_s = t_s
            self._until_s = min(one.end_s for octaves in self._axes for one in octaves)
        s = t_s - self._from_s
        yaw, pitch, roll = (
            c0 + s * (c1 + s * (c2 + s * (c3 + s * (c4 + s * c5))))
            for c0, c1, c2, c3, c4, c5 in self._sums
        )
        return yaw, pitch, roll


class _Octave:
    """Movements between random values, each within half to one and a half of a period."""

    def __init__(self, size_rad: float, period_s: float, t_s: float) -> None:
        self._size_rad, self._period_s = size_rad, period_s
        self._goal, self.end_s = 0.0, t_s

    def rest(self, t_s: float, rng: np.random.Generator) -> Sequence[float]:
        """Return the polynomial of the rest of the present movement; times must not decrease."""
        while t_s >= self.end_s:
            start = self._goal, 0.0, 0.0
            self._goal, self._begin_s = self._size_rad * float(rng.uniform(-1.0, 1.0)), self.end_s
            self.end_s += self._period_s * float(rng.uniform(0.5, 1.5))
            self._move = Quintic(start, self._goal, self.end_s - self._begin_s)
        state = self._move.state_at(t_s - self._begin_s)
        return Quintic(state, self._goal, self.end_s - t_s).coefficients
