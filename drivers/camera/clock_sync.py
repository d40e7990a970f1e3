"""Conversion of a camera's clock to host time, with offset and drift from the least delayed frames.

Every frame arrives with a varying delay, never early. So the frame with the smallest difference
between arrival and stamp is the best estimate of the offset (the minimum filter of NTP's clock
filter, RFC 5905 section 10). Crystals differ by tens of ppm: the drift is the median of the slopes
between such best frames (Theil 1950, Sen 1968).
"""

from collections import deque
from math import isfinite
from statistics import median
from typing import NamedTuple

_BUCKET_S = 1.0  # one best frame is kept per bucket
_BUCKETS = 60
_LEAST_SPAN_S = 10.0  # shorter spans give no drift
_MOST_DRIFT = 300e-6  # crystals are better; more is an error
_JUMP_S = 0.1  # a larger deviation from the line is a clock that was set ...
_LASTING_S = 1.0  # ... if it lasts this long; a single frame may be late


class _BestFrame(NamedTuple):
    """The least delayed frame of a bucket: device time, and arrival minus device time."""

    device_s: float
    difference_s: float


class ClockSync:
    """Converter of stamps of one device clock; each is converted once, in order.

    jumps: number of detected jumps of the device clock
    """

    def __init__(self, least_delay_s: float = 0.0) -> None:
        self._least_delay_s = least_delay_s
        self._best: deque[_BestFrame] = deque(maxlen=_BUCKETS)
        self._bucket: int | None = None
        self._drift = 0.0
        self._offset_s = 0.0  # offset of the line at device time 0
        self._late_since_s: float | None = None
        self._last: tuple[float, float] | None = None  # device, host
        self.jumps = 0

    @property
    def drift_ppm(self) -> float:
        """Return how much faster the host's clock runs, ppm."""
        return self._drift * 1e6

    def host_s(self, device_s: float, arrived_s: float) -> float:
        """Return the host time of a device stamp whose frame has just arrived.

        Later stamps never result in earlier times, and no time is after the arrival.
        """
        difference_s = arrived_s - device_s
        if self._has_jumped(device_s, difference_s):
            # The clock is unknown again.
            self._best.clear()
            self._bucket, self._late_since_s, self._last = None, None, None
            self._drift, self._offset_s = 0.0, 0.0
            self.jumps += 1
        self._store(device_s, difference_s)
        host_s = device_s + self._fitted_difference_s(device_s) - self._least_delay_s
        if self._last is not None and device_s >= self._last[0]:
            host_s = max(host_s, self._last[1])
        host_s = min(host_s, arrived_s)
        self._last = device_s, host_s
        return host_s

    def _fitted_difference_s(self, device_s: float) -> float:
        """Return host minus device time at a device time."""
        return self._offset_s + self._drift * device_s

    def _has_jumped(self, device_s: float, difference_s: float) -> bool:
        """Return whether the clocks no longer match the line."""
        if self._last is None:
            return False
        off_s = difference_s - self._fitted_difference_s(device_s)
        if off_s <= _JUMP_S:
            self._late_since_s = None
            # A frame cannot arrive before its capture: the device's clock is ahead of the line.
            ahead = off_s < -_JUMP_S and len(self._best) > 1
            return ahead or device_s < self._last[0] - _JUMP_S
        arrived_s = device_s + difference_s
        if self._late_since_s is None:
            self._late_since_s = arrived_s
        # A device that restarted counts from 0.
        return device_s < self._last[0] or arrived_s - self._late_since_s > _LASTING_S

    def _store(self, device_s: float, difference_s: float) -> None:
        """Store a frame if it is the least delayed of its bucket, and fit the line again."""
        bucket = int(device_s // _BUCKET_S)
        new = _BestFrame(device_s, difference_s)
        if bucket != self._bucket:
            self._bucket = bucket
            self._drift = self._slope()  # uses only complete buckets
            self._best.append(new)
        elif self._without_drift_s(new) < self._without_drift_s(self._best[-1]):
            self._best[-1] = new
        else:
            return
        self._offset_s = min(self._without_drift_s(best) for best in self._best)

    def _without_drift_s(self, best: _BestFrame) -> float:
        """Return a frame's difference without the drift since device time 0."""
        return best.difference_s - self._drift * best.device_s

    def _slope(self) -> float:
        """Return the median slope between frames far enough apart."""
        best = list(self._best)
        if len(best) < 2:
            return self._drift
        span_s = best[-1].device_s - best[0].device_s
        if span_s < _LEAST_SPAN_S:
            return self._drift
        slopes = [
            (b.difference_s - a.difference_s) / (b.device_s - a.device_s)
            for i, a in enumerate(best)
            for b in best[i + 1 :]
            if b.device_s - a.device_s >= span_s / 2.0
        ]
        return max(-_MOST_DRIFT, min(_MOST_DRIFT, median(slopes)))


_WINDOW = 45
_LEAST = 15  # intervals before anything is reported
_TOLERANCE = 0.2
# A reader that was busy for less than this part of a frame period cannot have lost a frame.
_PROMPT = 0.5


class FrameRateMonitor:
    """Monitor that measures the frame rate and reports once if it differs from the stated one.

    Only intervals in which the reader was prompt count: a slow reader misses frames, which is not a
    fault of the camera.
    """

    def __init__(self, name: str, stated_hz: float) -> None:
        self._name = name
        self._stated_hz = stated_hz if isfinite(stated_hz) and stated_hz > 0.0 else 0.0
        self._intervals_s: deque[float] = deque(maxlen=_WINDOW)
        self._before_s: float | None = None
        self._reported = False

    @property
    def measured_hz(self) -> float | None:
        """Return the measured rate, None before there are enough frames."""
        if len(self._intervals_s) < _LEAST:
            return None
        return 1.0 / median(self._intervals_s)

    def update(self, captured_s: float, away_s: float) -> str:
        """Add a frame; return a line when the rate becomes wrong or right again, otherwise "".

        Args:
            captured_s: Time of its capture, seconds.
            away_s: Time for which the reader was busy before it, seconds.
        """
        before_s, self._before_s = self._before_s, captured_s
        if before_s is None or captured_s <= before_s:
            return ""
        if away_s <= _PROMPT * (captured_s - before_s) and (
            self._stated_hz == 0.0 or away_s <= _PROMPT / self._stated_hz
        ):
            self._intervals_s.append(captured_s - before_s)
        rate_hz = self.measured_hz
        if rate_hz is None or self._stated_hz == 0.0:
            return ""
        lies = abs(rate_hz / self._stated_hz - 1.0) > _TOLERANCE
        if lies == self._reported:
            return ""
        self._reported = lies
        if not lies:
            return f"{self._name} delivers {rate_hz:.1f} frames a second again, as stated"
        return (
            f"{self._name} states {self._stated_hz:g} frames a second and delivers {rate_hz:.1f}: "
            "the times of its frames are measured; more light makes many cameras faster"
        )
