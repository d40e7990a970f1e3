"""A room in front of a camera that shakes, is bumped or turns: rendered, with what really moves.

Walls and furniture are textured boards at several distances; people are textured figures that
walk back and forth. The lens is off the camera's axis of rotation, as on a table or a
neck.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from math import exp, pi, sin, tan
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray
from seeing.material import noisy

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Mask = NDArray[np.bool_]

WIDTH, HEIGHT, FIELD_RAD, RATE_HZ = 640, 400, 1.204, 30.0
FOCAL_PX = 0.5 * WIDTH / tan(0.5 * FIELD_RAD)
# From the point that the camera turns about to its lens, in axes right, down, forward.
_LEVER_M = np.array([0.0, -0.05, 0.08])
_NOISE_LEVELS = 2.0


class Pose(NamedTuple):
    """Motion of the camera: degrees to the right, up, clockwise, and metres right, down."""

    yaw_deg: float = 0.0
    pitch_deg: float = 0.0
    roll_deg: float = 0.0
    right_m: float = 0.0
    down_m: float = 0.0


Motion = Callable[[float], Pose]


def still(t_s: float) -> Pose:
    """Stand."""
    return Pose()


def shake(t_s: float) -> Pose:
    """Tremble by .6 deg, as in a hand or a car."""
    yaw = 0.42 * sin(2 * pi * 2.9 * t_s) + 0.18 * sin(2 * pi * 5.3 * t_s + 1.0)
    pitch = 0.42 * sin(2 * pi * 3.7 * t_s + 2.0) + 0.18 * sin(2 * pi * 6.1 * t_s)
    return Pose(yaw, pitch, 0.15 * sin(2 * pi * 2.3 * t_s), 0.001 * yaw, 0.001 * pitch)


def bump(t_s: float) -> Pose:
    """Be knocked every 1.5 s: a swing of 1 deg at 7 Hz that dies away, with some millimetres."""
    since = (t_s - 0.7) % 1.5
    if t_s < 0.7:
        return Pose()
    swing = exp(-since / 0.2) * sin(2 * pi * 7.0 * since)
    return Pose(0.4 * swing, swing, 0.3 * swing, 0.001 * swing, 0.003 * swing)


def pan(t_s: float) -> Pose:
    """Swing to and fro over 20 deg at some 20 deg/s."""
    way = (t_s / 2.0 + 0.25) % 1.0
    triangle = 4.0 * abs(way - 0.5) - 1.0
    return Pose(-12.0 * sin(0.5 * pi * triangle), 0.0, 0.0)


def fast_pan(t_s: float) -> Pose:
    """Swing to and fro at some 60 deg/s."""
    return pan(3.0 * t_s)


def turn(t_s: float) -> Pose:
    """Turn as a head that looks from one to another: over 16 deg and back in 2.5 s."""
    return Pose(8.0 * sin(2 * pi * 0.4 * t_s), 2.0 * sin(2 * pi * 0.3 * t_s))


def knocked_turn(t_s: float) -> Pose:
    """Turn, on a table that is bumped."""
    a, b = turn(t_s), bump(t_s)
    return Pose(*(one + other for one, other in zip(a, b, strict=True)))


def rotation(pose: Pose) -> Floats:
    """Return R_world_camera, optical axes."""
    a, b, c = np.radians((pose.yaw_deg, pose.pitch_deg, pose.roll_deg))
    yaw = np.array([(np.cos(a), 0, np.sin(a)), (0, 1, 0), (-np.sin(a), 0, np.cos(a))])
    pitch = np.array([(1, 0, 0), (0, np.cos(b), -np.sin(b)), (0, np.sin(b), np.cos(b))])
    roll = np.array([(np.cos(c), -np.sin(c), 0), (np.sin(c), np.cos(c), 0), (0, 0, 1)])
    return np.asarray(yaw @ pitch @ roll)


class Seen(NamedTuple):
    """One frame with its truth.

    movers: where each thing is that really moves, those that hardly move apart
    resting: where things are that could move and hardly do: neither right nor wrong
    """

    t_s: float
    image: Image
    movers: tuple[Mask, ...]
    resting: tuple[Mask, ...] = ()


@dataclass(frozen=True)
class Board:
    """An upright textured board that faces the camera; ``speed_m_s`` along x, to and fro.

    centre_m, half_m: its centre, and half its width and height
    figure: cut out as a person is
    """

    centre_m: tuple[float, float, float]
    half_m: tuple[float, float]
    texture: int
    figure: bool = False
    speed_m_s: float = 0.0
    reach_m: float = 1.0

    def at(self, t_s: float) -> Floats:
        """Return where its centre is."""
        x, y, z = self.centre_m
        way = (self.speed_m_s * t_s / self.reach_m + 1.0) % 4.0
        return np.array([x + self.reach_m * (abs(way - 2.0) - 1.0), y, z])

    def moves_px(self, t_s: float) -> float:
        """Return how far its image moves from frame to frame."""
        way = np.linalg.norm(self.at(t_s) - self.at(t_s - 1.0 / RATE_HZ))
        return float(way) * FOCAL_PX / self.centre_m[2]


ROOM = (
    Board((0.0, 0.0, 5.0), (9.0, 5.0), 0),
    Board((-2.2, 0.9, 3.6), (0.7, 0.6), 1),
    Board((2.0, 0.6, 3.0), (0.5, 0.9), 2),
    Board((0.3, 1.1, 2.2), (0.6, 0.3), 3),
)
# Still things nearer than most of the room, which pass it as the lens moves aside.
NEAR = (*ROOM, Board((-0.45, 0.35, 0.9), (0.12, 0.15), 1), Board((0.5, 0.4, 1.3), (0.15, 0.2), 2))
PEOPLE = (
    Board((1.3, 0.5, 4.2), (0.28, 0.9), 4, True, 1.0, 0.9),
    Board((-0.9, 0.5, 2.8), (0.26, 0.85), 5, True, 0.6, 0.5),
)
# Somebody so close that they fill most of the image at times.
CLOSE = (Board((0.0, 0.35, 0.9), (0.42, 0.75), 4, True, 0.5, 0.4),)
# A wall without texture, and a person before it.
PLAIN: tuple[Board, ...] = ()
BEFORE_PLAIN = (Board((0.0, 0.4, 1.4), (0.35, 0.8), 5, True, 0.5, 0.5),)


@cache
def _texture(number: int) -> Floats:
    """Return blobs of several sizes, so that there is something to see from near and far."""
    rng = np.random.default_rng(100 + number)
    height, width = (700, 1260) if number == 0 else (240, 160)
    out = np.zeros((height, width))
    for sigma in (2.0, 6.0, 18.0):
        grain = cv2.GaussianBlur(rng.standard_normal((height, width)), (0, 0), sigma)
        out += grain / grain.std()
    mean = 128 + 12 * (number % 3 - 1)
    return np.asarray(np.clip(mean + 42.0 * out / out.std(), 0, 255)).astype(np.float32)


@cache
def _cut(figure: bool, shape: tuple[int, int]) -> NDArray[np.float32]:
    """Return which part of a board there is: all of it, or head and body of a person."""
    height, width = shape
    out = np.ones(shape, np.float32)
    if figure:
        out[:] = 0.0
        head = (width // 2, round(0.12 * height)), (round(0.24 * width), round(0.115 * height))
        cv2.ellipse(out, *head, 0, 0, 360, 1.0, -1)
        body = (width // 2, round(0.62 * height)), (round(0.46 * width), round(0.4 * height))
        cv2.ellipse(out, *body, 0, 0, 360, 1.0, -1)
    return out


def frames(
    motion: Motion,
    seconds: float,
    people: tuple[Board, ...] = PEOPLE,
    room: tuple[Board, ...] = ROOM,
) -> Iterator[Seen]:
    """Yield the camera's images, frame by frame."""
    rng = np.random.default_rng(1)
    for k in range(round(seconds * RATE_HZ)):
        yield frame(motion(k / RATE_HZ), k / RATE_HZ, (*room, *people), rng)


