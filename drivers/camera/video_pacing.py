"""Showing a film in real time: the newest frame that is due, none twice."""

import threading
from collections.abc import Callable
from typing import NamedTuple

from gazerig.drivers.camera.video_timestamps import VideoTimestamps


class Due(NamedTuple):
    """A frame that is due: its number, and the host time at which it was."""

    number: int
    host_s: float


class VideoPacing:
    """Film time begins at the first wait and runs with the host's clock."""

    def __init__(self) -> None:
        self._zero_s: float | None = None
        self._taken = 0

    def wait(
        self, times: VideoTimestamps, now_s: Callable[[], float], stop: threading.Event
    ) -> Due | None:
        """Wait until the next frame is due and return the newest; None if stopped."""
        if self._zero_s is None:
            self._zero_s = now_s()
        wait_s = self._zero_s + times.due_s(self._taken + 1) - now_s()
        if stop.wait(max(0.0, wait_s)):
            return None
        # A wait may end a shade early; the frame waited for is the least that is given.
        self._taken = max(self._taken + 1, times.number_at(now_s() - self._zero_s))
        return Due(self._taken, self._zero_s + times.due_s(self._taken))
