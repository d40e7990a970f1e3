"""Due times of a film's frames: from its rate, or from a table if frames are unevenly spaced.

The container's rate is checked against the time stamps of its frames.
"""

import threading
from bisect import bisect_right
from collections.abc import Callable, Sequence
from statistics import median
from typing import NamedTuple

import numpy as np

SAMPLE = 100
"""Number of frames that are checked; only if these are uneven, all are."""
_LEAST = 8
# Containers round times, but by less than half a frame.
_UNEVEN = 0.5
_LIE = 0.02


class VideoTimestamps(NamedTuple):
    """Due times of a film that is repeated forever; numbers begin at 1.

    rate_hz: frames per second, the mean if they are uneven
    starts_s: due time of each frame of one repeat, or () if the rate is constant
    length_s: duration of one repeat, if there is a table
    note: information for the user, or ""
    """

    rate_hz: float
    starts_s: tuple[float, ...] = ()
    length_s: float = 0.0
    note: str = ""

    def due_s(self, number: int) -> float:
        """Return the film time at which a frame is due."""
        if not self.starts_s:
            return (number - 1) / self.rate_hz
        showing, index = divmod(number - 1, len(self.starts_s))
        return showing * self.length_s + self.starts_s[index]

    def number_at(self, film_s: float) -> int:
        """Return the number of the newest frame at a film time; below 1 before the first."""
        if not self.starts_s:
            number = int(film_s * self.rate_hz) + 1
        else:
            showing = int(film_s // self.length_s)
            rest_s = film_s - showing * self.length_s
            number = showing * len(self.starts_s) + bisect_right(self.starts_s, rest_s)
        # Rounding may cross a due time; only due_s decides.
        while self.due_s(number + 1) <= film_s:
            number += 1
        while self.due_s(number) > film_s:
            number -= 1
        return number


def is_even(times_s: Sequence[float], rate_hz: float) -> bool:
    """Return whether frames have a constant rate, except for rounding; too few count as even."""
    if len(times_s) < _LEAST:
        return True
    off = np.asarray(times_s) - times_s[0] - np.arange(len(times_s)) / rate_hz
    return bool(np.max(np.abs(off - np.median(off))) < _UNEVEN / rate_hz)


def ascending_times(times_s: Sequence[float]) -> list[float]:
    """Return ascending times, with wrong ones corrected; [] if few are right.

    The last frame of a film often has no time stamp.
    """
    steps = [b - a for a, b in zip(times_s, times_s[1:], strict=False) if b > a]
    if len(steps) < len(times_s) // 2:
        return []
    usual_s, right = median(steps) if steps else 0.0, list(times_s[:1])
    for time_s in times_s[1:]:
        right.append(time_s if time_s > right[-1] else right[-1] + usual_s)
    return right


def measured_rate_hz(times_s: Sequence[float]) -> float | None:
    """Return the rate of evenly spaced frames, otherwise None."""
    if len(times_s) < _LEAST:
        return None
    rate_hz = (len(times_s) - 1) / (times_s[-1] - times_s[0])
    return rate_hz if is_even(times_s, rate_hz) else None


def from_rate(stated_hz: float, note: str, times_s: Sequence[float]) -> VideoTimestamps | None:
    """Return time stamps based on the first frames; None if they are uneven.

    stated_hz, note: the rate from the container's header, and assumptions about it
    """
    if is_even(times_s, stated_hz) and (not note or measured_rate_hz(times_s) is None):
        return VideoTimestamps(stated_hz, note=note)
    rate_hz = measured_rate_hz(times_s)
    if rate_hz is None:
        return None
    if abs(rate_hz / stated_hz - 1.0) < _LIE:
        return VideoTimestamps(stated_hz)
    return VideoTimestamps(
        rate_hz,
        note=f"the film states {stated_hz:g} frames a second and shows {rate_hz:.4g}: "
        "the times of its frames count",
    )


def from_frame_times(times_s: Sequence[float]) -> VideoTimestamps:
    """Return a table of the times; the last frame lasts as long as most frames do."""
    starts = tuple(t - times_s[0] for t in times_s)
    last_s = median(b - a for a, b in zip(starts, starts[1:], strict=False))
    length_s = starts[-1] + last_s
    rate_hz = len(starts) / length_s
    return VideoTimestamps(
        rate_hz,
        starts,
        length_s,
        f"the film's frames come unevenly, {rate_hz:.3g} a second in the mean: "
        "the times of its frames count",
    )


class DueFrame(NamedTuple):
    """A due frame: its number, and the host time at which it was due."""

    number: int
    host_s: float


class VideoPacing:
    """Film time that begins at the first wait and follows the host's clock."""

    def __init__(self) -> None:
        self._zero_s: float | None = None
        self._taken = 0

    def wait(
        self, times: VideoTimestamps, now_s: Callable[[], float], stop: threading.Event
    ) -> DueFrame | None:
        """Wait until the next frame is due and return the newest; None if stopped."""
        if self._zero_s is None:
            self._zero_s = now_s()
        wait_s = self._zero_s + times.due_s(self._taken + 1) - now_s()
        if stop.wait(max(0.0, wait_s)):
            return None
        # A wait may end slightly early; at least the awaited frame is returned.
        self._taken = max(self._taken + 1, times.number_at(now_s() - self._zero_s))
        return DueFrame(self._taken, self._zero_s + times.due_s(self._taken))
