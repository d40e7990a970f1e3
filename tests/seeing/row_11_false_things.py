"""A stationary camera: compression, light and shadows in a room are no things.

Figures: share of the pictures with a thing although nothing moves (false), and of what moves, the
share on which a thing is reported (recall). Rendered people walk through a rendered room that is
then compressed, lit or shaded; the films at hand are of webcams on a tripod.
"""

import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import cv2
import numpy as np
from seeing.material import at_hand, noisy
from seeing.moving_room import (
    FIELD_RAD,
    HEIGHT,
    PEOPLE,
    PLAIN,
    RATE_HZ,
    WIDTH,
    Image,
    Mask,
    Seen,
    frames,
    still,
)
from seeing.row_02_camera_motion import _on, judged

from gazerig.drivers.camera.source import Shot
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.perception.motion_source import MotionSource

_NOISE_LEVELS, _TREMBLE_PX = 1.0, 0.08
Change = Callable[[Iterator[Seen]], Iterator[Seen]]
# Outlines of the person in films of 640x480, and what else moves there.
_SIGNER: tuple[tuple[int, int], ...] = (
    (144, 480), (144, 160), (200, 80), (260, 48), (390, 48), (420, 160), (492, 300), (492, 480),
)  # fmt: skip
_SLEEVE: tuple[tuple[int, int], ...] = ((524, 250), (640, 250), (640, 480), (524, 480))
TRIPOD = {"webcam_sign_1.mkv": True, "webcam_sign_2.mkv": False, "webcam_sign_3.mkv": True}
"""Films of one person who signs, and whether the sleeve of another is in view."""


def jpeg(quality: int, seen: Iterator[Seen]) -> Iterator[Seen]:
    """Compress each frame separately."""
    for one in seen:
        _, data = cv2.imencode(".jpg", one.image, (cv2.IMWRITE_JPEG_QUALITY, quality))
        yield one._replace(image=_decoded(cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)))


def mpeg4(seen: Iterator[Seen]) -> Iterator[Seen]:
    """Compress with motion compensation: blocks are taken from the frame before."""
    given = list(seen)
    height, width = given[0].image.shape[:2]
    with tempfile.TemporaryDirectory() as folder:
        path = str(Path(folder) / "film.mp4")
        code = cv2.VideoWriter.fourcc(*"mp4v")
        writer = cv2.VideoWriter(path, code, RATE_HZ, (width, height))
        for one in given:
            writer.write(cv2.cvtColor(one.image, cv2.COLOR_GRAY2BGR))
        writer.release()
        film = cv2.VideoCapture(path)
        for one in given:
            read, image = film.read()
            assert read
            yield one._replace(image=_decoded(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)))
        film.release()


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
    "MPEG-4": mpeg4,
    "exposure that drifts": exposed,
    "lamps on 50 Hz": flickering,
    "a faint shadow": shaded,
}
WANTED = {
    f"{name}: {figure}": band
    for name in (*ROOMS, *(f"{name}, nobody" for name in ROOMS))
    for figure, band in {"false": (0.0, 0.02), "recall": (0.95, 1.0)}.items()
    if figure == "false" or "nobody" not in name
} | {f"{film}: false": (0.0, 0.02) for film in TRIPOD}


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


def tripod(film: Path, sleeve: bool) -> tuple[float, float]:
    """Return the shares of pictures with a false thing, and with one on the person who signs."""
    source, video = MotionSource(MotionParams(), None, FIELD_RAD, None), cv2.VideoCapture(str(film))
    false: list[bool] = []
    noticed: list[bool] = []
    while (got := video.read())[0]:
        image = np.asarray(got[1], np.uint8)
        person, moving = _filled(image, _SIGNER), _filled(image, _SIGNER)
        if sleeve:
            moving |= _filled(image, _SLEEVE)
        number = len(false)
        blobs = source(Shot(number / RATE_HZ, number + 1, image))
        false.append(any(not _on(blob, moving) for blob in blobs))
        noticed.append(any(_on(blob, person) for blob in blobs))
    return float(np.mean(false)), float(np.mean(noticed))


def measure(full: bool) -> dict[str, float]:
    """Return the figures; full: longer, and of the films at hand."""
    out: dict[str, float] = {}
    for name, change in ROOMS.items():
        seconds = 4.0 if full else 0.8
        out[f"{name}: false"], out[f"{name}: recall"] = changed(change, True, seconds)
        out[f"{name}, nobody: false"], _ = changed(change, False, seconds)
    for name, sleeve in TRIPOD.items():
        if full and (film := at_hand(name)) is not None:
            out[f"{name}: false"], out[f"{name}: with a thing on the person"] = tripod(film, sleeve)
    return out


def _lit(one: Seen, factor: float | np.ndarray) -> Seen:
    return one._replace(image=np.clip(one.image * factor, 0, 255).astype(np.uint8))


def _decoded(image: object) -> Image:
    return np.asarray(image, np.uint8)


def _filled(image: Image, outline: tuple[tuple[int, int], ...]) -> Mask:
    mask = np.zeros(image.shape[:2], np.uint8)
    cv2.fillPoly(mask, [np.array(outline, np.int32)], (1,))
    return mask > 0
