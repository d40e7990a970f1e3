"""Colours of the clothes below a head, which distinguish people without comparing faces.

They are measured in a box on the chest, whose position and size follow from those of the head. They
are two histograms, of lightness and of a* and b* (CIELAB). A pixel contributes to all bins near its
value, weighted by distance, so that small changes of light or noise have a small effect.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import Clothing, DetectedFace, DetectedPerson, ImageArray

Floats = NDArray[np.float32]

# Dimensions of an adult: distance of the eyes, eyes to mouth, hips to top of the head, and centre
# of the head to the tip of the nose.
_EYES_M, _EYES_TO_MOUTH_M, _TRUNK_M, _NOSE_BELOW_M = 0.062, 0.071, 0.83, 0.05
# The box: half its width, and its top and bottom below the tip of the nose.
_HALF_WIDTH_M, _TOP_M, _BOTTOM_M = 0.11, 0.20, 0.50
# Area that a nearer person covers around the tip of the nose, to either side, upwards and
# downwards.
_HEAD_HALF_M, _HEAD_UP_M, _BODY_HALF_M = 0.1, 0.18, 0.22
# Ratio of sizes below which neither of two people is known to be nearer.
_NEARER = 1.1
# Sampled pixels per side of a box, and smallest visible share of it.
_SIDE = 12
_LEAST_SHARE = 0.12


def _bin_shares(middles: NDArray[np.float64], sd: float) -> Floats:
    """Return (256, bins): share of each value in each bin, with a sum of 1."""
    near = np.exp(-0.5 * ((np.arange(256.0)[:, None] - middles) / sd) ** 2)
    return np.asarray(near / near.sum(axis=1, keepdims=True), np.float32)


# Bins of lightness, wide because people walk from light to shade, and of a* and b*, whose values
# for clothes are near that of grey.
_OF_LIGHT = _bin_shares(np.linspace(0.0, 255.0, 8), 36.0)
_OF_CHROMA = _bin_shares(128.0 + np.array([-30.0, -10.0, 10.0, 30.0]), 10.0)


class _Head(NamedTuple):
    """The tip of a nose in an image, and the scale there in pixels per metre."""

    x: float
    y: float
    px_m: float


def add_clothing(
    image: ImageArray,
    faces: tuple[DetectedFace, ...],
    people: tuple[DetectedPerson, ...] = (),
) -> tuple[tuple[DetectedFace, ...], tuple[DetectedPerson, ...]]:
    """Return faces and people with the colours of their clothes, if visible."""
    worn = []
    for heads in ([*map(face_head, faces)], [*map(_person_head, people)]):
        worn.append([clothing_colours(image, head, heads) if head else None for head in heads])
    return (
        tuple([replace(one, clothing=of) for one, of in zip(faces, worn[0], strict=True)]),
        tuple([replace(one, clothing=of) for one, of in zip(people, worn[1], strict=True)]),
    )


def clothing_colours(
    image: ImageArray, head: _Head, covering: Sequence[_Head | None]
) -> Clothing | None:
    """Return the colours below a head, None if too little is visible.

    Args:
        image: BGR image.
        head: Head whose clothes are measured.
        covering: Heads of people, who cover those farther away.
    """
    height, width = image.shape[:2]
    across = np.linspace(-_HALF_WIDTH_M, _HALF_WIDTH_M, _SIDE)
    xs = head.x + head.px_m * across
    ys = head.y + head.px_m * np.linspace(_TOP_M, _BOTTOM_M, _SIDE)
    seen = ((ys >= 0.0) & (ys < height))[:, None] & (xs >= 0.0) & (xs < width)
    for other in covering:
        if other is not None and other.px_m > head.px_m * _NEARER:
            aside, below = np.abs(xs - other.x) / other.px_m, (ys - other.y) / other.px_m
            face = (below > -_HEAD_UP_M)[:, None] & (aside < _HEAD_HALF_M)
            body = (below > _HEAD_HALF_M)[:, None] & (aside < _BODY_HALF_M)
            seen &= ~(face | body)
    share = float(seen.mean())
    if share < _LEAST_SHARE:
        return None
    rows, columns = np.clip(ys, 0, height - 1).astype(int), np.clip(xs, 0, width - 1).astype(int)
    lab = cv2.cvtColor(image[rows[:, None], columns], cv2.COLOR_BGR2LAB)[seen]
    light = _OF_LIGHT[lab[:, 0]].sum(axis=0)
    chroma = _OF_CHROMA[lab[:, 1]].T @ _OF_CHROMA[lab[:, 2]]
    both = np.concatenate([light, chroma.ravel()]) / np.float32(2 * len(lab))
    # The squares of these roots of the bins' shares add up to 1.
    return Clothing(tuple(np.sqrt(both, dtype=np.float64).round(4).tolist()), round(share, 3))


def face_head(face: DetectedFace) -> _Head | None:
    """Return the position and scale of a face; turning away shortens one of its lengths."""
    points: list[list[float]] = face.landmarks_px.tolist()
    if len(points) != 5:
        return None
    (ax, ay), (bx, by), (x, y), (cx, cy), (dx, dy) = points
    down = hypot(0.5 * (cx + dx - ax - bx), 0.5 * (cy + dy - ay - by))
    px_m = max(hypot(bx - ax, by - ay) / _EYES_M, down / _EYES_TO_MOUTH_M)
    return _Head(x, y, px_m) if 0.0 < px_m < 1e6 and abs(x) + abs(y) < 1e6 else None


def _person_head(person: DetectedPerson) -> _Head | None:
    (x, y), px_m = person.head_px, person.trunk_px / _TRUNK_M
    return _Head(x, y + _NOSE_BELOW_M * px_m, px_m) if px_m > 0.0 else None
