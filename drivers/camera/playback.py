"""Playback of a camera recording: the same frames at the same intervals."""

import threading
from collections.abc import Callable
from pathlib import Path
from statistics import median

from gazerig.drivers.camera.recording_reader import Recording
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.camera.video_pacing import VideoPacing
from gazerig.drivers.camera.video_timestamps import VideoTimestamps
from gazerig.drivers.errors import CameraError

_ALONE_S = 0.1  # duration of a recording of one frame


class CameraReplay:
    """A recording, repeated forever like a film; film time starts at 0 with frame 1."""

    def __init__(self, path: str | Path) -> None:
        """Set the path; nothing is opened yet."""
        self._path = Path(path).expanduser()
        self._recording: Recording | None = None
        self._times = VideoTimestamps(1.0)
        self._pace = VideoPacing()
        self._unreported = ""

    def open(self) -> None:
        """Open the file, or open it again at film time 0.

        Raises:
            CameraError: it is absent, no recording, or contains no frame.
        """
        self.close()
        self._recording = Recording(self._path)
        starts = self._recording.times_s
        steps = [b - a for a, b in zip(starts, starts[1:], strict=False)]
        length_s = starts[-1] + (median(steps) if steps else _ALONE_S)
        self._times = VideoTimestamps(len(starts) / length_s, starts, length_s)
        self._pace, self._unreported = VideoPacing(), self._recording.note

    @property
    def length_s(self) -> float:
        """Return the duration of one repeat, seconds."""
        self._opened()
        return self._times.length_s

    def due_s(self, number: int) -> float:
        """Return the film time at which a frame is due."""
        self._opened()
        return self._times.due_s(number)

    def shot(self, number: int) -> Shot:
        """Read a frame by number, with the film time at which it is due.

        Raises:
            CameraError: the file is damaged there.
        """
        recording = self._opened()
        found = recording.shot((number - 1) % len(recording.times_s))
        return found._replace(captured_s=self._times.due_s(number), number=number)

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait until the next frame is due, then read the newest; time starts here.

        Raises:
            CameraError: the file is damaged there.
        """
        self._opened()
        due = self._pace.wait(self._times, now_s, stop)
        return None if due is None else self.shot(due.number)._replace(captured_s=due.host_s)

    def events(self) -> tuple[str, ...]:
        """Return problems of the file, one line each, once."""
        message, self._unreported = self._unreported, ""
        return (message,) if message else ()

    def close(self) -> None:
        """Free the file; safe to call twice."""
        if self._recording is not None:
            self._recording.close()
        self._recording = None

    def _opened(self) -> Recording:
        """Return the open file."""
        if self._recording is None:
            raise CameraError(f"{self._path} is not open: call open() before reading")
        return self._recording
