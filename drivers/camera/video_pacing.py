"""Pacing of a film in real time: the newest frame that is due, none twice."""

import threading
from collections.abc import Callable
from typing import NamedTuple

from gazerig.drivers.camera.video_timestamps import VideoTimestamps


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
