"""Motion of one track on one rig, on a clock that is slower only where a joint needs it."""

from bisect import bisect_right
from collections.abc import Callable, Sequence
from math import sqrt
from typing import NamedTuple

import numpy as np

from gazerig.gaze.track.minimum_jerk_curve import MinimumJerkCurve
from gazerig.gaze.types import Floats

_LEAD_IN_S = 0.02
"""Time from rest to the position at which a track begins in its middle, before it is slowed."""
_SHARES = np.unique([*np.linspace(0.0, 1.0, 25), 0.5 - sqrt(3.0) / 6.0, 0.5 + sqrt(3.0) / 6.0])
"""Places between two keys at which limits are checked: also those of the largest acceleration
between two rests."""
_BLOCK = 500
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


class TrackEvents(NamedTuple):
    """What a track does besides motion: times in s, increasing, and values."""

    looks: tuple[tuple[float, object], ...] = ()
    expressions: tuple[tuple[float, tuple[str, float]], ...] = ()
    cues: tuple[tuple[float, str], ...] = ()


class TrackMotion:
    """Curves of one track on one rig.

    Segments that are too fast for a joint take longer, the others keep their times. A track that
    begins in motion is led in from rest: the time that its first key needs comes before its
    beginning, at positions below it.

    curves: (channel, curve) pairs; a channel may have several
    duration_s, length_s: time of its motion, and the position at its end
    rate: mean speed of the position; ``speed`` if nothing behind the first key is slower
    slowed_by, slowest: factor by which it takes longer, and index of the joint that needs it, or -1

    Args:
        rows: its keys.
        channels: number of channels.
        owned: channels that it owns.
        events: gaze points, expressions and cues.
        strain: factors that the joints need.
        speed: factor on its defined speed.
        from_s: position at which it begins.
    """

    def __init__(
        self, rows: Sequence[ChannelKeys], channels: int, owned: frozenset[int],
        events: TrackEvents, strain: Strain, speed: float = 1.0, from_s: float = 0.0,
    ) -> None:  # fmt: skip
        self.owned, self.events, self.speed = owned, events, speed
        self._count, self._strain = channels, strain
        self._rows = [_cut(row, from_s) for row in rows] if from_s > 0.0 else rows
        self.channels = owned | {row.channel for row in rows}
        begin_s = from_s - _LEAD_IN_S if from_s > 0.0 else 0.0
        self._positions = np.unique(
            np.concatenate(([begin_s], *(row.times_s for row in self._rows)))
        )
        self._times = (self._positions - begin_s) / speed
        self.slowed_by, self.slowest = 1.0, -1
        # The way from rest to a position in the middle does not count as slower.
        first = int(from_s > 0.0)
        requested_s = np.ptp(self._times[first:])
        self._slow_down()
        if requested_s > 0.0:
            self.slowed_by = float(np.ptp(self._times[first:]) / requested_s)
        if len(self._times) > 1:
            self._positions[0] = self._positions[1] - self._times[1] * speed
        moved_s = float(np.ptp(self._positions))
        self.rate = round(moved_s / self._times[-1], 6) if moved_s else speed
        ends = [found[-1][0] for found in events if found]
        self.length_s = max([float(self._positions[-1]), *ends])
        self.duration_s = float(self._times[-1])
        self._events_s = [[at_s for at_s, _ in found] for found in events[:2]]

    def _slow_down(self) -> None:
        """Make the curves, with more time between keys where a joint would be too fast."""
        for attempt in range(_ROUNDS + 2):
            self.curves = [
                (
                    channel,
                    MinimumJerkCurve(
                        0.0,
                        np.interp(times_s, self._positions, self._times).tolist(),
                        values.tolist(),
                    ),
                )
                for channel, times_s, values in self._rows
            ]
            factors = self._factors()
            if factors.max(initial=1.0) <= _KEPT:
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
        return np.concatenate(found) if found else np.zeros((0, 1))

    def sample_at(self, times_s: Floats, delays_s: Sequence[float] = ()) -> Floats:
        """Return (3, n, channels) values, speeds and accelerations at (n,) times since its start.

        delays_s: of each channel; () for none
        """
        found: Floats = np.zeros((3, len(times_s), self._count))
        for channel, curve in self.curves:
            late_s = delays_s[channel] if delays_s else 0.0
            found[:, :, channel] += curve.sample_at(times_s - late_s)
        return found

    def position_at(self, time_s: float) -> float:
        """Return the position in the track at a time since its start."""
        later_s = max(0.0, time_s - self.duration_s)
        return float(np.interp(time_s, self._times, self._positions)) + later_s * self.speed

    def event_at(self, kind: int, position_s: float) -> int:
        """Return the index of the newest gaze point (0) or expression (1), -1 before the first."""
        return bisect_right(self._events_s[kind], position_s) - 1


def _cut(row: ChannelKeys, from_s: float) -> ChannelKeys:
    """Return the keys from a position on, the first of them there; the last one stays."""
    begins = MinimumJerkCurve(0.0, row.times_s.tolist(), row.values.tolist()).value_at(from_s)
    first_s = from_s + _LEAD_IN_S
    later = row.times_s > first_s
    later[-1] = True
    times_s = np.maximum(row.times_s[later], first_s)
    return ChannelKeys(
        row.channel, np.append(from_s, times_s), np.append(begins, row.values[later])
    )
