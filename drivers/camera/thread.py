"""Detection in real time: a thread analyses frames and leaves the newest result in one slot.

No queue and no lock: the slot holds one frozen value, and a Python name is rebound in
one piece. Frames that come while the detector works are skipped.
"""

import threading
from collections import deque
from collections.abc import Callable

from gazerig.drivers.camera.capture_loop import CaptureLoop, failed
from gazerig.drivers.camera.frame_analysis import Locate, Motion
from gazerig.drivers.camera.params import CameraRecoveryParams
from gazerig.drivers.camera.source import FrameSource
from gazerig.drivers.camera.worker import Retune
from gazerig.drivers.errors import CameraError, SetupError
from gazerig.drivers.process.bounded_call import BoundedCall
from gazerig.drivers.types import Detections, FaceDetector

# OpenCV gives up waiting for a camera after 10 s; a film stops at once.
_LONGEST_WAIT_S = 12.0
_MOST_EVENTS = 100


class CameraThread:
    """A camera, or a film paced by the real clock, watched for faces and motion.

    While a lost source is reopened the last detections stay; their age shows the loss.

    Args:
        source: the frames.
        detector: finds faces.
        now_s: the host's monotonic clock, seconds.
        recovery: how a lost source is reopened.
        motion: called in the camera's thread with every frame, None for none.
        locate: locates what is found in the camera's axes, None for none.

    frames, frames_with_face: counts of frames looked at since open
    """

    def __init__(
        self,
        source: FrameSource,
        detector: FaceDetector,
        now_s: Callable[[], float],
        recovery: CameraRecoveryParams | None = None,
        motion: Motion | None = None,
        locate: Locate | None = None,
    ) -> None:
        self._events: deque[str] = deque(maxlen=_MOST_EVENTS)
        self._camera = CaptureLoop(
            source,
            detector,
            now_s,
            recovery or CameraRecoveryParams(),
            motion,
            self._events.append,
            locate,
        )
        self._requests: deque[Retune] = deque()
        self._stop = threading.Event()
        self._watching: BoundedCall | None = None
        self._newest: Detections | None = None
        self._failure: BaseException | None = None
        self.frames = 0
        self.frames_with_face = 0

    def open(self) -> None:
        """Open the source and start looking.

        Raises:
            CameraError: the source cannot be opened, or is open already.
        """
        if self._watching is not None:
            raise CameraError("the camera thread runs already: close() it before opening it again")
        self._events.clear()
        self._camera.open()
        self._stop.clear()
        self._newest, self._failure = None, None
        self.frames = self.frames_with_face = 0
        self._watching = BoundedCall("camera", 0.0)
        self._watching.begin(self._watch)

    def latest(self, now_s: float) -> Detections | None:
        """Return what the newest frame showed, or None before the first.

        Raises:
            CameraError: the source is gone for good, or looking has failed.
        """
        if self._failure is not None:
            raise failed(self._failure) from self._failure
        return self._newest

    def retune(
        self,
        detector: Callable[[], FaceDetector] | None,
        motion: Callable[[Motion | None], Motion | None] | None,
        locate: Locate | None = None,
    ) -> bool:
        """Change detectors and calibration from one of the next frames on; always possible.

        A detector that cannot be made is reported as an event, and the old one goes on.

        Args:
            detector: makes another one; None: no change.
            motion: returns a motion detector from the present one; None: no change.
            locate: locates by another calibration; None: no change.
        """
        self._requests.append(Retune(detector, motion, locate))
        return True

    def events(self) -> tuple[str, ...]:
        """Return what happened since the last call, one line each."""
        messages = []
        while self._events:
            messages.append(self._events.popleft())
        return tuple(messages)

    def close(self) -> None:
        """Stop looking and free the source; what does not stop is ended. Safe to call twice."""
        self._stop.set()
        if self._watching is not None:
            stopped = self._watching.idle(_LONGEST_WAIT_S)
            self._watching.close()
            if stopped:
                self._watching = None

    def _watch(self) -> None:
        """Analyse one frame after another until stopped."""
        try:
            while (found := self._camera.next(self._stop)) is not None:
                self.frames += 1
                self.frames_with_face += bool(found.faces)
                self._newest = found
                self._apply_requests()
        except BaseException as failure:  # handed to the loop by latest()
            self._failure = failure
        finally:
            # Freed by the thread that reads it: never under a frame being fetched.
            self._camera.close()

    def _apply_requests(self) -> None:
        """Apply what has been asked for since the frame before."""
        while self._requests:
            try:
                self._camera.retune(*self._requests.popleft())
            except SetupError as error:
                self._events.append(f"the detector stays as it was: {error}")
