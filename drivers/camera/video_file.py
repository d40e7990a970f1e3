"""A film or still frame as an endless source of frames.

Film time starts at 0 with frame 1 and continues through every repeat, as do frame numbers. Frames
are only read forward. A still frame repeats ten times a second.
"""

import threading
from bisect import bisect_right
from collections.abc import Callable, Sequence
from math import isfinite
from pathlib import Path
from statistics import median
from typing import Any, NamedTuple, Protocol

import cv2
import numpy as np

from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.camera.source import Shot, to_bgr
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import ImageArray

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
        # Rounding may pass the due time, so only due_s is compared.
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


def timestamps_from_rate(
    stated_hz: float, note: str, times_s: Sequence[float]
) -> VideoTimestamps | None:
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
        "the times of its frames are used",
    )


def timestamps_from_times(times_s: Sequence[float]) -> VideoTimestamps:
    """Return a table of the times; the last frame lasts as long as most frames do."""
    starts = tuple(t - times_s[0] for t in times_s)
    last_s = median(b - a for a, b in zip(starts, starts[1:], strict=False))
    length_s = starts[-1] + last_s
    rate_hz = len(starts) / length_s
    return VideoTimestamps(
        rate_hz,
        starts,
        length_s,
        f"the film's frames are unevenly spaced, {rate_hz:.3g} a second on average: "
        "the times of its frames are used",
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


_STILL_RATE_HZ, _ASSUMED_RATE_HZ = 10.0, 25.0
_RATES_HZ = (0.5, 1000.0)
# The header of an undamaged file may state a few frames too many.
_LEAST_COMPLETE = 0.95
_MOST_TIMES = 20_000  # frames of an uneven film whose times are read at the start


class VideoReader(Protocol):
    """An open film or still.

    times: due times of its frames, and assumptions about them
    """

    times: VideoTimestamps

    def image(self, number: int) -> ImageArray:
        """Return a frame, counted through all repeats, not before the last one returned."""

    def close(self) -> None:
        """Free the file."""


def open_video(path: Path) -> VideoReader:
    """Open a file as a film or a still frame.

    Raises:
        CameraError: it is absent, is not a film or image, is empty or is cut short.
    """
    if not path.exists():
        raise CameraError(f"no film or image at {path}: check the path")
    if not path.is_file():
        raise CameraError(f"{path} is not a file: name a film or an image in it")
    try:
        path.open("rb").close()
    except OSError as error:
        raise CameraError(
            f"cannot read {path} ({error.strerror}): check its permissions"
        ) from error
    # A GIF is a film; OpenCV's image reader would return only its first frame.
    still = path.suffix.lower() != ".gif" and cv2.haveImageReader(str(path))
    return _StillReader(path) if still else _FilmReader(path)


def usable_rate_hz(stated_hz: float) -> tuple[float, str]:
    """Return the frame rate to use, and a note if the stated one is invalid."""
    low, high = _RATES_HZ
    if isfinite(stated_hz) and low <= stated_hz <= high:
        return stated_hz, ""
    return _ASSUMED_RATE_HZ, (
        f"the film states a rate of {stated_hz:g} frames a second; {_ASSUMED_RATE_HZ:g} assumed"
    )


class _StillReader:
    """A still frame."""

    times = VideoTimestamps(_STILL_RATE_HZ)

    def __init__(self, path: Path) -> None:
        """Decode the frame."""
        try:
            with quiet_opencv():
                image = cv2.imread(str(path), cv2.IMREAD_COLOR)
        except cv2.error as error:
            raise CameraError(f"{path} is too large an image: scale it down") from error
        if image is None:
            raise CameraError(f"{path} is a damaged image: copy or save it again")
        self._image = _read_only_bgr(image, path)
        self._last = 1

    def image(self, number: int) -> ImageArray:
        """Return the frame."""
        _check_forward(number, self._last)
        self._last = number
        return self._image

    def close(self) -> None:
        """Do nothing."""


class _FilmReader:
    """A film that is repeated forever."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._capture = _open_film(path)
        stated = usable_rate_hz(self._capture.get(cv2.CAP_PROP_FPS))
        first_s = _times_s(self._capture, SAMPLE)
        if not first_s:
            raise CameraError(f"{path} contains no readable frame: use another file")
        times = timestamps_from_rate(*stated, ascending_times(first_s))
        if times is None:
            times = timestamps_from_times(
                ascending_times(first_s + _times_s(self._capture, _MOST_TIMES))
            )
        elif times.rate_hz == stated[0]:
            # The stated number of frames is often the length times the rate: if the rate is wrong,
            # so is the number.
            frames = int(self._capture.get(cv2.CAP_PROP_FRAME_COUNT))
            if frames > len(first_s):
                self._capture.set(cv2.CAP_PROP_POS_FRAMES, frames - 1)
                reached = frames
                if not self._capture.grab():
                    reached = int(self._capture.get(cv2.CAP_PROP_POS_FRAMES))
                if reached < _LEAST_COMPLETE * frames:
                    raise CameraError(
                        f"{path} is cut short after {reached} of {frames} frames: "
                        "copy it again or convert it"
                    )
        self.times = times
        self._rewind()
        self._number, self._index = 0, 0  # last frame reached, and its index in this repeat
        self._length: int | None = None  # known after the first repeat
        self._seen: tuple[int, ImageArray] | None = None

    def image(self, number: int) -> ImageArray:
        """Read up to a frame; frames before it are decoded but not converted."""
        _check_forward(number, max(1, self._number))
        if self._seen is None or self._seen[0] != number:
            while self._number < number:
                # Reading continues at the start after the end; whole repeats are skipped.
                if not self._capture.grab():
                    self._length, self._index = self._index, 0
                    self._rewind()
                    if not self._capture.grab():
                        raise CameraError(
                            f"{self._path} cannot be read any more: check that the file still exists"
                        )
                self._number, self._index = self._number + 1, self._index + 1
                if self._length:
                    self._number += (number - self._number) // self._length * self._length
            found, image = self._capture.retrieve()
            if not found:
                raise CameraError(f"frame {self._index} of {self._path} is damaged: copy it again")
            self._seen = number, _read_only_bgr(image, self._path)
        return self._seen[1]

    def close(self) -> None:
        """Free the file."""
        self._capture.release()

    def _rewind(self) -> None:
        """Start again; reopening is exact, while seeking back may not be."""
        self._capture.release()
        self._capture = _open_film(self._path)


def _open_film(path: Path) -> cv2.VideoCapture:
    """Open a film with FFmpeg, the only reader that does not treat a name as a pattern."""
    with quiet_opencv():
        capture = cv2.VideoCapture(str(path), cv2.CAP_FFMPEG)
    if not capture.isOpened():
        raise CameraError(
            f"{path} is not a readable film or image (or is cut short): "
            "play it in another program, convert it to mp4 or copy it again"
        )
    return capture


def _times_s(capture: cv2.VideoCapture, most: int) -> list[float]:
    """Read frames and return their time stamps, seconds."""
    found: list[float] = []
    for _ in range(most):
        if not capture.grab():
            break
        found.append(capture.get(cv2.CAP_PROP_POS_MSEC) / 1e3)
    return found


def _check_forward(number: int, least: int) -> None:
    """Reject frames before the last one."""
    if number < least:
        raise ValueError(
            f"films are read forward: frame {number} requested, {least} is the first possible one"
        )


def _read_only_bgr(image: Any, path: Path) -> ImageArray:
    """Return a frame as a read-only BGR array."""
    pixels = to_bgr(image)
    if pixels is None:
        raise CameraError(f"{path} contains pictures of an unknown kind: convert it to mp4 or png")
    return pixels


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
        self._reader: VideoReader | None = None
        self._pace = VideoPacing()
        self._unreported = ""

    def open(self) -> None:
        """Open the file, or open it again at film time 0.

        Raises:
            CameraError: it is absent, is not a film or image, is empty or is cut short.
        """
        self.close()
        self._reader = open_video(self._path)
        self._pace = VideoPacing()
        self._unreported = self._reader.times.note

    @property
    def rate_hz(self) -> float:
        """Frames per second."""
        return self._require_reader().times.rate_hz

    @property
    def note(self) -> str:
        """Assumptions about the file in one line, or ""."""
        return self._require_reader().times.note

    def due_s(self, number: int) -> float:
        """Return the film time at which a frame is due."""
        return self._require_reader().times.due_s(number)

    def number_at(self, film_s: float) -> int:
        """Return the number of the newest frame at a film time; below 1 before the first."""
        return self._require_reader().times.number_at(film_s)

    def image(self, number: int) -> ImageArray:
        """Read a frame by number: (height, width, 3) BGR, read-only.

        Raises:
            ValueError: the number is below 1 or below the last one read.
            CameraError: the file cannot be read any more.
        """
        return self._require_reader().image(number)

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
        due = self._pace.wait(self._require_reader().times, now_s, stop)
        return None if due is None else Shot(due.host_s, due.number, self.image(due.number))

    def events(self) -> tuple[str, ...]:
        """Return assumptions about the file, one line each, once."""
        message, self._unreported = self._unreported, ""
        return (f"{self._path.name}: {message}",) if message else ()

    def close(self) -> None:
        """Free the file; safe to call twice."""
        if self._reader is not None:
            self._reader.close()
        self._reader = None

    def _require_reader(self) -> VideoReader:
        """Return the open file."""
        if self._reader is None:
            raise CameraError(f"{self._path} is not open: call open() before reading")
        return self._reader
