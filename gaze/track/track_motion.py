"""Motion of one track as smooth curves, and as samples for the check of limits."""

from collections.abc import Mapping, Sequence
from copy import copy
from typing import NamedTuple

import numpy as np

from gazerig.gaze.track.minimum_jerk_curve import MinimumJerkCurve
from gazerig.gaze.track.track import EYE_CHANNELS, POSE_CHANNELS, ChannelKeys, rest_value
from gazerig.gaze.types import Floats

_SAMPLE_S = 0.005
_MOST_SAMPLES = 6000
_PER_KEY = 8
"""Samples between two keys of a long track."""
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


class LevelCurve(NamedTuple):
    """Keys of a level, and the offset of every channel at level 1, (channels,)."""

    keys: ChannelKeys
    gain: tuple[float, ...]


class TrackEvents(NamedTuple):
    """What a track does besides motion: times in s, increasing, and values."""

    looks: tuple[tuple[float, object], ...] = ()
    expressions: tuple[tuple[float, tuple[str, float]], ...] = ()
    cues: tuple[tuple[float, str], ...] = ()


NO_EVENTS = TrackEvents()


class _ChannelCurve(NamedTuple):
    """A curve that moves one channel, by its index; ``rest``: value of the channel at rest."""

    channel: int
    curve: MinimumJerkCurve
    rest: float
    gain: float = 1.0
    delay_s: float = 0.0


class TrackMotion:
    """Curves of one track on one rig, at its original speed and size.

    duration_s: time until everything is at rest again
    samples: samples of all channels; of a long track those with the extremes
    channels: indices of the channels that it moves; owned: those that it owns
    events: gaze points, expressions and cues

    Args:
        keys: keys by channel.
        joints: the rig's further joints, the channels after those of every rig.
        eyes_follow_head: the eyes keep their angles in the head, instead of their target.
        owned: names of the channels that it owns.
        levels: curves of levels.
        events: gaze points, expressions and cues.
    """

    def __init__(
        self,
        keys: Mapping[str, ChannelKeys],
        joints: tuple[str, ...],
        eyes_follow_head: bool,
        owned: Sequence[str] = (),
        levels: Sequence[LevelCurve] = (),
        events: TrackEvents = NO_EVENTS,
    ) -> None:
        channels = (*POSE_CHANNELS, *joints)
        self._rests = [rest_value(name) for name in channels]
        self.rest = np.array(self._rests)
        self._curves = [
            _ChannelCurve(
                channels.index(name),
                MinimumJerkCurve(rest_value(name), found.times_s, found.values),
                rest_value(name),
            )
            for name, found in keys.items()
        ]
        for level in levels:
            curve = MinimumJerkCurve(0.0, level.keys.times_s, level.keys.values)
            self._curves += [
                _ChannelCurve(i, curve, 0.0, gain) for i, gain in enumerate(level.gain) if gain
            ]
        self.owned = frozenset(channels.index(name) for name in owned)
        self._follow = eyes_follow_head and not self.owned & {_FIRST_EYE, _FIRST_EYE + 1}
        self.channels = self.owned | {i for i, *_ in self._curves}
        if self._follow:
            self.channels |= {_FIRST_EYE + i for i in (0, 1) if i in self.channels}
        self.events = events
        self._times_s = [np.array([t for t, _ in found]) for found in events[:2]]
        self._keys_s = [
            np.array(found.times_s) for found in (*keys.values(), *(one.keys for one in levels))
        ]
        ends = [found[-1][0] for found in events if found]
        self.duration_s = max(
            [curve.duration_s for _, curve, *_ in self._curves] + ends, default=0.0
        )
        self.samples = self._sample_evenly()

    def delay(self, delays_s: Sequence[float]) -> "TrackMotion":
        """Return the same motion with each channel later by its delay, at the original speed."""
        most_s = max([delays_s[i] for i in self.channels], default=0.0)
        if most_s == 0.0:
            return self
        later = copy(self)
        later._curves = [one._replace(delay_s=delays_s[one.channel]) for one in self._curves]
        later.duration_s = self.duration_s + most_s
        return later

    def _sample_evenly(self) -> MotionSamples:
        count = int(self.duration_s / _SAMPLE_S) + 2
        if count > _MOST_SAMPLES:
            return self._sample_extremes()
        even = np.linspace(0.0, self.duration_s, count)
        # The extremes are keys, which evenly spaced samples may miss.
        return self.sample_at(np.unique(np.concatenate((even, *self._keys_s))))

    def _sample_extremes(self) -> MotionSamples:
        """Return the samples with the largest and smallest values, speeds and accelerations.

        They are found block by block at and between all keys.
        """
        keys = np.unique(np.concatenate((np.zeros(1), *self._keys_s)))
        size = _MOST_SAMPLES // _PER_KEY
        chosen = np.zeros(1)
        for first in range(0, len(keys), size):
            block = keys[first : first + size + 1]
            between = block[:-1, None] + np.diff(block)[:, None] * np.linspace(0.0, 1.0, _PER_KEY)
            found = self.sample_at(np.unique(np.concatenate((chosen, block, between.ravel()))))
            chosen = found.times_s[_extreme_rows(found)]
        return self.sample_at(chosen)

    def sample_at(self, times_s: Floats) -> MotionSamples:
        """Return the motion at (n,) times since its start."""
        columns = [np.zeros((len(times_s), len(self.rest))) for _ in range(3)]
        for i, curve, rest, gain, delay_s in self._curves:
            value, *others = curve.sample_at(times_s - delay_s)
            for column, found in zip(columns, (value - rest, *others), strict=True):
                column[:, i] += gain * found
        if self._follow:
            first = _FIRST_EYE
            for column in columns:
                column[:, first : first + 2] += column[:, :2]
        return MotionSamples(times_s, *columns)

    def add_to(self, flat: list[float], t_s: float, sizes: tuple[float, ...]) -> None:
        """Add the motion at one time to a flat PoseOffset.

        Args:
            flat: changed in place.
            t_s: time since the start, at the original speed.
            sizes: factor of every channel.
        """
        first = _FIRST_EYE
        for i, curve, rest, gain, delay_s in self._curves:
            moved = sizes[i] * (gain * (curve.value_at(t_s - delay_s) - rest))
            flat[i] += moved
            if self._follow and i < 2:
                flat[first + i] += moved

    def event_at(self, kind: int, t_s: float) -> int:
        """Return the index of the newest gaze point (0) or expression (1), -1 before the first."""
        return int(self._times_s[kind].searchsorted(t_s, side="right")) - 1


def _extreme_rows(samples: MotionSamples) -> list[int]:
    """Return the rows with extremes of a channel, or of the eyes against the head."""
    rows: set[int] = set()
    for column in samples[1:]:
        eyes = column[:, _FIRST_EYE : _FIRST_EYE + 2] - column[:, :2]
        both = np.concatenate((column, eyes), axis=1)
        rows.update(both.argmax(axis=0).tolist(), both.argmin(axis=0).tolist())
    return sorted(rows)
