"""Plan of the search for small faces: one tile of the frame after another, at several scales."""

from functools import cache
from math import ceil
from typing import NamedTuple

from gazerig.drivers.vision.face.mtcnn_networks import WINDOW_PX

# Ratio of neighbouring scales: a network for 12 pixels also finds faces of 20.
_SHRINK = 0.6
# Approximate size of a tile in pixels of its scale, and its overlap with the next one: a face of 20
# pixels is complete in one of them.
_TILE_PX, _SHARED_PX = 160, 24
# Largest enlargement of a frame to find small faces; more would show no more detail.
_MOST_ENLARGED = 1.2


class Tile(NamedTuple):
    """A part of a frame and the size at which it is searched.

    left, top, right, bottom: in pixels of the frame
    width_px, height_px: its size after scaling
    """

    left: int
    top: int
    right: int
    bottom: int
    width_px: int
    height_px: int


@cache
def far_tiles(
    width_px: int, height_px: int, far_width_px: int, near_scale: float
) -> tuple[Tile, ...]:
    """Return the tiles to search for faces that are too small for the search of the whole frame.

    Args:
        width_px: Width of the frame.
        height_px: Height of the frame.
        far_width_px: Width of the frame at which faces of 12 pixels are found; 0 for none.
        near_scale: Scale at which the search of the whole frame begins.

    Returns:
        Tiles, those for the largest faces first.
    """
    tiles: list[Tile] = []
    scale = min(far_width_px / width_px, _MOST_ENLARGED)
    while scale > near_scale / _SHRINK**0.5:
        tiles = [*_of_level(width_px, height_px, scale), *tiles]
        scale *= _SHRINK
    return tuple(tiles)


def _of_level(width_px: int, height_px: int, scale: float) -> list[Tile]:
    """Return tiles of equal size that cover a frame at one scale."""
    across, down = _spans(width_px, scale), _spans(height_px, scale)
    if min(width_px, height_px) * scale < WINDOW_PX:
        return []
    size = round((across[0][1] - across[0][0]) * scale), round((down[0][1] - down[0][0]) * scale)
    return [Tile(x0, y0, x1, y1, *size) for y0, y1 in down for x0, x1 in across]


def _spans(length_px: int, scale: float) -> list[tuple[int, int]]:
    """Return equal, overlapping spans that cover a length in pixels of the frame."""
    scaled = length_px * scale
    count = max(1, ceil((scaled - _SHARED_PX) / (_TILE_PX - _SHARED_PX)))
    side = min(length_px, ceil((scaled + (count - 1) * _SHARED_PX) / count / scale))
    if count == 1:
        return [(0, length_px)]
    starts = [round(i * (length_px - side) / (count - 1)) for i in range(count)]
    return [(start, start + side) for start in starts]
