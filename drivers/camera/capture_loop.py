"""Looking at one picture after another, and opening a lost camera again and again."""

import threading
from collections.abc import Callable

from gazerig.drivers.camera.frame_analysis import FrameAnalyzer, Motion
from gazerig.drivers.camera.params import CameraCareParams
from gazerig.drivers.camera.source import PictureSource, Shot
from gazerig.drivers.errors import CameraError
from gazerig.drivers.types import Detections, FaceDetector

LOST, BACK = "camera lost", "camera back"
"""How lines begin that tell of a source that is tried again, and of its return."""


class CameraWatch:
    """A source of pictures with what finds things in them.

    A source that is lost in service is opened again until it is back or patience ends.
    Numbers count on through that.
    """

    def __init__(
        self,
        source: PictureSource,
        detector: FaceDetector,
        now_s: Callable[[], float],
        care: CameraCareParams,
        motion: Motion | None,
        tell: Callable[[str], None],
    ) -> None:
        """Take what gives pictures, what finds faces and motion, and the host's clock.

        tell: takes a line about what has happened, at once
        """
        self._source = source
        self._frames = FrameAnalyzer(detector, motion)
        self._now_s = now_s
        self._care = care
        self._counted = 0  # pictures of the source before it was last opened
        self._number = 0
        self._tell = tell

    def open(self) -> None:
        """Open the source and begin at picture 1.

        Raises:
            CameraError: the source cannot be opened.
        """
        self._source.open()
        self._counted = self._number = 0

    def next(self, stop: threading.Event) -> Detections | None:
        """Wait for the next picture and look at it; None where ``stop`` was set meanwhile.

        Raises:
            CameraError: the source is gone for good.
        """
        shot = self._take(stop)
        if shot is None:
            return None
        self._number = self._counted + shot.number
        found = self._frames.look(shot._replace(number=self._number))
        for line in self._source.events():
            self._tell(line)
        return found

    def retune(
        self,
        detector: Callable[[], FaceDetector] | None,
        motion: Callable[[Motion | None], Motion | None] | None,
    ) -> None:
        """Look otherwise from the next picture on, as in FrameAnalyzer."""
        self._frames.retune(detector, motion)

    def close(self) -> None:
        """Free the source; safe to call twice."""
        self._source.close()

    def _take(self, stop: threading.Event) -> Shot | None:
        """Take the next picture, opening a lost source again."""
        lost_s: float | None = None
        wait_s = self._care.retry_ms / 1e3
        while True:
            try:
                if lost_s is not None:
                    self._source.open()
                shot = self._source.take(self._now_s, stop)
            except CameraError as error:
                if lost_s is None:
                    lost_s = self._lose(error)
                self._source.close()
                if self._now_s() - lost_s >= self._care.give_up_s:
                    raise
                if stop.wait(wait_s):
                    return None
                wait_s = min(2.0 * wait_s, self._care.longest_retry_ms / 1e3)
                continue
            if shot is not None and lost_s is not None:
                self._tell(f"{BACK} after {self._now_s() - lost_s:.1f} s")
            return shot

    def _lose(self, error: CameraError) -> float:
        """Tell of the loss, count on from the last picture, and give when it was."""
        self._counted = self._number
        if self._care.give_up_s > 0.0:
            self._tell(f"{LOST} ({error}): trying it again")
        return self._now_s()


def failed(failure: Exception) -> CameraError:
    """Return what to tell the loop of a fault that ended the looking."""
    if isinstance(failure, CameraError):
        return CameraError(str(failure))
    return CameraError(
        f"looking at pictures failed ({type(failure).__name__}: "
        f"{' '.join(str(failure).split())}): start anew, and report it if it comes back"
    )
