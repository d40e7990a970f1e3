"""Face detection with MTCNN alone: every frame is searched completely, at every scale."""

from collections.abc import Iterator

import cv2
import numpy as np

from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.mtcnn_networks import (
    WINDOW_PX,
    Floats,
    MtcnnNetworks,
    PlacedFaces,
    Rows,
    overlap_shares,
    suppress_overlaps,
    to_squares,
)
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import PreparedImage, largest_first, prepare

# Ratio of neighbouring scales of the pyramid: areas halve.
_SHRINK = 0.709
# Confidence threshold of the first stage. At 0.6 twice as many candidates pass, in twice the time,
# without finding more faces.
_PROPOSE_AT = 0.8
# Common share of the smaller of two boxes above which they are the same face.
_NESTED = 0.7
# Most candidates of the second stage, which limits the time for a complex image.
_MOST = 96


class MtcnnDetector:
    """Detector of faces with five landmarks."""

    def __init__(self, params: FaceDetectorParams) -> None:
        """Load the networks.

        Raises:
            ModelFileError: the package or one of its files is missing or altered.
        """
        self._params = params
        self._networks = MtcnnNetworks()

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Return faces, the largest first, in pixels of the image."""
        prepared = prepare(image, self._params.work_width_px)
        if prepared is None:
            return ()
        boxes = self._networks.refine(
            prepared.full, propose_faces(self._networks, prepared, self._params.min_face_px)
        )
        placed = self._networks.place(prepared.full, boxes)
        sure = np.nonzero(placed.scores >= self._params.min_confidence)[0]
        keep = sure[suppress_nested(placed.tight[sure], placed.scores[sure])]
        return largest_first([face_of(placed, i) for i in keep])


def propose_faces(networks: MtcnnNetworks, prepared: PreparedImage, min_face_px: int) -> Floats:
    """Search an image at every scale; return (n, 4) square boxes, most confident first."""
    boxes, scores = [np.zeros((0, 4))], [np.zeros(0)]
    for scaled in _pyramid(prepared.small, WINDOW_PX / min_face_px):
        found, sure = networks.propose(scaled, _PROPOSE_AT)
        height, width = prepared.full.shape[:2]
        boxes.append(found * np.tile((width / scaled.shape[1], height / scaled.shape[0]), 2))
        scores.append(sure)
    every = np.concatenate(boxes)
    return to_squares(every[suppress_overlaps(every, np.concatenate(scores))[:_MOST]])


def _pyramid(small: ImageArray, scale: float) -> Iterator[ImageArray]:
    """Yield an image at decreasing scales until it is one window wide, for faces of all sizes."""
    scaled, fine = small, cv2.INTER_AREA
    while min(size := (round(small.shape[1] * scale), round(small.shape[0] * scale))) >= WINDOW_PX:
        scaled = np.asarray(cv2.resize(scaled, size, interpolation=fine), dtype=np.uint8)
        yield scaled
        scale, fine = scale * _SHRINK, cv2.INTER_LINEAR


def suppress_nested(boxes: Floats, scores: Floats) -> Rows:
    """Return the rows that remain without boxes mostly inside or around a more confident one."""
    common = overlap_shares(boxes, boxes)
    kept: list[int] = []
    for i in np.argsort(-scores, kind="stable").tolist():
        if not np.any(common[i, kept] > _NESTED):
            kept.append(i)
    return np.array(kept, dtype=np.intp)


def face_of(placed: PlacedFaces, row: int) -> DetectedFace:
    """Return a face in pixels of the image, whose centres are whole numbers."""
    # The network names points by the viewer's left and right, which are the person's right and
    # left, so its order is that of DetectedFace.
    landmarks = placed.points[row] - 0.5
    landmarks.setflags(write=False)
    left, top, right, bottom = placed.tight[row].tolist()
    box = left - 0.5, top - 0.5, right - left, bottom - top
    return DetectedFace(box, landmarks, float(placed.scores[row]))
