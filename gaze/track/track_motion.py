"""Motion of one track on one rig, slower only where a joint needs it."""

from collections.abc import Callable, Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from gazerig.gaze.track.minimum_jerk_curve import evaluate, key_states
from gazerig.gaze.track.track import Track
from gazerig.gaze.types import Floats

_SHARES = np.unique([*np.linspace(0.0, 1.0, 25), 0.5 - sqrt(3.0) / 6.0, 0.5 + sqrt(3.0) / 6.0])
"""Places between two keys at which limits are checked: also those of the largest acceleration
between two rests."""
_BLOCK = 500
_LEAST_S = 0.02
"""Length of a track that has no motion of its own."""
_BLEND_STRAIN = 1.09
"""Factor that joints may need in a blend, which may use more of their limits than a motion."""
_ROUNDS, _KEPT = 12, 1.0 + 1e-3
"""Most corrections of the times between keys, and the ratio to a limit at which they end."""

Strain = Callable[[Floats, Floats], Floats]
"""Returns the (n, joints) factors by which (n, channels) speeds and accelerations must take longer
to keep the joints' limits, at most 1 if they keep them."""


class ChannelKeys(NamedTuple):
    """Keys of one channel: times, and values relative to rest."""

    channel: int
    times_s: Floats
    values: Floats


class TrackMotion:
    """Curves of one track on one rig.

    Segments that are too fast for a joint take longer, the others keep their times. A track that
    begins in motion is led in from rest: the time that its first key needs comes before its
    beginning, at positions below it.

    Args:
        track: The track.
        rows: Its keys.
        count: Number of channels of the rig.
        owned: Channels that it owns.
        strain: Factors that the joints need.
        speed: Factor on its defined speed.
        sound_s: Duration of its sound, 0 without one.

    Attributes:
        channels: Channels that it moves or owns.
        moves: Whether there are any.
        mouth: Times and openings of the mouth of a speech, None without one.
        lead_s: Time by which the openings must be ahead of the sound.
        rate: Mean speed of the position; ``speed`` if nothing behind the first key is slower.
        slowed_by: Factor by which it takes longer.
        slowest: Index of the joint that needs this, or -1.
        length_s: Position at its end.
        duration_s: Time from its start to its end.
    """

    def __init__(
        self, track: Track, rows: Sequence[ChannelKeys], count: int, owned: frozenset[int],
        strain: Strain, speed: float = 1.0, sound_s: float = 0.0,
    ) -> None:  # fmt: skip
        self.track, self.owned, self.sound_s, self.speed = track, owned, sound_s, speed
        self.channels = owned | {row.channel for row in rows}
        self.moves = bool(rows or owned)
        self.mouth: tuple[Floats, Floats] | None = None
        self.lead_s = 0.0
        self.cues = sorted((time_s, name) for name, time_s in track.cues.items())
        rows = rows or (ChannelKeys(0, np.array([_LEAST_S]), np.zeros(1)),)
        self._positions = np.unique(np.concatenate(([0.0], *(row.times_s for row in rows))))
        self._times, self._count, self._strain = self._positions / speed, count, strain
        self._slow_down(rows)
        self.slowed_by = float(self._times[-1] * speed / self._positions[-1])
        self._positions[0] = self._positions[1] - self._times[1] * speed
        self.rate = round(float(np.ptp(self._positions) / self._times[-1]), 6)
        last_s = float(self._positions[-1])
        self.length_s = max([last_s, sound_s, *(time_s for time_s, _ in self.cues)])
        self.duration_s = float(self._times[-1]) + (self.length_s - last_s) / speed

    def _slow_down(self, rows: Sequence[ChannelKeys]) -> None:
        """Make the curves, with more time between keys where a joint would be too fast."""
        self.slowest = -1
        for attempt in range(_ROUNDS + 2):
            self._states: Floats = np.zeros((3, self._count, len(self._times)))
            for row in rows:
                times_s = np.interp(row.times_s, self._positions, self._times)
                knots, states = key_states(times_s, row.values)
                self._states[:, row.channel] += evaluate(knots, states, self._times)
            factors = self._factors()
            if factors.max() <= _KEPT:
                return
            if self.slowest < 0:
                self.slowest = int(factors.max(axis=0).argmax())
            longer = factors.max(axis=1)
            longer[longer <= _KEPT] = 1.0
            if attempt >= _ROUNDS:
                longer[:] = longer.max()
            self._times = np.append(0.0, np.cumsum(np.diff(self._times) * longer))

    def _factors(self) -> Floats:
        """Return the (spans, joints) factors of the times between two keys."""
        begins, spans = self._times[:-1, None], np.diff(self._times)[:, None]
        found = []
        for i in range(0, len(spans), _BLOCK):
            times = begins[i : i + _BLOCK] + spans[i : i + _BLOCK] * _SHARES
            _, speed, acceleration = self.sample_at(times.ravel())
            factors = self._strain(speed, acceleration)
            found.append(factors.reshape(*times.shape, -1).max(axis=1))
        return np.concatenate(found)

    def sample_at(self, times_s: Floats) -> Floats:
        """Return (3, n, channels) values, speeds and accelerations at (n,) times."""
        return evaluate(self._times, self._states, times_s).swapaxes(1, 2)

    def position_at(self, time_s: float) -> float:
        """Return the position in the track at a time since its start."""
        later_s = max(0.0, time_s - float(self._times[-1]))
        return float(np.interp(time_s, self._times, self._positions)) + later_s * self.speed

    def time_at(self, position_s: float) -> float:
        """Return the time since its start at a position."""
        later_s = max(0.0, position_s - float(self._positions[-1]))
        return float(np.interp(position_s, self._positions, self._times)) + later_s / self.speed

    def blend_s(self, time_s: float, least_s: float, rising: bool) -> float:
        """Return the shortest time in which it can grow from rest or fade to it within limits.

        Args:
            time_s: Time since its start at which the blend begins.
            least_s: Shortest time.
            rising: Whether it grows.
        """
        for blend_s in [1.25**i * least_s for i in range(16)]:
            times = np.linspace(0.0, blend_s, 81)
            s = times / blend_s
            weight = s**3 * (10.0 + s * (6.0 * s - 15.0))
            value = (
                self.sample_at(time_s + times)[0] * (weight if rising else 1.0 - weight)[:, None]
            )
            speed = np.gradient(value, times, axis=0)
            acceleration = np.gradient(speed, times, axis=0)
            if self._strain(speed, acceleration).max() <= _BLEND_STRAIN:
                break
        return blend_s
