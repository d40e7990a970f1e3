"""Face detection with YuNet (Wu et al. 2023), by OpenCV."""

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.camera.quiet_opencv import quiet_opencv
from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.preprocess import (
    Boxes,
    FoundFace,
    Tile,
    new_faces,
)
from gazerig.drivers.vision.model_files import YUNET

# Intersection over union above which boxes are the same face, and most boxes: values of the OpenCV
# zoo.
_SAME, _MOST = 0.3, 5000
_CONFIDENCE = 0.7
# Narrower frames are not searched: OpenCV reads beyond the memory of strips a few pixels wide.
_LEAST_PX = 24
# Half the side of a face's square, in root mean square distances of the five landmarks from their
# centre, and its offset above that centre.
_SQUARE, _ABOVE = 2.1, 0.13


class YunetDetector:
    """Detector of faces with five landmarks."""

    def __init__(self) -> None:
        """Load the network.

        Raises:
            FileNotFoundError: the user has no file for it.
            ModelFileError: it cannot be read or is damaged.
        """
        weights, nothing = np.frombuffer(YUNET.read(), dtype=np.uint8), np.zeros(0, np.uint8)
        with quiet_opencv():
            self._net = cv2.FaceDetectorYN.create(
                "onnx", weights, nothing, (64, 64), _CONFIDENCE, _SAME, _MOST
            )

    def search(
        self, frame: ImageArray, tile: Tile, known: list[FoundFace], least: float
    ) -> list[FoundFace]:
        """Search a tile of a frame; return the faces that are not among the known ones."""
        part, scaled = tile.cut(frame)
        height, width = scaled.shape[:2]
        if min(height, width) < _LEAST_PX:
            return []
        self._net.setInputSize((width, height))
        self._net.setScoreThreshold(least)
        rows = self._net.detect(np.ascontiguousarray(scaled))[1]
        if rows is None:  # OpenCV's value for no face
            return []
        # Box, right eye, left eye, nose, right and left mouth corner, confidence.
        found = np.asarray(rows, dtype=np.float64)
        found = found[np.isfinite(found).all(axis=1)]
        corner = tile.left, tile.top
        found[:, :14] *= np.tile((part.shape[1] / width, part.shape[0] / height), 7)
        found[:, :2] += corner
        found[:, 4:14] += np.tile(corner, 5)
        return new_faces([_found(row) for row in found], known)

    def place(self, frame: ImageArray, boxes: Boxes, least: float) -> list[FoundFace | None]:
        """Return None for each box: this network only searches."""
        return [None] * len(boxes)


def _found(row: NDArray[np.float64]) -> FoundFace:
    """Return a face from OpenCV's fifteen numbers, and its square.

    The network counts from the outer edge of the first pixel, DetectedFace from its centre.
    """
    left, top, width, height = row[:4].tolist()
    points = row[4:14].reshape(5, 2)
    middle = points.mean(axis=0)
    spread = float(np.sqrt(((points - middle) ** 2).sum(axis=1).mean()))
    middle = middle - (0.0, _ABOVE * spread)
    box: Boxes = np.concatenate([middle - _SQUARE * spread, middle + _SQUARE * spread])
    landmarks = points - 0.5
    landmarks.setflags(write=False)
    face = DetectedFace((left - 0.5, top - 0.5, width, height), landmarks, float(row[14]))
    return FoundFace(box, face, False)
