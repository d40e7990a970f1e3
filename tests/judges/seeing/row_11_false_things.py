"""A stationary camera: compression, light and shadows in a room are no things.

Figures: share of the pictures with a thing although nothing moves (false), and of what moves, the
share on which a thing is reported (recall). Rendered people walk through a rendered room that is
then compressed, lit or shaded.
"""

from collections.abc import Callable, Iterator
from functools import partial

import cv2
import numpy as np
from seeing.material import noisy
from seeing.moving_room import (
    HEIGHT,
    PEOPLE,
    PLAIN,
    WIDTH,
    Image,
    Seen,
    frames,
    still,
)
from seeing.row_02_camera_motion import judged

_NOISE_LEVELS, _TREMBLE_PX = 1.0, 0.08
Change = Callable[[Iterator[Seen]], Iterator[Seen]]


def jpeg(quality: int, seen: Iterator[Seen]) -> Iterator[Seen]:
    """Compress each frame separately."""
    for one in seen:
        _, data = cv2.imencode(".jpg", one.image, (cv2.IMWRITE_JPEG_QUALITY, quality))
        yield one._replace(image=_decoded(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)))


def exposed(seen: Iterator[Seen]) -> Iterator[Seen]:
    """Let the exposure follow, as a camera's does: by 8 % within a second."""
    for one in seen:
        yield _lit(one, 1.0 + 0.08 * np.sin(2.0 * np.pi * 0.5 * one.t_s))


def flickering(seen: Iterator[Seen]) -> Iterator[Seen]:
    """Light with lamps on 50 Hz, read row by row within 20 ms: bands that wander."""
    for one in seen:
        rows = one.t_s + 0.020 * np.arange(len(one.image)) / len(one.image)
        yield _lit(one, 1.0 + 0.05 * np.sin(2.0 * np.pi * 100.0 * rows)[:, None])


def shaded(seen: Iterator[Seen]) -> Iterator[Seen]:
    """Let a faint soft shadow pass that darkens by 12 %."""
    for one in seen:
        y, x = np.mgrid[: one.image.shape[0], : one.image.shape[1]]
        off = ((x - 60.0 - 240.0 * one.t_s) / 70.0) ** 2 + ((y - 150.0) / 90.0) ** 2
        yield _lit(one, 1.0 - 0.12 * np.exp(-off))


ROOMS: dict[str, Change] = {
    "JPEG of quality 30": partial(jpeg, 30),
    "exposure that drifts": exposed,
    "lamps on 50 Hz": flickering,
    "a faint shadow": shaded,
}
WANTED = {
    f"{name}: {figure}": band
    for name in (*ROOMS, *(f"{name}, nobody" for name in ROOMS))
    for figure, band in {"false": (0.0, 0.02), "recall": (0.95, 1.0)}.items()
    if figure == "false" or "nobody" not in name
}


def plain_room(seconds: float, people: bool) -> Iterator[Seen]:
    """Yield people before a plain wall with a board, a skirting and a screen: straight edges.

    The camera trembles from frame to frame.
    """
    room = np.full((HEIGHT, WIDTH), 178.0, np.float32)
    board = np.array([(470, 50), (640, 22), (640, 300), (500, 320)], np.int32)
    cv2.fillPoly(room, [board], (95.0,), cv2.LINE_AA)
    cv2.line(room, (0, 312), (WIDTH, 304), (120.0,), 2, cv2.LINE_AA)
    cv2.fillPoly(room, [np.array([(0, 60), (90, 110), (70, 400), (0, 400)], np.int32)], (30.0,))
    rng = np.random.default_rng(2)
    for one in frames(still, seconds, PEOPLE if people else (), PLAIN):
        x, y = rng.normal(0.0, _TREMBLE_PX, 2)
        M = np.array([(1.0, 0.0, x), (0.0, 1.0, y)])
        moved = cv2.warpAffine(room, M, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REPLICATE)
        image = noisy(np.asarray(moved, np.float32), _NOISE_LEVELS, rng)
        for mask in (*one.movers, *one.resting):
            image[mask] = one.image[mask]
        yield one._replace(image=image)


def changed(change: Change, people: bool, seconds: float) -> tuple[float, float]:
    """Return false things a picture and recall in the rendered room."""
    score = judged(change(plain_room(seconds, people)))
    recall = score.noticed / score.moving if score.moving else 1.0
    return score.false / score.pictures, recall


def measure(full: bool) -> dict[str, float]:
    """Return the figures; full: longer."""
    out: dict[str, float] = {}
    for name, change in ROOMS.items():
        seconds = 4.0 if full else 0.8
        out[f"{name}: false"], out[f"{name}: recall"] = changed(change, True, seconds)
        out[f"{name}, nobody: false"], _ = changed(change, False, seconds)
    return out


def _lit(one: Seen, factor: float | np.ndarray) -> Seen:
    return one._replace(image=np.clip(one.image * factor, 0, 255).astype(np.uint8))


def _decoded(image: object) -> Image:
    return np.asarray(image, np.uint8)
