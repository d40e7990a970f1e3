"""Pictures for the surfaces of rooms, painted by the program: wood, cloth, books, a view.

Each has shape (rows, columns, 3): red, green, blue, 0..255, the first row at the top.
"""

from collections.abc import Callable, Mapping
from functools import lru_cache
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Colour

Image = NDArray[np.uint8]


class _Sheet(NamedTuple):
    """Picture under construction: x and y in 0..1 from the left and the top."""

    rgb: Floats
    x: Floats
    y: Floats


def _sheet(rows: int, columns: int, colour: Colour) -> _Sheet:
    y, x = np.mgrid[0:rows, 0:columns].astype(float)
    rgb = np.tile(np.array(colour, float), (rows, columns, 1))
    return _Sheet(rgb, x / (columns - 1), y / (rows - 1))


def _noise(rows: int, columns: int, cells: tuple[int, int], seed: int) -> Floats:
    """Return smooth noise with mean 0, standard deviation 1 and ``cells`` rows and columns."""
    rng = np.random.default_rng(seed)
    coarse = rng.normal(size=cells).astype(np.float32)
    return np.asarray(cv2.resize(coarse, (columns, rows), interpolation=cv2.INTER_CUBIC), float)


def _planks() -> Floats:
    rows, columns, boards = 256, 256, 8
    out = _sheet(rows, columns, (176, 136, 96)).rgb
    rng = np.random.default_rng(3)
    grain = _noise(rows, columns, (120, 6), 4)
    high = rows // boards
    for board in range(boards):
        part = slice(board * high, (board + 1) * high)
        out[part] *= rng.uniform(0.86, 1.10)
        joint = int(rng.integers(0, columns - 2))
        out[part, joint : joint + 2] *= 0.72
        out[board * high] *= 0.70
    return np.asarray(out + 5.0 * grain[..., None])


def _rug() -> Floats:
    rgb, x, y = _sheet(192, 256, (146, 62, 58))
    u, v = np.abs(x - 0.5) * 2.0, np.abs(y - 0.5) * 2.0
    edge = np.maximum(u, v)
    rgb[(edge > 0.80) & (edge < 0.86)] = (226, 196, 146)
    rgb[edge > 0.93] = (58, 62, 92)
    diamond = (np.abs((4.0 * x) % 1.0 - 0.5) + np.abs((3.0 * y) % 1.0 - 0.5)) < 0.28
    rgb[diamond & (edge < 0.78)] = (196, 150, 104)
    core = (np.abs((4.0 * x) % 1.0 - 0.5) + np.abs((3.0 * y) % 1.0 - 0.5)) < 0.13
    rgb[core & (edge < 0.78)] = (64, 70, 104)
    return np.asarray(rgb + 6.0 * _noise(192, 256, (96, 128), 8)[..., None])