def frame(pose: Pose, t_s: float, boards: tuple[Board, ...], rng: np.random.Generator) -> Seen:
    """Return what the camera sees at a time."""
    R = rotation(pose)
    lens = R @ _LEVER_M + np.array([pose.right_m, pose.down_m, 0.0])
    image = np.full((HEIGHT, WIDTH), 128.0, np.float32)
    covers: dict[Board, Mask] = {}
    for board in sorted(boards, key=lambda board: -board.centre_m[2]):
        cover = _painted(image, board, board.at(t_s), R, lens)
        for behind in covers:
            covers[behind] = covers[behind] & ~cover
        if board.figure:
            covers[board] = cover
    moves = {board: board.moves_px(t_s) > 0.75 for board in covers}
    return Seen(
        t_s,
        noisy(image, _NOISE_LEVELS, rng),
        tuple(cover for board, cover in covers.items() if moves[board]),
        tuple(cover for board, cover in covers.items() if not moves[board]),
    )


def _painted(
    image: NDArray[np.float32], board: Board, centre: Floats, R: Floats, lens: Floats
) -> Mask:
    """Paint a board into the image; return its place."""
    signs = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)])
    seen = (centre + signs * (*board.half_m, 0.0) - lens) @ R
    corners = seen[:, :2] / seen[:, 2:] * FOCAL_PX + (0.5 * (WIDTH - 1), 0.5 * (HEIGHT - 1))
    texture = _texture(board.texture)
    rows, columns = texture.shape
    source = np.array([(0, 0), (columns - 1, 0), (columns - 1, rows - 1), (0, rows - 1)])
    low = np.maximum(np.floor(corners.min(axis=0)).astype(int), 0)
    high = np.minimum(np.ceil(corners.max(axis=0)).astype(int) + 1, (WIDTH, HEIGHT))
    out = np.zeros(image.shape, np.bool_)
    if (high <= low).any():
        return out
    H = cv2.getPerspectiveTransform(source.astype(np.float32), (corners - low).astype(np.float32))
    size = int(high[0] - low[0]), int(high[1] - low[1])
    paint = cv2.warpPerspective(texture, H, size, borderMode=cv2.BORDER_REPLICATE)
    window = np.s_[low[1] : high[1], low[0] : high[0]]
    if not board.figure and _fills(np.asarray(np.linalg.inv(H), float), size, (rows, columns)):
        image[window], out[window] = paint, True
        return out
    cover = cv2.warpPerspective(_cut(board.figure, (rows, columns)), H, size)
    image[window] = image[window] * (1 - cover) + paint * cover
    out[window] = cover > 0.5
    return out


def _fills(H: Floats, size: tuple[int, int], shape: tuple[int, int]) -> bool:
    """Return whether a board covers a window as far as its edges, as the wall behind all does.

    H: window to texture
    """
    right, bottom = size[0] - 1.0, size[1] - 1.0
    ends = np.array([[(0.0, 0.0), (right, 0.0), (right, bottom), (0.0, bottom)]])
    at = cv2.perspectiveTransform(ends, H)[0]
    return bool((at >= 1.0).all() and (at <= (shape[1] - 2.0, shape[0] - 2.0)).all())
