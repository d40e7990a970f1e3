"""Faces by MTCNN alone: every frame is searched whole, at every scale."""

from collections.abc import Iterator

import cv2
import numpy as np

from gazerig.drivers.types import DetectedFace, ImageArray
from gazerig.drivers.vision.face.mtcnn_networks import (
    WINDOW_PX,
    Floats,
    MtcnnNetworks,
    Placed,
    Rows,
    merged,
    shares,
    squared,
)
from gazerig.drivers.vision.face.params import FaceDetectorParams
from gazerig.drivers.vision.face.preprocess import Prepared, largest_first, prepare

# Ratio of neighbouring scales of the pyramid: areas halve.
_SHRINK = 0.709
# Confidence that passes the first stage. A gate of 0.6 lets twice as many through, at twice
# the time, and finds no face more.
_PROPOSE_AT = 0.8
# Part of the smaller of two boxes above which they are the same face.
_NESTED = 0.7
# Most candidates carried to the second stage: bounds the time a busy image can take.
_MOST = 96


class MtcnnDetector:
    """Finds faces with five landmarks."""

    def __init__(self, params: FaceDetectorParams) -> None:
        """Load the networks.

        Raises:
            ModelFileError: the package or one of its files is missing or altered.
        """
        self._params = params
        self._networks = MtcnnNetworks()

    def find(self, image: ImageArray) -> tuple[DetectedFace, ...]:
        """Find faces, the largest first, in pixels of the image given."""
        prepared = prepare(image, self._params.work_width_px)
        if prepared is None:
            return ()
        boxes = self._networks.refine(
            prepared.full, proposed(self._networks, prepared, self._params.min_face_px)
        )
        placed = self._networks.place(prepared.full, boxes)
        sure = np.nonzero(placed.scores >= self._params.min_confidence)[0]
        keep = sure[outermost(placed.tight[sure], placed.scores[sure])]
        return largest_first([face_of(placed, i) for i in keep])


def proposed(networks: MtcnnNetworks, prepared: Prepared, min_face_px: int) -> Floats:
    """Search a whole image at every scale: (n, 4) square boxes in full size, the surest first."""
    boxes, scores = [np.zeros((0, 4))], [np.zeros(0)]
    for scaled in _pyramid(prepared.small, WINDOW_PX / min_face_px):
        found, sure = networks.propose(scaled, _PROPOSE_AT)
        height, width = prepared.full.shape[:2]
        boxes.append(found * np.tile((width / scaled.shape[1], height / scaled.shape[0]), 2))
        scores.append(sure)
    every = np.concatenate(boxes)
    return squared(every[merged(every, np.concatenate(scores))[:_MOST]])


def _pyramid(small: ImageArray, scale: float) -> Iterator[ImageArray]:
    """Shrink a image until it is one window wide: at each scale, faces of another size fit."""
    scaled, fine = small, cv2.INTER_AREA
    while min(size := (round(small.shape[1] * scale), round(small.shape[0] * scale))) >= WINDOW_PX:
        scaled = np.asarray(cv2.resize(scaled, size, interpolation=fine), dtype=np.uint8)
        yield scaled
        scale, fine = scale * _SHRINK, cv2.INTER_LINEAR


def outermost(boxes: Floats, scores: Floats) -> Rows:
    """Return the rows that stay when a box mostly inside a surer one, or around it, goes."""
    common = shares(boxes, boxes)
    kept: list[int] = []
    for i in np.argsort(-scores, kind="stable").tolist():
        if not np.any(common[i, kept] > _NESTED):
            kept.append(i)
    return np.array(kept, dtype=np.intp)


def face_of(placed: Placed, row: int) -> DetectedFace:
    """Put a find into pixels of the image given, whose centres are whole numbers."""
    # The network names points by the viewer's left and right, which are the owner's
    # right and left: its order is the order of DetectedFace.
    landmarks = placed.points[row] - 0.5
    landmarks.setflags(write=False)
    left, top, right, bottom = placed.tight[row].tolist()
    box = left - 0.5, top - 0.5, right - left, bottom - top
    return DetectedFace(box, landmarks, float(placed.scores[row]))