def _books() -> Floats:
    rows, columns, shelves = 320, 256, 5
    out = _sheet(rows, columns, (96, 68, 46)).rgb
    rng = np.random.default_rng(11)
    tones = np.array(
        [(150, 52, 48), (46, 74, 112), (70, 104, 76), (198, 170, 110), (86, 62, 92),
         (206, 200, 188), (54, 54, 60), (188, 110, 58), (112, 140, 150)], float
    )  # fmt: skip
    high = rows // shelves
    for shelf in range(shelves):
        floor = (shelf + 1) * high - 6
        at = 4
        while at < columns - 12:
            wide, tall = int(rng.integers(5, 13)), int(rng.integers(high // 2, high - 14))
            if rng.random() < 0.1:
                at += int(rng.integers(8, 22))
                continue
            tone = tones[int(rng.integers(len(tones)))] * rng.uniform(0.8, 1.1)
            out[floor - tall : floor, at : at + wide] = tone
            out[floor - tall : floor, at] *= 0.6
            out[floor - tall + 6 : floor - tall + 9, at + 1 : at + wide - 1] = tone * 0.4 + 130.0
            at += wide
        out[floor : floor + 6] = (134, 98, 66)
    return out


def _window() -> Floats:
    rows, columns = 384, 384
    rgb, x, y = _sheet(rows, columns, (186, 212, 236))
    rgb += (60.0 * np.clip(y, 0.0, 0.6))[..., None] * (1.0, 0.8, 0.4)
    hill = 0.62 + 0.05 * np.sin(5.0 * x + 1.0) + 0.03 * np.sin(13.0 * x)
    rgb[y > hill] = (142, 172, 128)
    wood = 0.72 + 0.05 * np.sin(8.0 * x + 2.0) + 0.02 * _noise(rows, columns, (4, 24), 5)
    rgb[y > wood] = (98, 134, 92)
    rgb += 6.0 * _noise(rows, columns, (40, 40), 6)[..., None]
    return np.asarray(cv2.GaussianBlur(rgb, (0, 0), 1.6), float)


def _landscape() -> Floats:
    rgb, x, y = _sheet(160, 224, (232, 206, 166))
    rgb[y > 0.45 + 0.12 * np.sin(4.0 * x)] = (92, 122, 152)
    rgb[y > 0.66 + 0.07 * np.sin(7.0 * x + 1.0)] = (62, 88, 82)
    rgb[(x - 0.72) ** 2 + (1.0 * (y - 0.28)) ** 2 < 0.010] = (226, 116, 68)
    return _add_frame(rgb, x, y, (240, 236, 226), (52, 44, 38))


def _shapes() -> Floats:
    rgb, x, y = _sheet(224, 176, (238, 232, 218))
    for cx, cy, r, colour in (
        (0.35, 0.32, 0.20, (204, 84, 62)),
        (0.66, 0.44, 0.16, (52, 92, 128)),
        (0.45, 0.70, 0.24, (226, 178, 74)),
        (0.72, 0.76, 0.08, (40, 44, 52)),
    ):
        rgb[(x - cx) ** 2 + (1.27 * (y - cy)) ** 2 < r * r] = colour
    return _add_frame(rgb, x, y, (246, 244, 238), (120, 88, 58))


def _add_frame(rgb: Floats, x: Floats, y: Floats, mount: Colour, frame: Colour) -> Floats:
    edge = np.maximum(np.abs(x - 0.5), np.abs(y - 0.5)) * 2.0
    rgb[edge > 0.80] = mount
    rgb[edge > 0.92] = frame
    return rgb


def _wallpaper() -> Floats:
    rgb, x, y = _sheet(128, 128, (232, 222, 198))
    leaf = np.sin(4.0 * np.pi * x + 2.0 * np.sin(2.0 * np.pi * y)) * np.sin(4.0 * np.pi * y)
    return np.asarray(rgb - 12.0 * np.clip(leaf, 0.0, 1.0)[..., None] * (1.0, 0.7, 1.0))


def _plaster() -> Floats:
    rgb = _sheet(128, 128, (230, 224, 212)).rgb
    return np.asarray(rgb + 3.0 * _noise(128, 128, (24, 24), 9)[..., None])


def _cloth() -> Floats:
    rgb, x, y = _sheet(96, 96, (86, 112, 122))
    weave = np.sin(48.0 * np.pi * x) * np.sin(48.0 * np.pi * y)
    return np.asarray(rgb + 9.0 * weave[..., None])


def _bricks() -> Floats:
    rows, columns = 256, 256
    out = _sheet(rows, columns, (156, 150, 142)).rgb
    rng = np.random.default_rng(21)
    high, wide = 16, 43
    for course in range(rows // high):
        shift = (course % 2) * wide // 2
        for k in range(-1, columns // wide + 1):
            left, right = max(0, k * wide + shift + 2), min(columns, (k + 1) * wide + shift)
            if right > left:
                tone = np.array((142, 78, 62)) * rng.uniform(0.82, 1.14)
                out[course * high + 2 : (course + 1) * high, left:right] = tone
    return np.asarray(out + 5.0 * _noise(rows, columns, (64, 64), 22)[..., None])


def _canvas() -> Floats:
    rgb, x, y = _sheet(256, 256, (176, 186, 196))
    ring = np.hypot(x - 0.5, y - 0.5)
    rgb[(ring > 0.24) & (ring < 0.26)] = (66, 84, 120)
    return np.asarray(rgb + 4.0 * _noise(256, 256, (30, 30), 12)[..., None])


def _poster() -> Floats:
    rgb, x, y = _sheet(224, 160, (232, 196, 72))
    rgb[(y > 0.62) & (y < 0.72) & (np.abs(x - 0.5) < 0.36)] = (34, 32, 36)
    rgb[(y > 0.77) & (y < 0.82) & (np.abs(x - 0.5) < 0.28)] = (34, 32, 36)
    for cx in (0.34, 0.66):
        rgb[(x - cx) ** 2 + (1.4 * (y - 0.34)) ** 2 < 0.020] = (188, 36, 40)
        rgb[(np.abs(x - cx) < 0.07) & (y > 0.42) & (y < 0.52)] = (240, 238, 230)
    return _add_frame(rgb, x, y, (244, 240, 230), (40, 38, 40))


def _tiles() -> Floats:
    rgb, x, y = _sheet(128, 128, (186, 182, 174))
    rgb[((np.floor(2.0 * x) + np.floor(2.0 * y)) % 2) > 0] = (160, 158, 154)
    joint = (np.abs((2.0 * x) % 1.0) < 0.02) | (np.abs((2.0 * y) % 1.0) < 0.02)
    rgb[joint] = (128, 124, 120)
    return np.asarray(rgb + 3.0 * _noise(128, 128, (32, 32), 14)[..., None])


PICTURES: Mapping[str, Callable[[], Floats]] = {
    "planks": _planks,
    "rug": _rug,
    "books": _books,
    "window": _window,
    "landscape": _landscape,
    "shapes": _shapes,
    "wallpaper": _wallpaper,
    "plaster": _plaster,
    "cloth": _cloth,
    "bricks": _bricks,
    "canvas": _canvas,
    "poster": _poster,
    "tiles": _tiles,
}
"""The painters of all pictures, by name."""


@lru_cache(maxsize=len(PICTURES))
def texture(name: str) -> Image:
    """Return a picture by its name."""
    return np.rint(np.clip(PICTURES[name](), 0.0, 255.0)).astype(np.uint8)
