"""A film as a camera in simulated time: the same calls return the same detections.

Frames are not blurred, distorted, dropped or reordered, and the delay is constant.
"""

from typing import TYPE_CHECKING

from gazerig.drivers.camera.capture_loop import FrameAnalyzer, Locate, Motion
from gazerig.drivers.camera.orientation import AS_DELIVERED, FrameOrientation
from gazerig.drivers.types import Detections, FaceDetector

if TYPE_CHECKING:
    from gazerig.drivers.camera.file_player import FilePlayer


class FilmCamera:
    """A film that starts at a simulated time, with face detection.

    Every frame is analysed exactly once and in order, however far time jumps, so that the counts
    equal those of any other run to the same time.

    Args:
        video: the film.
        detector: finds faces.
        delay_s: time from exposure to detections, at least 0.
        start_s: simulated time of the first exposure.
        motion: finds motion; None: no motion.
        locate: converts detections from pixels to the camera's axes; None: no conversion.
        orientation: turns frames upright.

    frames: count of frames analysed since ``open``
    """

    def __init__(
        self,
        video: "FilePlayer",
        detector: FaceDetector,
        delay_s: float,
        start_s: float = 0.0,
        motion: Motion | None = None,
        locate: Locate | None = None,
        orientation: FrameOrientation = AS_DELIVERED,
    ) -> None:
        self._video = video
        self._frames = FrameAnalyzer(
            detector, motion, locate, orientation, getattr(video, "is_film", False)
        )
        self._delay_s = delay_s
        self._start_s = start_s
        self._newest: Detections | None = None
        self.frames = 0

    def open(self) -> None:
        """Open the film at its first frame.

        Raises:
            CameraError: the film cannot be opened.
        """
        self._video.open()
        self._newest = None
        self.frames = 0

    def latest(self, now_s: float) -> Detections | None:
        """Return the newest detections that have arrived by ``now_s``.

        Raises:
            CameraError: the film cannot be read any more.
        """
        while (captured_s := self._start_s + self._video.due_s) + self._delay_s <= now_s:
            found = self._frames.analyze(self._video.next_shot()._replace(captured_s=captured_s))
            self.frames += 1
            self._newest = found
        return self._newest

    def events(self) -> tuple[str, ...]:
        """Return the assumptions about film and lens, one line each, once."""
        return (*self._video.events(), *self._frames.events())

    def close(self) -> None:
        """Free the film; safe to call twice."""
        self._video.close()
