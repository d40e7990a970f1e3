"""Motion of one track on one rig: curves through its keys, slower only where a joint needs it.

Between two keys every value is a polynomial of fifth order (Flash and Hogan 1985: least jerk from
rest to rest). At a reversal, a held value and both ends it rests. Elsewhere it passes a key at the
speed of a parabola through it and its neighbours, but at most so fast that the control points of
the curve do not turn back: then the curve does not either.
"""

from collections.abc import Iterable, Sequence
from functools import reduce

import numpy as np
from numpy.polynomial.polynomial import polyder, polyval
from numpy.typing import NDArray

from gazerig.gaze.minimum_jerk import min_jerk
from gazerig.gaze.track.track import EYES, TrackState
from gazerig.gaze.types import Floats

_MOST_OF_MEAN = 1.25
"""Largest speed at a key as a share of the slower mean speed beside it: 2/5 of the sum of both
speeds of a segment is less than its mean speed, so its control points are in order."""
_ENDS = np.array([polyval(end, polyder(np.eye(6), k)) for end in (0.0, 1.0) for k in range(3)])
"""Value, speed and acceleration at both ends of a unit of time, of the powers 0 to 5 of time."""
_SHARES = np.linspace(0.0, 1.0, 25)
"""Places between two keys at which limits are checked."""
_ROUNDS, _KEPT = 20, 1.0 + 1e-3
"""Most corrections of the segments, and the ratio to a limit that counts as kept."""
_GROWING = np.array([min_jerk(share) for share in np.linspace(0.0, 1.0, 81)])[:, None]
"""Share of a track in the motion while it grows from rest."""
_BLEND_STRAIN = 1.09
"""Factor that joints may need in a blend, which may use more of their limits than a motion."""

ChannelKeys = tuple[int, Floats, Floats]
"""Channel, and the times and values relative to rest of its keys; the first is rest at time 0."""


def key_states(times_s: Floats, values: Floats) -> Floats:
    """Return the (3, n) values, speeds and accelerations at n keys from rest to rest."""
    mean = np.diff(values) / np.diff(times_s)
    slower = np.minimum(np.abs(mean[:-1]), np.abs(mean[1:])) * (mean[:-1] * mean[1:] > 0.0)
    most = _MOST_OF_MEAN * np.pad(slower, 1)
    speed = np.clip(np.gradient(values, times_s), -most, most)
    return np.stack((values, speed, np.zeros(len(values))))


class Curves:
    """Curves of several values through common knots; before and behind them they rest.

    Args:
        knots_s: (n,) increasing times.
        states: (3, n, values) values, speeds and accelerations at these times.
    """

    def __init__(self, knots_s: Floats, states: Floats) -> None:
        self._knots_s, self._spans_s = knots_s, np.diff(knots_s)[:, None]
        scales = self._spans_s ** np.arange(3)[:, None, None]
        ends = np.concatenate((states[:, :-1] * scales, states[:, 1:] * scales))
        powers = np.tensordot(np.linalg.inv(_ENDS).round(3), ends, 1)
        self._powers = [polyder(powers, k) / scales[k] for k in range(3)]

    def sample(self, times_s: Floats) -> Floats:
        """Return (3, k, values) values, speeds and accelerations at (k,) times."""
        i = np.searchsorted(self._knots_s[1:-1], times_s, side="right")
        share = np.clip((times_s - self._knots_s[i])[:, None] / self._spans_s[i], 0.0, 1.0)
        return np.stack([polyval(share, powers[:, i], tensor=False) for powers in self._powers])


class Motion:
    """Curves of one track on one rig.

    Segments that are too fast for a joint take longer, the others keep their times. A track that
    begins in motion is led in from rest: the time that its first key needs comes before its
    beginning, at positions below it.

    Args:
        keys: Its keys, of any channels in any order.
        marks_s: Further positions: cues, and the end of its sound.
        limits: (2, channels) greatest speeds and accelerations.
        owned: (channels,) whether it owns a channel.
        speed: Factor on its defined speed.

    Attributes:
        state: What is known of it before it is played, at the position at which it begins.
        mouth: (2, n) times and openings of the mouth of a speech.
        curves: The curves of all channels.
        channels: (channels,) whether it moves or owns a channel.
        duration_s: Duration.
        length_s: Last position.
        rate: Mean speed of the position; ``speed`` if nothing behind the first key is slower.
        slowest: Channel that is nearest to its limits.
    """

    state: TrackState
    mouth: Floats

    def __init__(
        self, keys: Sequence[ChannelKeys], marks_s: Iterable[float], limits: Floats,
        owned: NDArray[np.bool], speed: float,
    ) -> None:  # fmt: skip
        self.owned, self._limits = owned, limits
        self.channels = owned.copy()
        self.channels[[channel for channel, _, _ in keys]] = True
        times = [times_s for _, times_s, _ in keys]
        self._positions = np.unique(np.concatenate(([0.0, *marks_s], *times)))
        self._times = self._positions / speed
        self._slow_down(keys)
        self.duration_s, self.length_s = float(self._times[-1]), float(self._positions[-1])
        self._positions[0] = self._positions[1] - self._times[1] * speed
        self.rate = round(float(np.ptp(self._positions)) / self.duration_s, 6)

    def _slow_down(self, keys: Sequence[ChannelKeys]) -> None:
        """Make the curves, with more time between keys where a joint would be too fast."""
        for _ in range(_ROUNDS):
            states = np.zeros((3, len(self._times), len(self.owned)))
            for channel, times_s, values in keys:
                knots_s = np.interp(times_s, self._positions, self._times)
                curve = Curves(knots_s, key_states(knots_s, values)[:, :, None])
                states[:, :, channel] += curve.sample(self._times)[:, :, 0]
            self.curves = Curves(self._times, states)
            begins_s, spans_s = self._times[:-1], np.diff(self._times)
            every = (self.strain(self.curves.sample(begins_s + k * spans_s)[1:]) for k in _SHARES)
            factors = reduce(np.maximum, every)
            self.slowest = int(factors.max(axis=0).argmax())
            longer = factors.max(axis=1)
            if longer.max() <= _KEPT:
                break
            spans_s *= np.where(longer > _KEPT, longer, 1.0)
            self._times = np.append(0.0, np.cumsum(spans_s))

    def strain(self, rates: Floats) -> Floats:
        """Return the (n, channels) factors by which motion must take longer to keep the limits.

        The eyes turn against the head, unless the track owns them.

        Args:
            rates: (2, n, channels) speeds and accelerations.
        """
        rates = rates.copy()
        rates[:, :, EYES] -= rates[:, :, :2] * ~self.owned[EYES]
        by_speed, by_acceleration = np.abs(rates) / self._limits[:, None]
        strain: Floats = np.maximum(by_speed, np.sqrt(by_acceleration))
        return strain

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
            value = self.curves.sample(time_s + times)[0] * (_GROWING if rising else _GROWING[::-1])
            speed = np.gradient(value, times, axis=0)
            rates = np.stack((speed, np.gradient(speed, times, axis=0)))
            if self.strain(rates).max() <= _BLEND_STRAIN:
                break
        return float(blend_s)
