"""A film or still frame as an endless source of frames.

Film time starts at 0 with frame 1 and continues through every repeat, as do frame numbers. Frames
are only read forward. A still frame repeats ten times a second.
"""

import threading
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.camera.source import Shot
from gazerig.drivers.camera.video_pacing import VideoPacing
from gazerig.drivers.camera.video_reader import VideoReader, open_video
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import ImageArray


class VideoFrame(NamedTuple):
    """A frame of a film: its number from 1, its due film time and the image (read-only)."""

    number: int
    film_time_s: float
    image: ImageArray


class VideoFile:
    """A film or still frame, repeated forever."""

    def __init__(self, path: str | Path) -> None:
        """Set the path; nothing is opened yet."""
        self._path = Path(path).expanduser()
        self._reel: VideoReader | None = None
        self._pace = VideoPacing()
        self._unreported = ""

    def open(self) -> None:
        """Open the file, or open it again at film time 0.

        Raises:
            CameraError: it is absent, no film or frame, empty or cut short.
        """
        self.close()
        self._reel = open_video(self._path)
        self._pace = VideoPacing()
        self._unreported = self._reel.times.note

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return self._opened().times.rate_hz

    @property
    def note(self) -> str:
        """Assumptions about the file in one line, or ""."""
        return self._opened().times.note

    def due_s(self, number: int) -> float:
        """Return the film time at which a frame is due."""
        return self._opened().times.due_s(number)

    def number_at(self, film_s: float) -> int:
        """Return the number of the newest frame at a film time; below 1 before the first."""
        return self._opened().times.number_at(film_s)

    def image(self, number: int) -> ImageArray:
        """Read a frame by number: (height, width, 3) BGR, read-only.

        Raises:
            ValueError: the number is below 1 or below the last one read.
            CameraError: the file cannot be read any more.
        """
        return self._opened().image(number)

    def shot(self, number: int) -> Shot:
        """Read a frame by number with the film time at which it is due.

        Raises:
            ValueError: the number is below 1 or below the last one read.
            CameraError: the file cannot be read any more.
        """
        return Shot(self.due_s(number), number, self.image(number))

    def frame_at(self, film_s: float) -> VideoFrame:
        """Read the newest frame at a film time (0 or later, never decreasing).

        Raises:
            ValueError: film time is negative or decreased.
            CameraError: the file cannot be read any more.
        """
        number = self.number_at(film_s)
        return VideoFrame(number, self.due_s(number), self.image(number))

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait until the next frame is due, then read the newest; the film starts here.

        Raises:
            CameraError: the file cannot be read any more.
        """
        due = self._pace.wait(self._opened().times, now_s, stop)
        return None if due is None else Shot(due.host_s, due.number, self.image(due.number))

    def events(self) -> tuple[str, ...]:
        """Return assumptions about the file, one line each, once."""
        message, self._unreported = self._unreported, ""
        return (f"{self._path.name}: {message}",) if message else ()

    def close(self) -> None:
        """Free the file; safe to call twice."""
        if self._reel is not None:
            self._reel.close()
        self._reel = None

    def _opened(self) -> VideoReader:
        """Return the open file."""
        if self._reel is None:
            raise CameraError(f"{self._path} is not open: call open() before reading")
        return self._reel
