"""Detection of palms of the nearest person, including still hands.

The network is the palm detector of MediaPipe's hands, run by LiteRT. It detects hands well in a
square of 192 pixels that is as wide as a person's reach.

Source: Zhang et al., "MediaPipe Hands: on-device real-time hand tracking" (2020). Input and output:
opencv_zoo, models/palm_detection_mediapipe.
"""

import numpy as np

from gazerig.drivers.types import DetectedFace, DetectedPalm, DetectedPerson, ImageArray
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.litert import Network, PointSearch, load_network
from gazerig.drivers.vision.model_files import PALMS

_SIDE_PX = 192
# Cells of the anchors: size in pixels, and anchors per cell.
_CELLS = ((8, 2), (16, 6))
# In three films of people in front of a webcam, 228 pictures, this square shows most palms: in .92,
# .90 and .86 of the pictures; a square of 1 m in .84, .90 and .62.
_REACH_M, _BELOW_M = 1.3, 0.26
# Height of a face's box, and length of a person from the hips to the top of the head.
_FACE_M, _TRUNK_M = 0.163, 0.83
# Time for which an unseen person counts as present, as a hand may hide the face.
_THERE_S = 1.0
_CONFIDENCE = 0.5
# Ratio of a palm's length (wrist to middle finger) to its width (index to little finger).
_LENGTH_OF_WIDTH = 1.4


class PalmDetector:
    """Detector of palms of the nearest person."""

    def __init__(self, params: FaceDetectorParams, network: Network | None = None) -> None:
        """Load the network, unless one is given; it raises as ``load_network`` does."""
        self._params = params
        self._search = PointSearch(network or load_network(PALMS), _SIDE_PX, _CELLS, 255.0, 0.0)
        self.due_s = self._seen_s = -np.inf
        self._x = self._y = self._px_per_m = 0.0

    def watch(
        self,
        captured_s: float,
        faces: tuple[DetectedFace, ...],
        people: tuple[DetectedPerson, ...],
    ) -> None:
        """Note where the nearest person is; ``captured_s`` schedules searches."""
        seen = [(person.trunk_px / _TRUNK_M, *person.head_px) for person in people]
        for face in faces:
            x, y, width, height = face.box_px
            seen.append((height / _FACE_M, x + width / 2.0, y + height / 2.0))
        if seen:
            self._px_per_m, self._x, self._y = max(seen)
            self._seen_s = captured_s

    def is_due(self, captured_s: float) -> bool:
        """Return whether a person is there and the next frame is to be searched."""
        return captured_s >= self.due_s and captured_s - self._seen_s <= _THERE_S

    def find(self, image: ImageArray, captured_s: float) -> tuple[DetectedPalm, ...]:
        """Return the palms within the nearest person's reach."""
        self.due_s = captured_s + 1.0 / self._params.hands_hz
        if image.size == 0:
            return ()
        half = _REACH_M * self._px_per_m / 2.0
        y = self._y + _BELOW_M * self._px_per_m
        box = np.array([self._x - half, y - half, self._x + half, y + half])
        found = []
        for places, sure in self._search.search(image, box, _CONFIDENCE):
            # Wrist, and roots of index, middle and little finger.
            wrist, index, middle, little = places[[1, 2, 3, 5]]
            size = max(
                float(np.linalg.norm(middle - wrist)),
                _LENGTH_OF_WIDTH * float(np.linalg.norm(little - index)),
            )
            x, y = ((wrist + middle) / 2.0).tolist()
            if size > 1.0:
                found.append(DetectedPalm((x, y), size, sure))
        return tuple(found)
