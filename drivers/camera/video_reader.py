"""Readers of films and still frames, read forward by number and repeated forever."""

from math import isfinite
from pathlib import Path
from typing import Any, Protocol

import cv2

from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.camera.source import to_bgr
from gazerig.drivers.camera.video_timestamps import (
    SAMPLE,
    VideoTimestamps,
    ascending_times,
    from_frame_times,
    from_rate,
)
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import ImageArray

_STILL_RATE_HZ, _ASSUMED_RATE_HZ = 10.0, 25.0
_RATES_HZ = (0.5, 1000.0)
# A container may state a few frames too many without being damaged.
_LEAST_COMPLETE = 0.95
_MOST_TIMES = 20_000  # frames of an uneven film whose times are read at the start


class VideoReader(Protocol):
    """An open film or still.

    times: due times of its frames, and assumptions about them
    """

    times: VideoTimestamps

    def image(self, number: int) -> ImageArray:
        """Return a frame, counted through all repeats, not before the last one returned."""
        ...

    def close(self) -> None:
        """Free the file."""
        ...


def open_video(path: Path) -> VideoReader:
    """Open a file as a film or a still frame.

    Raises:
        CameraError: it is absent, no film or frame, empty or cut short.
    """
    if not path.exists():
        raise CameraError(f"no film or image at {path}: check the path")
    if not path.is_file():
        raise CameraError(f"{path} is not a file: name a film or an image in it")
    try:
        path.open("rb").close()
    except OSError as error:
        raise CameraError(f"cannot read {path} ({error.strerror}): check its rights") from error
    # A GIF is a film; OpenCV's image reader would return only its first frame.
    still = path.suffix.lower() != ".gif" and cv2.haveImageReader(str(path))
    return _Still(path) if still else _Film(path)


def usable_rate_hz(stated_hz: float) -> tuple[float, str]:
    """Return the frame rate to use, and a note if the stated one is invalid."""
    low, high = _RATES_HZ
    if isfinite(stated_hz) and low <= stated_hz <= high:
        return stated_hz, ""
    return _ASSUMED_RATE_HZ, (
        f"the film states a rate of {stated_hz:g} frames a second; {_ASSUMED_RATE_HZ:g} assumed"
    )


class _Still:
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
        self._image = _frozen(image, path)
        self._last = 1

    def image(self, number: int) -> ImageArray:
        """Return the frame."""
        _check_forward(number, self._last)
        self._last = number
        return self._image

    def close(self) -> None:
        """Do nothing."""


class _Film:
    """A film that is repeated forever."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._capture = _open_film(path)
        stated = usable_rate_hz(self._capture.get(cv2.CAP_PROP_FPS))
        first_s = _times_s(self._capture, SAMPLE)
        if not first_s:
            raise CameraError(f"{path} holds no readable frame: use another file")
        times = from_rate(*stated, ascending_times(first_s))
        if times is None:
            times = from_frame_times(
                ascending_times(first_s + _times_s(self._capture, _MOST_TIMES))
            )
        elif times.rate_hz == stated[0]:
            # The stated number of frames is often the length times the rate: if the rate is wrong,
            # so is the number.
            _check_complete(path, self._capture, len(first_s))
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
                self._advance(number)
            found, image = self._capture.retrieve()
            if not found:
                raise CameraError(f"frame {self._index} of {self._path} is damaged: copy it again")
            self._seen = number, _frozen(image, self._path)
        return self._seen[1]

    def close(self) -> None:
        """Free the file."""
        self._capture.release()

    def _advance(self, goal: int) -> None:
        """Go to the next frame, from the end to the start, and skip whole repeats."""
        if not self._capture.grab():
            self._length, self._index = self._index, 0
            self._rewind()
            if not self._capture.grab():
                raise CameraError(
                    f"{self._path} cannot be read any more: check that the file still exists"
                )
        self._number, self._index = self._number + 1, self._index + 1
        if self._length:
            self._number += (goal - self._number) // self._length * self._length

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
            f"{path} is no readable film or image (or is cut short): "
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


def _check_complete(path: Path, capture: cv2.VideoCapture, seen: int) -> None:
    """Reject a film that ends long before its stated end.

    seen: number of frames read already
    """
    stated = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    if stated <= seen:  # complete, or a stream without an index
        return
    capture.set(cv2.CAP_PROP_POS_FRAMES, stated - 1)
    reached = stated if capture.grab() else int(capture.get(cv2.CAP_PROP_POS_FRAMES))
    if reached < _LEAST_COMPLETE * stated:
        raise CameraError(
            f"{path} is cut short after {reached} of {stated} frames: copy it again or convert it"
        )


def _check_forward(number: int, least: int) -> None:
    """Reject frames before the last one."""
    if number < least:
        raise ValueError(f"films are read forward: frame {number} wanted, {least} is the least")


def _frozen(image: Any, path: Path) -> ImageArray:
    """Return a frame as a read-only BGR array.

    Raises:
        CameraError: the file has another pixel format.
    """
    pixels = to_bgr(image)
    if pixels is None:
        raise CameraError(f"{path} holds pictures of an unknown kind: convert it to mp4 or png")
    return pixels
