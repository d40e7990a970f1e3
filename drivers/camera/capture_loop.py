"""Detection frame by frame, with reopening of a lost camera."""

import threading
from collections.abc import Callable

from gazerig.drivers.camera.frame_analysis import FrameAnalyzer, Locate, Motion
from gazerig.drivers.camera.params import CameraRecoveryParams
from gazerig.drivers.camera.source import FrameSource, Shot
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import Detections, FaceDetector

LOST, BACK = "camera lost", "camera back"
"""First words of events about the loss of a source, and about its reconnection."""


class CaptureLoop:
    """A source of frames with the detectors of faces and motion.

    A lost source is reopened until it reconnects or ``recovery.give_up_s`` has passed. Frame
    numbers continue to count meanwhile.

    Args:
        source: Source of frames.
        detector: Finds faces.
        now_s: The host's monotonic clock, seconds.
        recovery: Parameters of reopening a lost source.
        motion: Finds motion, None for none.
        report: Called with each event as one line, immediately.
        locate: Locates detections in the camera's axes, None for none.
    """

    def __init__(
        self,
        source: FrameSource,
        detector: FaceDetector,
        now_s: Callable[[], float],
        recovery: CameraRecoveryParams,
        motion: Motion | None,
        report: Callable[[str], None],
        locate: Locate | None = None,
    ) -> None:
        self._source = source
        self._frames = FrameAnalyzer(
            detector,
            motion,
            locate,
            getattr(source, "rotation", 0),
            getattr(source, "has_unknown_lens", False),
        )
        self._now_s = now_s
        self._recovery = recovery
        self._counted = 0  # frames of the source before it was last reopened
        self._number = 0
        self._report = report

    def open(self) -> None:
        """Open the source and begin at frame 1.

        Raises:
            CameraError: the source cannot be opened.
        """
        self._source.open()
        self._counted = self._number = 0

    def next(self, stop: threading.Event) -> Detections | None:
        """Return the detections in the next frame, None if ``stop`` was set meanwhile.

        Raises:
            CameraError: the source is lost permanently.
        """
        shot = self._take(stop)
        if shot is None:
            return None
        self._number = self._counted + shot.number
        found = self._frames.look(shot._replace(number=self._number))
        for line in (*self._source.events(), *self._frames.events()):
            self._report(line)
        return found

    def retune(
        self,
        detector: Callable[[], FaceDetector] | None,
        motion: Callable[[Motion | None], Motion | None] | None,
        locate: Locate | None = None,
    ) -> None:
        """Change detectors and calibration from the next frame on, as in FrameAnalyzer."""
        self._frames.retune(detector, motion, locate)

    def close(self) -> None:
        """Free the source; safe to call twice."""
        self._source.close()

    def _take(self, stop: threading.Event) -> Shot | None:
        """Return the next frame, reopening a lost source; None if ``stop`` was set."""
        lost_s: float | None = None
        wait_s = self._recovery.retry_ms / 1e3
        while True:
            try:
                if lost_s is not None:
                    self._source.open()
                shot = self._source.take(self._now_s, stop)
            except CameraError as error:
                if lost_s is None:
                    lost_s = self._lose(error)
                self._source.close()
                if self._now_s() - lost_s >= self._recovery.give_up_s:
                    raise
                if stop.wait(wait_s):
                    return None
                wait_s = min(2.0 * wait_s, self._recovery.longest_retry_ms / 1e3)
                continue
            if shot is not None and lost_s is not None:
                self._report(f"{BACK} after {self._now_s() - lost_s:.1f} s")
            return shot

    def _lose(self, error: CameraError) -> float:
        """Report the loss, continue the frame numbers, and return the time of the loss, seconds."""
        self._counted = self._number
        if self._recovery.give_up_s > 0.0:
            self._report(f"{LOST} ({error}): trying it again")
        return self._now_s()


def detection_error(failure: BaseException) -> CameraError:
    """Return the error that ended the detection, as the control loop reports it."""
    if isinstance(failure, CameraError):
        return CameraError(str(failure))
    return CameraError(
        f"detection in the camera frames failed ({type(failure).__name__}: "
        f"{' '.join(str(failure).split())}): start it again, and report it if it recurs"
    )
