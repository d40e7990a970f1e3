"""Films for browsers: WebM with VP8, which all current browsers play."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import cv2

from gazerig.drivers.camera.quiet_opencv import quiet_stderr
from gazerig.drivers.errors import SetupError
from gazerig.drivers.types import ImageArray

_CODEC, _BITS_PER_S = "VP80", 2_000_000
_OPTIONS = "OPENCV_FFMPEG_WRITER_OPTIONS"


@contextmanager
def film_writer(
    path: Path, size_px: tuple[int, int], rate_hz: float
) -> Iterator[Callable[[ImageArray], None]]:
    """Yield a function that appends BGR pictures to a film.

    Args:
        path: Path of the film, ending in .webm; an existing file is overwritten.
        size_px: Width and height of all pictures.
        rate_hz: Pictures per second.

    Raises:
        SetupError: OpenCV cannot write such a film here.
    """
    before = os.environ.get(_OPTIONS)
    os.environ[_OPTIONS] = f"b;{_BITS_PER_S}|deadline;good|auto-alt-ref;0"
    try:
        code = cv2.VideoWriter.fourcc(*_CODEC)
        with quiet_stderr():  # OpenCV claims that WebM does not support its codec VP8
            writer = cv2.VideoWriter(str(path), cv2.CAP_FFMPEG, code, rate_hz, size_px)
    finally:
        if before is None:
            del os.environ[_OPTIONS]
        else:
            os.environ[_OPTIONS] = before
    try:
        if not writer.isOpened():
            raise SetupError(f"{path}: this OpenCV cannot write {_CODEC} films; pip's builds can")
        yield lambda picture: writer.write(picture)
    finally:
        writer.release()


def film_seconds(path: Path | str) -> float:
    """Return the duration of a film, seconds.

    Raises:
        SetupError: it cannot be read.
    """
    reader = cv2.VideoCapture(str(path))
    try:
        rate_hz, count = reader.get(cv2.CAP_PROP_FPS), reader.get(cv2.CAP_PROP_FRAME_COUNT)
        if not reader.isOpened() or not reader.grab() or not rate_hz > 0.0:
            raise SetupError(f"{path} cannot be read as a film: make it again as WebM")
        return count / rate_hz
    finally:
        reader.release()
