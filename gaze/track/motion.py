"""Motion of one track on one rig, slower only where a joint needs it."""

from collections.abc import Sequence
from functools import reduce
from typing import NamedTuple

import numpy as np

from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.gaze.track.curves import Curves, key_states
from gazerig.gaze.track.track import EYE_CHANNELS, POSE_CHANNELS, Track
from gazerig.gaze.types import Floats

_SHARES = np.linspace(0.0, 1.0, 25)
"""Places between two keys at which limits are checked."""
_LEAST_S = 0.02
"""Length of a track that has no motion of its own."""
_ROUNDS, _KEPT = 12, 1.0 + 1e-3
"""Corrections of single segments, and the ratio to a limit that counts as kept."""
_GROWING = np.array([min_jerk(share) for share in np.linspace(0.0, 1.0, 81)])[:, None]
_BLEND_STRAIN = 1.09
"""Factor that joints may need in a blend, which may use more of their limits than a motion."""
_EYES = [POSE_CHANNELS.index(name) for name in EYE_CHANNELS]

ChannelKeys = tuple[int, Floats, Floats]
"""Channel, and the times and values relative to rest of its keys; the first is rest at time 0."""


class ChannelBounds(NamedTuple):
    """(channels,) least and greatest values relative to rest, greatest speeds and accelerations."""

    low: Floats
    high: Floats
    speed: Floats
    acceleration: Floats


class Motion:
    """Curves of one track on one rig.

    Segments that are too fast for a joint take longer, the others keep their times. A track that
    begins in motion is led in from rest: the time that its first key needs comes before its
    beginning, at positions below it.

    Args:
        track: The track.
        rows: Its keys, of any channels in any order.
        bounds: What the rig's joints can do.
        owned: Channels that it owns.
        speed: Factor on its defined speed.
        sound_s: Duration of its sound, 0 without one.

    Attributes:
        channels: Channels that it moves or owns.
        moves: Whether there are any.
        mouth: Times and openings of the mouth of a speech, None without one.
        lead_s: Time by which the openings must be ahead of the sound.
        limited: What the rig changes, "" if nothing.
        rate: Mean speed of the position; ``speed`` if nothing behind the first key is slower.
        slowed_by: Factor by which it takes longer.
        owns: Joints that gaze does not move meanwhile.
        slowest: Channel that needs this, or -1.
    """

    def __init__(
        self, track: Track, rows: Sequence[ChannelKeys], bounds: ChannelBounds,
        owned: frozenset[int] = frozenset(), speed: float = 1.0, sound_s: float = 0.0,
    ) -> None:  # fmt: skip
        self.track, self.owned, self.speed, self.sound_s = track, owned, speed, sound_s
        self.channels = owned.union(channel for channel, _, _ in rows)
        self.moves, self.lead_s = bool(rows or owned), 0.0
        self.mouth: tuple[Floats, Floats] | None = None
        self.limited, self.slowest, self._bounds = "", -1, bounds
        self.owns: tuple[str, ...] = ()
        self.cues = sorted((time_s, name) for name, time_s in track.cues.items())
        times = [times_s for _, times_s, _ in rows]
        length_s = sound_s if rows else max(sound_s, _LEAST_S)
        self._positions = np.unique(np.concatenate(([0.0, length_s, *track.cues.values()], *times)))
        self._times = self._positions / speed
        self._slow_down(rows)
        self.duration_s, self.length_s = float(self._times[-1]), float(self._positions[-1])
        self.slowed_by = self.duration_s * speed / self.length_s
        self._positions[0] = self._positions[1] - self._times[1] * speed
        self.rate = round(float(np.ptp(self._positions)) / self.duration_s, 6)

    def _slow_down(self, rows: Sequence[ChannelKeys]) -> None:
        """Make the curves, with more time between keys where a joint would be too fast."""
        for attempt in range(_ROUNDS + 2):
            states = np.zeros((3, len(self._times), len(self._bounds.low)))
            for channel, times_s, values in rows:
                knots_s = np.interp(times_s, self._positions, self._times)
                curve = Curves(knots_s, key_states(knots_s, values)[:, :, None])
                states[:, :, channel] += curve.sample(self._times)[:, :, 0]
            self._curves = Curves(self._times, states)
            begins_s, spans_s = self._times[:-1], np.diff(self._times)
            every = (self.strain(*self.sample(begins_s + k * spans_s)[1:]) for k in _SHARES)
            factors = reduce(np.maximum, every)
            if factors.max() <= _KEPT:
                return
            if self.slowest < 0:
                self.slowest = int(factors.max(axis=0).argmax())
            longer = factors.max(axis=1)
            longer[longer <= _KEPT] = 1.0
            if attempt >= _ROUNDS:
                longer[:] = longer.max()
            self._times = np.append(0.0, np.cumsum(spans_s * longer))

    def strain(self, speed: Floats, acceleration: Floats) -> Floats:
        """Return the (n, channels) factors by which motion must take longer to keep the limits.

        The eyes turn against the head, unless the track owns them.
        """
        for rate in (speed, acceleration):
            for head, eyes in enumerate(_EYES):
                rate[:, eyes] -= rate[:, head] * (eyes not in self.owned)
        by_speed = np.abs(speed) / self._bounds.speed
        by_acceleration = np.sqrt(np.abs(acceleration) / self._bounds.acceleration)
        strain: Floats = np.maximum(by_speed, by_acceleration)
        return strain

    def sample(self, times_s: Floats) -> Floats:
        """Return (3, n, channels) values, speeds and accelerations at (n,) times."""
        return self._curves.sample(times_s)

    def position_at(self, time_s: float) -> float:
        """Return the position in the track at a time since its start."""
        return float(np.interp(time_s, self._times, self._positions))

    def time_at(self, position_s: float) -> float:
        """Return the time since its start at a position."""
        return float(np.interp(position_s, self._positions, self._times))

    def blend_s(self, time_s: float, least_s: float, rising: bool) -> float:
        """Return the shortest time in which it can grow from rest or fade to it within limits.

        Args:
            time_s: Time since its start at which the blend begins.
            least_s: Shortest time.
            rising: Whether it grows.
        """
        for blend_s in least_s * 1.25 ** np.arange(16):
            times = np.linspace(0.0, blend_s, len(_GROWING))
            value = self.sample(time_s + times)[0] * (_GROWING if rising else _GROWING[::-1])
            speed = np.gradient(value, times, axis=0)
            if self.strain(speed, np.gradient(speed, times, axis=0)).max() <= _BLEND_STRAIN:
                break
        return float(blend_s)
