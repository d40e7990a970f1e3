"""Motion of one track as smooth curves, and as samples for the check of limits."""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from gazerig.gaze.track.minimum_jerk_curve import MinimumJerkCurve
from gazerig.gaze.track.track import EYE_CHANNELS, POSE_CHANNELS, ChannelKeys, rest_value
from gazerig.gaze.types import Floats

_SAMPLE_S = 0.005
_MOST_SAMPLES = 6000
_FIRST_EYE = POSE_CHANNELS.index(EYE_CHANNELS[0])


class MotionSamples(NamedTuple):
    """A track sampled over its whole time, relative to rest.

    times_s: (n,); value, speed, acceleration: (n, channels), in the order of PoseOffset.flat()
    """

    times_s: Floats
    value: Floats
    speed: Floats
    acceleration: Floats

    def scale(self, size: Floats, rate: float) -> "MotionSamples":
        """Return the samples of the same motion, scaled in size and speed.

        Args:
            size: (channels,) factors.
            rate: factor of the speed.
        """
        return MotionSamples(
            self.times_s / rate,
            self.value * size,
            self.speed * (size * rate),
            self.acceleration * (size * rate * rate),
        )


class TrackMotion:
    """Curves of one track on one rig, at its original speed and size.

    duration_s: time until everything is at rest again
    samples: samples of all channels

    Args:
        keys: keys by channel; at least one channel.
        joints: the rig's further joints, the channels after those of every rig.
        eyes_follow_head: the eyes keep their angles in the head, instead of their target.
    """

    def __init__(
        self, keys: Mapping[str, ChannelKeys], joints: tuple[str, ...], eyes_follow_head: bool
    ) -> None:
        channels = (*POSE_CHANNELS, *joints)
        self._rests = [rest_value(name) for name in channels]
        self.rest = np.array(self._rests)
        self._follow = eyes_follow_head
        self._curves = [
            (channels.index(name), MinimumJerkCurve(rest_value(name), found.times_s, found.values))
            for name, found in keys.items()
        ]
        self._keys_s = [np.array(found.times_s) for found in keys.values()]
        self.duration_s = max(curve.duration_s for _, curve in self._curves)
        self.samples = self._sample_evenly()

    def _sample_evenly(self) -> MotionSamples:
        count = min(_MOST_SAMPLES, int(self.duration_s / _SAMPLE_S) + 2)
        even = np.linspace(0.0, self.duration_s, count)
        # The extremes are keys, which evenly spaced samples may miss.
        return self.sample_at(np.unique(np.concatenate((even, *self._keys_s))))

    def sample_at(self, times_s: Floats) -> MotionSamples:
        """Return the motion at (n,) times since its start."""
        columns = [np.zeros((len(times_s), len(self.rest))) for _ in range(3)]
        for i, curve in self._curves:
            for column, found in zip(columns, curve.sample_at(times_s), strict=True):
                column[:, i] = found
        for i, _ in self._curves:
            columns[0][:, i] -= self.rest[i]
        if self._follow:
            first = _FIRST_EYE
            for column in columns:
                column[:, first : first + 2] += column[:, :2]
        return MotionSamples(times_s, *columns)

    def state_at(self, t_s: float) -> tuple[list[float], list[float], list[float]]:
        """Return value, speed and acceleration of every channel at a time, relative to rest."""
        value, speed, acceleration = ([0.0] * len(self._rests) for _ in range(3))
        for i, curve in self._curves:
            at, speed[i], acceleration[i] = curve.state_at(t_s)
            value[i] = at - self._rests[i]
        if self._follow:
            for column in (value, speed, acceleration):
                for axis in (0, 1):
                    column[_FIRST_EYE + axis] += column[axis]
        return value, speed, acceleration

    def add_to(self, flat: list[float], t_s: float, sizes: tuple[float, ...]) -> None:
        """Add the motion at one time to a flat PoseOffset.

        Args:
            flat: changed in place.
            t_s: time since the start, at the original speed.
            sizes: factor of every channel.
        """
        first, rest = _FIRST_EYE, self._rests
        for i, curve in self._curves:
            moved = sizes[i] * (curve.value_at(t_s) - rest[i])
            flat[i] += moved
            if self._follow and i < 2:
                flat[first + i] += moved
