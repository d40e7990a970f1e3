"""Worker that keeps the newest detections of a camera, so that the control loop never waits.

They are kept in one slot: they are an immutable value, and rebinding a Python name is atomic.
Frames that arrive while the detectors work are skipped.
"""

import threading
from collections import deque
from collections.abc import Callable

from gazerig.drivers.camera.capture_loop import CameraParts, CaptureLoop, detection_error
from gazerig.drivers.camera.params import RECOVERY, CameraRecovery
from gazerig.drivers.camera.process import LONGEST_END_S, CaptureProcess
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import Detections

_MOST_EVENTS = 100


class CameraWorker:
    """A camera, or a film paced by the real clock, watched by a process or a thread of its own.

    While a lost source is reopened the last detections stay, and their age shows the loss.

    Args:
        parts: Source and detectors; nothing starts yet.
        now_s: The host's monotonic clock; for a process picklable, as all share its zero.
        recovery: Times of reopening a lost camera.
        in_thread: Whether the parts run in a thread of this process, for those of a program, which
            exist only there; otherwise they run in a process, which cannot delay the control loop.

    frames: count of analysed frames since open
    """

    def __init__(
        self,
        parts: CameraParts,
        now_s: Callable[[], float],
        recovery: CameraRecovery = RECOVERY,
        in_thread: bool = False,
    ) -> None:
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        make = CaptureLoop if in_thread else CaptureProcess
        self._frames: CaptureLoop | CaptureProcess = make(
            parts, now_s, recovery, self._events.append
        )
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._newest: Detections | None = None
        self._failure: BaseException | None = None
        self.frames = 0

    def open(self) -> None:
        """Open the source and start detection.

        Raises:
            CameraError: the source cannot be opened, or is open already.
            SetupError: the detector cannot be created.
        """
        if self._thread is not None:
            raise CameraError("the camera is already open: close() it before opening it again")
        self._events.clear()
        self._frames.open()
        self._stop.clear()
        self._newest, self._failure = None, None
        self.frames = 0
        self._thread = threading.Thread(target=self._watch, name="camera", daemon=True)
        self._thread.start()

    def latest(self, now_s: float) -> Detections | None:
        """Return the detections of the newest frame, or None before the first.

        Raises:
            CameraError: the source is lost permanently, or detection has failed.
        """
        if self._failure is not None:
            raise detection_error(self._failure) from self._failure
        return self._newest

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return tuple([self._events.popleft() for _ in range(len(self._events))])

    def close(self) -> None:
        """Stop detection and free the source; safe to call twice."""
        self._stop.set()
        if self._thread is not None:
            # A process that is blocked in a camera's driver is killed; a thread cannot be.
            self._thread.join(LONGEST_END_S + 1.0)
            if not self._thread.is_alive():
                self._thread = None

    def _watch(self) -> None:
        """Receive the detections of one frame after another until stopped."""
        try:
            while (found := self._frames.next_detections(self._stop)) is not None:
                self.frames += 1
                self._newest = found
        except BaseException as failure:  # raised to the loop by latest()
            self._failure = failure
        finally:
            # Freed by the thread that reads it, never while a frame is fetched.
            self._frames.close()
