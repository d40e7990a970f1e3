"""Colours of the clothes below a head, which distinguish people without comparing faces.

They are measured in a box on the chest, whose position and size follow from those of the head. They
are two histograms, of lightness and of a* and b* (CIELAB). A pixel contributes to all bins near its
value, weighted by distance, so that small changes of light or noise have a small effect.
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
# Largest ratio of sizes of one head from its face and its body, or in two frames.
_AS_LARGE = 1.4
# Sampled pixels per side of a box, and smallest visible share of it.
_SIDE = 12
_LEAST_SHARE = 0.12
_LEAST_PX = 3.0
# Time for which a missed face counts as present.
_MISSED_S = 0.15


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


class ClothingReader:
    """Reader of the colours of clothes in consecutive frames."""

    def __init__(self) -> None:
        self._before: list[tuple[float, _Head]] = []

    def add_clothing(
        self,
        image: ImageArray,
        captured_s: float,
        faces: tuple[DetectedFace, ...],
        people: tuple[DetectedPerson, ...] = (),
    ) -> tuple[tuple[DetectedFace, ...], tuple[DetectedPerson, ...]]:
        """Return faces and people with the colours of their clothes, if visible."""
        of_faces = [_face_head(one) for one in faces]
        now = [(captured_s, head) for head in of_faces if head is not None]
        self._before = now + [
            (t_s, head)
            for t_s, head in self._before
            if 0.0 < captured_s - t_s <= _MISSED_S
            and not any(_is_same(new, head) for _, new in now)
        ]
        if not (faces or people) or image.ndim != 3 or image.size == 0:
            return faces, people
        heads = [*of_faces, *[_person_head(one) for one in people]]
        found = clothing_colours(image, heads, [head for _, head in self._before])
        return (
            tuple([replace(one, clothing=of) for one, of in zip(faces, found, strict=False)]),
            tuple(
                [
                    replace(one, clothing=of)
                    for one, of in zip(people, found[len(faces) :], strict=True)
                ]
            ),
        )


def clothing_colours(
    image: ImageArray, heads: Sequence[_Head | None], covering: Sequence[_Head]
) -> list[Clothing | None]:
    """Return the colours below each head, None if too little is visible.

    Args:
        image: BGR image.
        heads: Heads whose clothes are measured.
        covering: Heads of all people, who cover those farther away.
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
                seen &= ~_covered_mask(other, xs, ys)
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
            inside = pixels[seen.ravel()]
            light = _OF_LIGHT[inside[:, 0]].sum(axis=0)
            a, b = _OF_CHROMA[inside[:, 1]], _OF_CHROMA[inside[:, 2]]
            both = np.concatenate([light, (a.T @ b).ravel()]) / np.float32(2 * len(inside))
            # The squares of these roots of the bins' shares add up to 1.
            roots = tuple(np.sqrt(both, dtype=np.float64).round(4).tolist())
            out[k] = Clothing(roots, round(share, 3))
    return out


def _is_same(one: _Head, other: _Head) -> bool:
    """Return whether two heads belong to one person."""
    as_large = 1.0 / _AS_LARGE < one.px_m / other.px_m < _AS_LARGE
    return as_large and hypot(one.x - other.x, one.y - other.y) < _HEAD_HALF_M * other.px_m


def _covered_mask(
    by: _Head, xs: NDArray[np.floating[Any]], ys: NDArray[np.floating[Any]]
) -> NDArray[np.bool_]:
    """Return a mask of the grid of pixels that a nearer person covers."""
    aside, below = np.abs(xs - by.x) / by.px_m, (ys - by.y) / by.px_m
    head = (below > -_HEAD_UP_M)[:, None] & (aside < _HEAD_HALF_M)
    return np.asarray(head | ((below > _HEAD_HALF_M)[:, None] & (aside < _BODY_HALF_M)))


def _face_head(face: DetectedFace) -> _Head | None:
    """Return the position and scale of a face; turning away shortens one of its lengths."""
    points: list[list[float]] = face.landmarks_px.tolist()
    if len(points) != 5:
        return None
    (ax, ay), (bx, by), (x, y), (cx, cy), (dx, dy) = points
    down = hypot(0.5 * (cx + dx - ax - bx), 0.5 * (cy + dy - ay - by))
    px_m = max(hypot(bx - ax, by - ay) / _EYES_M, down / _EYES_TO_MOUTH_M)
    return _Head(x, y, px_m) if 0.0 < px_m < 1e6 and abs(x) + abs(y) < 1e6 else None


def _person_head(person: DetectedPerson) -> _Head | None:
    """Return the position and scale of a person's head."""
    (x, y), px_m = person.head_px, person.trunk_px / _TRUNK_M
    return _Head(x, y + _NOSE_BELOW_M * px_m, px_m) if px_m > 0.0 else None
