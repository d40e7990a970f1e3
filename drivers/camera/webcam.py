"""A camera of Video4Linux, read through OpenCV."""

import os
import threading
from collections.abc import Callable
from pathlib import Path

import cv2

from gazerig.drivers.camera.frame_rate import FrameRateMonitor
from gazerig.drivers.camera.params import WebcamParams
from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.camera.source import Shot, bgr
from gazerig.drivers.errors import CameraError

# Frames in a row that may fail before the camera counts as gone; one fails now and
# then where a cable is long.
_MOST_FAILURES = 5
# The kernel's stamp is believed if it is this young on the same clock.
_OLDEST_STAMP_S = 1.0
# OpenCV waits 10 s for a frame unless told otherwise; it reads this once.
_SELECT_TIMEOUT = ("OPENCV_VIDEOIO_V4L_SELECT_TIMEOUT", "2")


def open_v4l2(device: str) -> cv2.VideoCapture:
    """Open a device file by Video4Linux alone."""
    os.environ.setdefault(*_SELECT_TIMEOUT)
    return cv2.VideoCapture(device, cv2.CAP_V4L2)


class Webcam:
    """A camera at /dev/video<N>, or at a device file such as /dev/v4l/by-id/..."""

    def __init__(
        self,
        device: int | str | Path = 0,
        width_px: int = 640,
        height_px: int = 480,
        rate_hz: float = 30.0,
        capture: Callable[[str], cv2.VideoCapture] = open_v4l2,
        latency_s: float = 0.0,
    ) -> None:
        """Name the camera and what is asked of it; it gives what comes nearest.

        capture: opens a device file; another one serves where there is no camera
        latency_s: from the middle of the exposure to the stamp of the frame
        """
        self._file = Path(f"/dev/video{device}" if isinstance(device, int) else device)
        self._wishes = {
            cv2.CAP_PROP_FRAME_WIDTH: width_px,
            cv2.CAP_PROP_FRAME_HEIGHT: height_px,
            cv2.CAP_PROP_FPS: rate_hz,
            # One buffer: a frame fetched late is a fresh one, not an old one kept.
            cv2.CAP_PROP_BUFFERSIZE: 1,
        }
        self._open_capture = capture
        self._latency_s = latency_s
        self._capture: cv2.VideoCapture | None = None
        self._number = 0
        self._rate = FrameRateMonitor("", 0.0)
        self._left_s: float | None = None
        self._events: list[str] = []

    @classmethod
    def of(cls, device: int | str | Path, params: WebcamParams) -> "Webcam":
        """Make a webcam as configured."""
        size = params.width_px, params.height_px
        return cls(device, *size, params.rate_hz, latency_s=params.latency_ms / 1e3)

    def open(self) -> None:
        """Open the camera and fetch one frame as a proof.

        Raises:
            CameraError: it is absent, not permitted, busy or delivers no frame.
        """
        self.close()
        self._check_file()
        with quiet_opencv():
            capture = self._open_capture(str(self._file))
            for what, value in self._wishes.items():
                capture.set(what, value)
            works = capture.isOpened() and capture.grab()
        if not works:
            capture.release()
            raise CameraError(
                f"{self._file} delivers no frame: it is no camera, or another program uses it; "
                "close that program or name another camera"
            )
        self._capture, self._number = capture, 0
        self._rate = FrameRateMonitor(f"camera {self._file}", capture.get(cv2.CAP_PROP_FPS))
        self._left_s = None

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait for the next frame; its time is the kernel's stamp, else that of its arrival.

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
            pixels = bgr(image) if found and image is not None else None
            if pixels is not None:
                captured_s = self._stamp_s(self._capture, arrived_s)
                self._watch_rate(captured_s, came_s)
                self._left_s = now_s()
                self._number += 1
                return Shot(captured_s - self._latency_s, self._number, pixels)
        raise CameraError(
            f"camera {self._file} delivers no more frames: check its cable, then start again"
        )

    def events(self) -> tuple[str, ...]:
        """Return a line when the measured frame rate differs from the stated one."""
        messages, self._events = tuple(self._events), []
        return messages

    def close(self) -> None:
        """Free the camera; safe to call twice."""
        if self._capture is not None:
            self._capture.release()
        self._capture = None

    def _check_file(self) -> None:
        """Refuse a device file that is absent or not permitted; the message lists the others."""
        if not self._file.exists():
            there = ", ".join(sorted(str(f) for f in self._file.parent.glob("video*")))
            raise CameraError(
                f"no camera at {self._file} (there is: {there or 'none'}): "
                "plug it in or name another"
            )
        if not os.access(self._file, os.R_OK | os.W_OK):
            raise CameraError(
                f"{self._file} may not be opened: add yourself to the group video "
                "(sudo usermod -aG video $USER) and log in again"
            )

    def _watch_rate(self, captured_s: float, came_s: float) -> None:
        """Compare the times of frames with the rate that the camera states."""
        away_s = 0.0 if self._left_s is None else came_s - self._left_s
        line = self._rate.update(captured_s, away_s)
        if line:
            self._events.append(line)

    @staticmethod
    def _stamp_s(capture: cv2.VideoCapture, arrived_s: float) -> float:
        """Return the kernel's stamp of the last frame where it is on our clock."""
        stamp_s = capture.get(cv2.CAP_PROP_POS_MSEC) / 1000.0
        return stamp_s if 0.0 <= arrived_s - stamp_s <= _OLDEST_STAMP_S else arrived_s
