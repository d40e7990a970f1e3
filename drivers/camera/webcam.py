"""A Video4Linux camera, read through OpenCV."""

import os
import threading
from collections.abc import Callable
from math import inf
from pathlib import Path

import cv2

from gazerig.drivers.camera.params import WebcamParams
from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.camera.source import Shot, exposure_s, to_bgr
from gazerig.drivers.errors import CameraError

# Consecutive failed frames after which the camera counts as lost; one fails at times with a long
# cable.
_MOST_FAILURES = 5
# A reader that was away for a smaller part of a frame period has lost no frame, so that period
# counts, with a share, as the camera's: many take longer in the dark.
_PROMPT, _SHARE = 0.5, 0.2
# Compressed, which USB 2 carries at full size and rate.
_FOURCC = "MJPG"
# Time-out for a frame; OpenCV's default is 10 s, and it reads this once.
_SELECT_TIMEOUT = ("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "2")


def open_v4l2(device: str) -> cv2.VideoCapture:
    """Open a device file only with Video4Linux."""
    os.environ.setdefault(*_SELECT_TIMEOUT)
    return cv2.VideoCapture(device, cv2.CAP_V4L2)


class Webcam:
    """A camera at /dev/video<N>, or at a device file such as /dev/v4l/by-id/..."""

    def __init__(
        self,
        device: int | str | Path = 0,
        params: WebcamParams | None = None,
        capture: Callable[[str], cv2.VideoCapture] = open_v4l2,
    ) -> None:
        """Set the camera and its requested settings; it uses the nearest ones that it has.

        capture: opens a device file; tests replace it
        """
        self._file = Path(f"/dev/video{device}" if isinstance(device, int) else device)
        self._params = params = params or WebcamParams()
        self._requested = {
            # Set first, as sizes and rates depend on it.
            cv2.CAP_PROP_FOURCC: cv2.VideoWriter.fourcc(*_FOURCC),
            cv2.CAP_PROP_FRAME_WIDTH: params.width_px,
            cv2.CAP_PROP_FRAME_HEIGHT: params.height_px,
            cv2.CAP_PROP_FPS: params.rate_hz,
            # One buffer, so that a frame fetched late is a fresh one.
            cv2.CAP_PROP_BUFFERSIZE: 1,
        }
        self._open_capture = capture
        self._capture: cv2.VideoCapture | None = None
        self._number = 0
        self._period_s, self._captured_s, self._left_s = 0.0, 0.0, 0.0

    def open(self) -> None:
        """Open the camera and fetch one frame as a check.

        Raises:
            CameraError: it is absent, not permitted, busy or delivers no frame.
        """
        self.close()
        if not self._file.exists():
            there = ", ".join(sorted(str(f) for f in self._file.parent.glob("video*")))
            raise CameraError(
                f"no camera at {self._file} (found: {there or 'none'}): plug it in or name another"
            )
        if not os.access(self._file, os.R_OK | os.W_OK):
            raise CameraError(
                f"{self._file} may not be opened: add yourself to the group video "
                "(sudo usermod -aG video $USER) and log in again"
            )
        with quiet_opencv():
            capture = self._open_capture(str(self._file))
            for what, value in self._requested.items():
                capture.set(what, value)
            works = capture.isOpened() and capture.grab()
        if not works:
            capture.release()
            raise CameraError(
                f"{self._file} delivers no frame: it is not a camera, or another program uses it; "
                "close that program or name another camera"
            )
        self._capture, self._number = capture, 0
        stated_hz = capture.get(cv2.CAP_PROP_FPS)
        self._period_s = 1.0 / (stated_hz if stated_hz > 0.0 else self._params.rate_hz)
        self._captured_s = inf

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait for the next frame; its time is the kernel's stamp or its time of arrival.

        Raises:
            CameraError: the camera is not open or delivers no more frames.
        """
        if self._capture is None:
            raise CameraError(f"camera {self._file} is not open: call open() before taking")
        came_s = now_s()
        for _ in range(_MOST_FAILURES):
            if stop.is_set():
                return None
            if not self._capture.grab():
                continue
            arrived_s = now_s()
            found, image = self._capture.retrieve()
            pixels = to_bgr(image) if found and image is not None else None
            if pixels is not None:
                stamp_s = self._capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
                captured_s = exposure_s(stamp_s, arrived_s)
                self._count(captured_s, came_s - self._left_s)
                self._left_s = now_s()
                latency_s = self._params.latency_ms / 1e3
                return Shot(captured_s - latency_s, self._number, pixels)
        raise CameraError(
            f"camera {self._file} delivers no more frames: check its cable, then start again"
        )

    def events(self) -> tuple[str, ...]:
        """Return no events: a webcam has none."""
        return ()

    def close(self) -> None:
        """Free the camera; safe to call twice."""
        if self._capture is not None:
            self._capture.release()
        self._capture = None

    def _count(self, captured_s: float, away_s: float) -> None:
        """Count a frame, and those that arrived while the reader was busy for a time."""
        step_s, self._captured_s = captured_s - self._captured_s, captured_s
        self._number += 1
        if away_s < _PROMPT * step_s:
            self._period_s += _SHARE * (step_s - self._period_s)
        elif step_s > 0.0:
            self._number += max(0, round(step_s / self._period_s) - 1)
