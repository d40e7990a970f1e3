"""Which part of a frame is searched for small faces, at which scale: one tile after another."""

from functools import cache
from math import ceil
from typing import NamedTuple

from gazerig.drivers.vision.face.mtcnn_networks import WINDOW_PX

# Ratio of neighbouring scales: a network that sees 12 pixels also finds faces of 20.
_SHRINK = 0.6
# A tile is about so many pixels wide and high in the scale at which it is searched, and shares
# so many with its neighbour: a face of 20 pixels is whole in one of them.
_TILE_PX, _SHARED_PX = 160, 24
# No frame is enlarged more than this to find small faces: there is nothing more to be seen.
_MOST_ENLARGED = 1.2


class Tile(NamedTuple):
    """A part of a frame and the size in which it is searched.

    left, top, right, bottom: in pixels of the frame
    width_px, height_px: the size it is brought to
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
    """Return the tiles in which faces are searched that are too small for the whole frame's search.

    Args:
        width_px: the frame's width.
        height_px: its height.
        far_width_px: width of the frame in which faces of 12 pixels are found; 0 for none.
        near_scale: scale at which the search of the whole frame begins.

    Returns:
        The largest faces first.
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
