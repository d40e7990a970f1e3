"""Detection in a separate thread, so that the control loop never waits for a frame.

The newest detections are kept in one slot: they are an immutable value, and rebinding a Python name
is atomic. Frames that arrive while the detector works are skipped.
"""

import threading
from collections import deque
from collections.abc import Callable

from gazerig.drivers.camera.capture_loop import CameraParts, CaptureLoop, detection_error
from gazerig.drivers.camera.params import RECOVERY, CameraRecovery
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import Detections

# OpenCV stops waiting for a camera after 10 s; a film stops immediately.
_LONGEST_WAIT_S = 12.0
_MOST_EVENTS = 100


class CameraThread:
    """A camera watched from a thread of this process, for the parts of a program.

    Its arguments and methods are those of ``CameraProcess``.
    """

    def __init__(
        self,
        parts: CameraParts,
        now_s: Callable[[], float],
        recovery: CameraRecovery = RECOVERY,
        tell: Callable[[float], None] | None = None,
    ) -> None:
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        self._camera = CaptureLoop(parts, now_s, recovery, self._events.append)
        self._tell = tell
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._newest: Detections | None = None
        self._failure: BaseException | None = None
        self.frames = self.frames_with_face = 0

    def open(self) -> None:
        """Open the source and start detection.

        Raises:
            CameraError: the source cannot be opened, or is open already.
        """
        if self._thread is not None:
            raise CameraError(
                "the camera thread is already running: close() it before opening it again"
            )
        self._events.clear()
        self._camera.open()
        self._stop.clear()
        self._newest, self._failure = None, None
        self.frames = self.frames_with_face = 0
        self._thread = threading.Thread(target=self._watch, name="camera", daemon=True)
        self._thread.start()

    def latest(self, now_s: float) -> Detections | None:
        """Return the detections of the newest frame, or None before the first.

        Raises:
            CameraError: the source is lost permanently, or detection has failed.
        """
        if self._tell is not None:
            self._tell(now_s)
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
            self._thread.join(_LONGEST_WAIT_S)
            if not self._thread.is_alive():
                self._thread = None

    def _watch(self) -> None:
        """Analyse one frame after another until stopped."""
        try:
            while (found := self._camera.next_detections(self._stop)) is not None:
                self.frames += 1
                self.frames_with_face += bool(found.faces)
                self._newest = found
        except BaseException as failure:  # raised to the loop by latest()
            self._failure = failure
        finally:
            # Freed by the thread that reads it, never while a frame is fetched.
            self._camera.close()
