"""Pictures in real time: a thread looks, and leaves what it found in one slot.

No queue and no lock: the slot holds one frozen value, and a Python name is rebound in
one piece. Pictures that come while the detector works are skipped.
"""

import threading
from collections.abc import Callable

from drivers.errors import CameraError
from drivers.picture_source import PictureSource, Shot
from drivers.types import Detections, FaceDetector

# OpenCV gives up waiting for a camera after 10 s; a film stops at once.
_LONGEST_WAIT_S = 12.0


class CameraThread:
    """A camera, or a film paced by the real clock, watched for faces.

    pictures, pictures_with_face: counts of pictures looked at since open
    """

    def __init__(
        self, source: PictureSource, detector: FaceDetector, now_s: Callable[[], float]
    ) -> None:
        """Take what gives pictures, what finds faces, and the host's monotonic clock."""
        self._source = source
        self._detector = detector
        self._now_s = now_s
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._newest: Detections | None = None
        self._failure: Exception | None = None
        self.pictures = 0
        self.pictures_with_face = 0

    def open(self) -> None:
        """Open the source and start looking.

        Raises:
            drivers.errors.CameraError: the source cannot be opened, or is open already.
        """
        if self._thread is not None:
            raise CameraError("the camera thread runs already: close() it before opening it anew")
        self._source.open()
        self._stop.clear()
        self._newest, self._failure = None, None
        self.pictures = self.pictures_with_face = 0
        self._thread = threading.Thread(target=self._watch, name="camera", daemon=True)
        self._thread.start()

    def latest(self, now_s: float) -> Detections | None:
        """Give what the newest picture showed, or None before the first.

        Raises:
            drivers.errors.CameraError: the thread has ended by a fault.
        """
        failure = self._failure
        if isinstance(failure, CameraError):
            raise CameraError(str(failure)) from failure
        if failure is not None:
            raise CameraError(
                f"looking at pictures failed ({type(failure).__name__}: "
                f"{' '.join(str(failure).split())}): start anew, and report it if it comes back"
            ) from failure
        return self._newest

    def close(self) -> None:
        """Stop looking and free the source; safe to call twice."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join(_LONGEST_WAIT_S)
            if not self._thread.is_alive():
                self._thread = None

    def _watch(self) -> None:
        """Look at one picture after another until told to stop."""
        try:
            while (shot := self._source.take(self._now_s, self._stop)) is not None:
                self._look(shot)
        except Exception as failure:  # handed to the loop by latest()
            self._failure = failure
        finally:
            # Freed by the thread that reads it: never under a picture being fetched.
            self._source.close()

    def _look(self, shot: Shot) -> None:
        """Find faces and leave the result in the slot."""
        faces = self._detector.find(shot.picture)
        height, width = shot.picture.shape[:2]
        self.pictures += 1
        self.pictures_with_face += bool(faces)
        self._newest = Detections(
            shot.captured_s, shot.number, width, height, faces, picture=shot.picture
        )
