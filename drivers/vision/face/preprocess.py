"""Preparation of images for a face network."""

from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import DetectedFace, ImageArray

# Grey levels of an image: share outside its range at each end; contrast below which it is flat,
# wanted contrast, and largest gain.
_OUTSIDE, _FLAT_GREY, _WANTED_GREY, _MOST_GAIN = 0.01, 110.0, 200.0, 8.0
# Gain from which sensor noise would be visible, so that the image is smoothed.
_NOISY_GAIN, _SMOOTHED_PX = 2.5, 0.8
_SAMPLED = 4


Boxes = NDArray[np.float64]
"""Rows (left, top, right, bottom) of pixel edges; or one such row."""


class FoundFace(NamedTuple):
    """A face, and the square in which it is searched next.

    box: (4,), pixel edges
    by_mtcnn: whether MTCNN finds it
    """

    box: Boxes
    face: DetectedFace
    by_mtcnn: bool


class Tile(NamedTuple):
    """A part of a frame and the size at which it is searched.

    left, top, right, bottom: edges in pixels of the frame
    width_px, height_px: its size after scaling
    every_scale: whether larger faces than those of this scale are searched, too
    """

    left: int
    top: int
    right: int
    bottom: int
    width_px: int
    height_px: int
    every_scale: bool = False

    def cut(self, frame: ImageArray) -> tuple[ImageArray, ImageArray]:
        """Return the part of a frame, in the original size and scaled."""
        part = frame[self.top : self.bottom, self.left : self.right]
        size = self.width_px, self.height_px
        if size == (part.shape[1], part.shape[0]):
            return part, part
        way = cv2.INTER_AREA if part.shape[1] > self.width_px else cv2.INTER_LINEAR
        return part, np.asarray(cv2.resize(part, size, interpolation=way), np.uint8)


def whole_image(frame: ImageArray, work_width_px: int) -> Tile:
    """Return a whole frame as one tile, scaled down to the working width."""
    height, width = frame.shape[:2]
    scaled = min(width, work_width_px)
    return Tile(0, 0, width, height, scaled, max(1, round(height * scaled / width)), True)


# Common share of the smaller of two boxes above which they are the same face.
_SAME = 0.5


def is_new(boxes: Boxes, known: list[FoundFace]) -> NDArray[np.bool_]:
    """Return a mask of the boxes that are not those of known faces."""
    others = _corners(known)
    low = np.maximum(boxes[:, np.newaxis, :2], others[:, :2])
    high = np.minimum(boxes[:, np.newaxis, 2:], others[:, 2:])
    common = np.prod(np.maximum(high - low, 0.0), axis=2)
    area, other_area = (np.prod(rows[:, 2:] - rows[:, :2], axis=1) for rows in (boxes, others))
    share = common / np.maximum(np.minimum(area[:, np.newaxis], other_area), 1e-9)
    return np.asarray(~(share > _SAME).any(axis=1))


def new_faces(found: list[FoundFace], known: list[FoundFace]) -> list[FoundFace]:
    """Return the found faces that are not known and not duplicates of a more confident one."""
    kept: list[FoundFace] = []
    for one in sorted(found, key=lambda face: (not face.by_mtcnn, -face.face.confidence)):
        if is_new(_corners([one]), [*known, *kept])[0]:
            kept.append(one)
    return kept


def _corners(found: list[FoundFace]) -> Boxes:
    """Return the boxes of faces in this frame; their search boxes may be those for the next one."""
    boxes = np.array([one.face.box_px for one in found]).reshape(-1, 4)
    boxes[:, 2:] += boxes[:, :2]
    return boxes


def to_squares(boxes: Boxes) -> Boxes:
    """Return boxes widened to squares with the same centre."""
    centre = (boxes[:, 2:] + boxes[:, :2]) / 2.0
    half = (boxes[:, 2:] - boxes[:, :2]).max(axis=1, keepdims=True) / 2.0
    return np.hstack([centre - half, centre + half])


def grey_range(samples: NDArray[Any]) -> tuple[float, float]:
    """Return the grey levels below and above which a hundredth of an image is."""
    ordered = np.sort(samples, axis=None)
    count = len(ordered)
    return float(ordered[int(_OUTSIDE * count)]), float(ordered[int((1.0 - _OUTSIDE) * count)])


def improve_contrast(image: ImageArray) -> ImageArray:
    """Return a dark or pale image with the contrast that a network needs, others unchanged.

    A high gain also amplifies noise, so the image is then smoothed.
    """
    dark, bright = grey_range(image[::_SAMPLED, ::_SAMPLED, 1])
    if bright - dark >= _FLAT_GREY:
        return image
    gain = min(_WANTED_GREY / max(bright - dark, 1.0), _MOST_GAIN)
    table = np.clip((np.arange(256) - dark) * gain, 0.0, 255.0).astype(np.uint8)
    out = cv2.LUT(image, table)
    if gain > _NOISY_GAIN:
        out = cv2.GaussianBlur(out, (0, 0), _SMOOTHED_PX)
    return np.asarray(out, np.uint8)


def sort_by_size(faces: list[DetectedFace]) -> tuple[DetectedFace, ...]:
    """Return faces sorted by box area, equal areas by position, so that the order is fixed."""
    return tuple(sorted(faces, key=lambda f: (-f.box_px[2] * f.box_px[3], f.box_px)))


# Boxes that are shrunk by more than this are cropped at whole pixels and averaged; others are
# cropped between pixels, as half a pixel matters for a face of ten.
_AVERAGED_FROM = 1.5


def crop_square(
    image: ImageArray, box: NDArray[np.float64], side_px: int
) -> tuple[ImageArray, NDArray[np.float64]]:
    """Crop a square box (left, top, right, bottom; pixel edges), black beyond the image.

    Returns:
        The crop (side_px, side_px, 3), and its actual box, which differs from the given one by less
        than a pixel.
    """
    if box[2] - box[0] > _AVERAGED_FROM * side_px:
        box = np.rint(box)
        left, top, right, bottom = box.astype(int).tolist()
        M = np.array([[1.0, 0.0, -left], [0.0, 1.0, -top]])
        whole = cv2.warpAffine(image, M, (right - left, bottom - top), flags=cv2.INTER_NEAREST)
        part = cv2.resize(whole, (side_px, side_px), interpolation=cv2.INTER_AREA)
        return np.asarray(part, np.uint8), box
    left, top, right, bottom = box.tolist()
    x, y = side_px / max(right - left, 1e-3), side_px / max(bottom - top, 1e-3)
    # Pixel edges are whole numbers here; in OpenCV pixel centres are.
    M = np.array([[x, 0.0, (0.5 - left) * x - 0.5], [0.0, y, (0.5 - top) * y - 0.5]])
    part = cv2.warpAffine(image, M, (side_px, side_px), flags=cv2.INTER_CUBIC)
    return np.asarray(part, np.uint8), box
