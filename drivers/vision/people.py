"""Detection of people whose face need not be visible: turned away, in profile, or covered.

The network is the person detector of MediaPipe's BlazePose, run by LiteRT. It detects one person
well in a square of 224 pixels. So a search covers overlapping squares as high as the frame, one in
each frame, and of each square uses the strip that no other square shows better.

Source: Bazarevsky et al., "BlazePose: on-device real-time body pose tracking" (2020). Input and
output: opencv_zoo, models/person_detection_mediapipe.
"""

from math import ceil, hypot

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import DetectedPerson, ImageArray
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.litert import Network, PointSearch, load_network
from gazerig.drivers.vision.model_files import PEOPLE

_SIDE_PX = 224
# Cells of the anchors: size in pixels, and anchors per cell.
_CELLS = ((8, 2), (16, 2), (32, 6))
# Distance of neighbouring squares as a share of their side.
_STEP = 0.5
# People within this share of the side from the border of two squares count in both, one frame
# apart.
_BOTH = 0.05
# People detected with a lower confidence are discarded.
_CONFIDENCE = 0.6
# Half the width of a body as a share of the trunk, from head to hips.
_HALF_WIDTH = 0.35


class PeopleDetector:
    """Detector of people, which searches a part of each frame."""

    def __init__(self, params: FaceDetectorParams, network: Network | None = None) -> None:
        """Load the network, unless one is given; it raises as ``load_network`` does."""
        self._params = params
        self._search = PointSearch(network or load_network(PEOPLE), _SIDE_PX, _CELLS, 127.5, -1.0)
        self._next = 0
        self.due_s = self._started_s = -np.inf

    def is_due(self, captured_s: float) -> bool:
        """Return whether a part of the next frame is to be searched."""
        return captured_s >= self.due_s

    def find(self, image: ImageArray, captured_s: float) -> tuple[DetectedPerson, ...]:
        """Return the people in the next part of a frame.

        Args:
            image: The frame.
            captured_s: Time of its capture, seconds, which schedules searches.
        """
        if image.size == 0:
            return ()
        # Overlapping squares as high as the frame cover it.
        height, width = image.shape[:2]
        count = max(1, ceil((width - height) / (_STEP * height)) + 1)
        end = min(width, height) / 2.0
        middles = np.linspace(end, width - end, count)
        self._next %= count
        if self._next == 0:
            self._started_s = captured_s
        middle = middles[self._next]
        self._next = (self._next + 1) % count
        if self._next == 0:
            self.due_s = self._started_s + 1.0 / self._params.people_hz
        half = height / 2.0
        box = np.array([middle - half, 0.0, middle + half, height])
        found = []
        for points, sure in self._search.search(image, box, _CONFIDENCE):
            # Face centre, hips and the top of the body's circle.
            person = _person(points[:3], sure)
            if person is None:
                continue
            off = np.abs(middles - person.head_px[0])
            if abs(middle - person.head_px[0]) <= off.min() + 2.0 * _BOTH * height:
                found.append(person)
        return tuple(found)


def _person(points: NDArray[np.float64], confidence: float) -> DetectedPerson | None:
    """Return a person, None if the points are not those of an upright body.

    Args:
        points: Points (3, 2): centre of the face, centre of the hips, and top of the circle around
            them that contains the body, pixels.
        confidence: Confidence, 0..1.
    """
    (face_x, face_y), (hips_x, hips_y), (top_x, top_y) = points.tolist()
    trunk = hypot(top_x - hips_x, top_y - hips_y)
    head = (face_x + top_x) / 2.0, (face_y + top_y) / 2.0
    if not (trunk > 1.0 and head[1] < hips_y):
        return None
    half = _HALF_WIDTH * trunk
    left, right = min(head[0], hips_x) - half, max(head[0], hips_x) + half
    return DetectedPerson((left, top_y, right - left, hips_y - top_y), head, trunk, confidence)
