"""Colours of the clothes below a head: by them people are told apart whose faces are not compared.

What counts is a box of the chest, whose place and size follow from those of the head. Its colours
are two histograms, of lightness and of a* and b* (CIELAB), in each of which a pixel counts in the
bins about it by how near it is to them, so that a little more light or noise changes little.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot
from typing import Any, NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import Clothing, DetectedFace, DetectedPerson, ImageArray

Floats = NDArray[np.float32]

# Eyes of an adult are so far apart, and so far above the mouth; from the hips to the top of the
# head; from the middle of the head to the tip of the nose.
_EYES_M, _EYES_TO_MOUTH_M, _TRUNK_M, _NOSE_BELOW_M = 0.062, 0.071, 0.83, 0.05
# The box: half its width, and from where to where below the tip of the nose it reaches.
_HALF_WIDTH_M, _TOP_M, _BOTTOM_M = 0.11, 0.20, 0.50
# A nearer person covers so much about the tip of the nose, to either side, upwards and downwards.
_HEAD_HALF_M, _HEAD_UP_M, _BODY_HALF_M = 0.1, 0.18, 0.22
# Sizes in the image that differ less may be equal, and then neither is known to be nearer.
_NEARER = 1.1
# Of one head by its face and by its body, or in two frames, they differ by no larger factor.
_AS_LARGE = 1.4
# Pixels of a box that count, to a side; seldom more than this part of it may be out of sight.
_SIDE = 12
_LEAST_SHARE = 0.12
_LEAST_PX = 3.0
# A face that is missed in a frame is there still, for so long.
_MISSED_S = 0.15


def _shares(middles: NDArray[np.float64], sd: float) -> Floats:
    """Return (256, bins): how much of each value counts in each bin, 1 together."""
    near = np.exp(-0.5 * ((np.arange(256.0)[:, None] - middles) / sd) ** 2)
    return np.asarray(near / near.sum(axis=1, keepdims=True), np.float32)


# Bins of lightness, wide as people walk from light to shade, and of a* and b*, whose values for
# clothes lie about that of grey.
_OF_LIGHT = _shares(np.linspace(0.0, 255.0, 8), 36.0)
_OF_CHROMA = _shares(128.0 + np.array([-30.0, -10.0, 10.0, 30.0]), 10.0)


class _Head(NamedTuple):
    """The tip of a nose in an image, and how many pixels a metre has there."""

    x: float
    y: float
    px_m: float


class ClothingReader:
    """Reads the colours of clothes from one frame after another."""

    def __init__(self) -> None:
        self._before: list[tuple[float, _Head]] = []

    def dressed(
        self,
        image: ImageArray,
        captured_s: float,
        faces: tuple[DetectedFace, ...],
        people: tuple[DetectedPerson, ...] = (),
    ) -> tuple[tuple[DetectedFace, ...], tuple[DetectedPerson, ...]]:
        """Return faces and people with the colours of their clothes, where they are seen.

        Args:
            image: BGR, in which they were found.
            captured_s: when it was taken.
            faces: as detected.
            people: the same.
        """
        of_faces = [_of_face(one) for one in faces]
        now = [(captured_s, head) for head in of_faces if head is not None]
        self._before = now + [
            (t_s, head)
            for t_s, head in self._before
            if 0.0 < captured_s - t_s <= _MISSED_S
            and not any(_is_same(new, head) for _, new in now)
        ]
        if not (faces or people) or image.ndim != 3 or image.size == 0:
            return faces, people
        heads = [*of_faces, *[_of_person(one) for one in people]]
        found = clothes(image, heads, [head for _, head in self._before])
        return (
            tuple([replace(one, clothing=of) for one, of in zip(faces, found, strict=False)]),
            tuple(
                [
                    replace(one, clothing=of)
                    for one, of in zip(people, found[len(faces) :], strict=True)
                ]
            ),
        )


def clothes(
    image: ImageArray, heads: Sequence[_Head | None], covering: Sequence[_Head]
) -> list[Clothing | None]:
    """Return the colours below each head, None where too little is seen of what is there.

    Args:
        image: BGR.
        heads: whose clothes are looked at.
        covering: heads of people, the same and others, who cover those farther away.
    """
    height, width = image.shape[:2]
    patches, kept, shares = [], [], []
    for k, head in enumerate(heads):
        if head is None:
            continue
        left, right = head.x - _HALF_WIDTH_M * head.px_m, head.x + _HALF_WIDTH_M * head.px_m
        top, bottom = head.y + _TOP_M * head.px_m, head.y + _BOTTOM_M * head.px_m
        if not (
            right - left >= _LEAST_PX
            and left < width
            and right > 0
            and bottom >= 0
            and top < height
        ):
            continue
        xs = left + (np.arange(_SIDE) + 0.5) * ((right - left) / _SIDE)
        ys = top + (np.arange(_SIDE) + 0.5) * ((bottom - top) / _SIDE)
        seen_x, seen_y = (xs >= 0.0) & (xs < width), (ys >= 0.0) & (ys < height)
        seen = seen_y[:, None] & seen_x
        for other in covering:
            beside = abs(other.x - head.x) > _HALF_WIDTH_M * head.px_m + _BODY_HALF_M * other.px_m
            if beside or other.y - _HEAD_UP_M * other.px_m > bottom:
                continue
            if other.px_m > head.px_m / _NEARER and not _is_same(other, head):
                seen &= ~_covered(other, xs, ys)
        share = float(np.count_nonzero(seen)) / seen.size
        if share < _LEAST_SHARE:
            continue
        rows = np.clip(ys, 0, height - 1).astype(np.intp)
        columns = np.clip(xs, 0, width - 1).astype(np.intp)
        patches.append(image[rows[:, None], columns])
        kept.append((k, seen))
        shares.append(share)
    out: list[Clothing | None] = [None] * len(heads)
    if patches:
        lab = cv2.cvtColor(np.concatenate(patches), cv2.COLOR_BGR2LAB).reshape(len(patches), -1, 3)
        for (k, seen), pixels, share in zip(kept, lab, shares, strict=True):
            out[k] = Clothing(_colours(pixels[seen.ravel()]), round(share, 3))
    return out


def _is_same(one: _Head, other: _Head) -> bool:
    """Return whether two heads are of one person."""
    as_large = 1.0 / _AS_LARGE < one.px_m / other.px_m < _AS_LARGE
    return as_large and hypot(one.x - other.x, one.y - other.y) < _HEAD_HALF_M * other.px_m


def _covered(
    by: _Head, xs: NDArray[np.floating[Any]], ys: NDArray[np.floating[Any]]
) -> NDArray[np.bool_]:
    """Return what of a grid of pixels a nearer person covers."""
    aside, below = np.abs(xs - by.x) / by.px_m, (ys - by.y) / by.px_m
    head = (below > -_HEAD_UP_M)[:, None] & (aside < _HEAD_HALF_M)
    return np.asarray(head | ((below > _HEAD_HALF_M)[:, None] & (aside < _BODY_HALF_M)))


def _colours(lab: NDArray[np.uint8]) -> tuple[float, ...]:
    """Return the roots of the shares of the bins, whose squares add up to one, of pixels (n, 3)."""
    light, a, b = _OF_LIGHT[lab[:, 0]].sum(axis=0), _OF_CHROMA[lab[:, 1]], _OF_CHROMA[lab[:, 2]]
    both = np.concatenate([light, (a.T @ b).ravel()]) / np.float32(2 * len(lab))
    return tuple(np.sqrt(both, dtype=np.float64).round(4).tolist())


def _of_face(face: DetectedFace) -> _Head | None:
    """Return where and how large a face is; a face turned away shows one of its lengths shorter."""
    points: list[list[float]] = face.landmarks_px.tolist()
    if len(points) != 5:
        return None
    (ax, ay), (bx, by), (x, y), (cx, cy), (dx, dy) = points
    down = hypot(0.5 * (cx + dx - ax - bx), 0.5 * (cy + dy - ay - by))
    px_m = max(hypot(bx - ax, by - ay) / _EYES_M, down / _EYES_TO_MOUTH_M)
    return _Head(x, y, px_m) if 0.0 < px_m < 1e6 and abs(x) + abs(y) < 1e6 else None


def _of_person(person: DetectedPerson) -> _Head | None:
    """Return where and how large the head of a person is."""
    (x, y), px_m = person.head_px, person.trunk_px / _TRUNK_M
    return _Head(x, y + _NOSE_BELOW_M * px_m, px_m) if px_m > 0.0 else None
