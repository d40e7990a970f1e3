"""A camera whose motion is not known: shaken, bumped, panned.

Figures: false things a picture; of what is reported, the share that really moves (precision); of
what moves, the share on which a thing is reported (recall).
"knock": a camera on a head whose joints are measured and at rest, or turn, while the table is
bumped, which they do not feel.
"""

from collections.abc import Iterable
from typing import NamedTuple

import cv2
import numpy as np
from seeing.moving_room import (
    BEFORE_PLAIN,
    CLOSE,
    FIELD_RAD,
    NEAR,
    PEOPLE,
    PLAIN,
    ROOM,
    Board,
    Mask,
    Motion,
    Seen,
    bump,
    fast_pan,
    frames,
    knocked_turn,
    pan,
    rotation,
    shake,
    still,
    turn,
)

from gazerig.drivers.camera.shared_slots import PoseBuffer
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.perception.motion_source import MotionSource

_BAND = {"false things a picture": (0.0, 0.1), "precision": (0.9, 1.0)}
FILMS: dict[str, tuple[Motion, tuple[Board, ...], tuple[Board, ...], Motion | None, float]] = {
    "still": (still, PEOPLE, ROOM, None, 0.95),
    "still, a plain wall": (still, BEFORE_PLAIN, PLAIN, None, 0.95),
    "shake, somebody close": (shake, CLOSE, ROOM, None, 0.9),
    "bump, somebody close": (bump, CLOSE, ROOM, None, 0.9),
    "pan": (pan, PEOPLE, ROOM, None, 0.9),
    "knock in a turn, somebody close": (knocked_turn, CLOSE, ROOM, turn, 0.9),
    "knock in a turn, nobody": (knocked_turn, (), ROOM, turn, 0.0),
    "fast pan, something near": (fast_pan, PEOPLE, NEAR, None, 0.9),
    "shake, something near": (shake, PEOPLE, NEAR, None, 0.9),
    "bump, nobody": (bump, (), ROOM, None, 0.0),
}
"""Motion of the camera, people, room, what the joints say of it, and least recall."""
WANTED = {
    f"{name}: {figure}": band
    for name, (_, people, *_, least) in FILMS.items()
    for figure, band in {**_BAND, "recall": (least, 1.0)}.items()
    if people or figure == "false things a picture"
}
_LEARN = 3  # frames in which nothing can be confirmed yet
_NEAR_PX = 9


class Score(NamedTuple):
    """Detections in a film.

    false: things although nothing moves; right: things that move
    moving: what moves, counted in each picture; noticed: what of it had a thing on it
    """

    pictures: int
    false: int
    right: int
    moving: int
    noticed: int

    def figures(self, name: str) -> dict[str, float]:
        """Return the row's figures of one film."""
        reported = self.right + self.false
        return {
            f"{name}: false things a picture": self.false / self.pictures,
            f"{name}: precision": self.right / reported if reported else 1.0,
            f"{name}: recall": self.noticed / self.moving if self.moving else float("nan"),
        }


def measured_head(motion: Motion) -> PoseBuffer:
    """Return the motion of a head's camera by its joints over seven seconds."""
    poses = PoseBuffer()
    for k in range(500):
        t_s = 0.016 * k - 1.0
        poses.record(t_s, rotation(motion(t_s)).tolist())
    return poses


def judged(seen: Iterable[Seen], turns: PoseBuffer | None = None) -> Score:
    """Let the detector look, as the program uses it, and compare with the truth."""
    source = MotionSource(MotionParams(), None, FIELD_RAD, turns)
    pictures = false = right = moving = noticed = 0
    for k, one in enumerate(seen):
        blobs = source(Shot(one.t_s, k + 1, one.image))
        if k < _LEARN:
            continue
        pictures += 1
        near = np.ones((2 * _NEAR_PX + 1,) * 2, np.uint8)
        wide = [cv2.dilate(mask.astype(np.uint8), near) > 0 for mask in one.movers]
        unsure = [cv2.dilate(mask.astype(np.uint8), near) > 0 for mask in one.resting]
        on = [[_on(blob, mask) for mask in wide] for blob in blobs]
        right += sum(any(row) for row in on)
        false += sum(
            not any(row) and not any(_on(blob, mask) for mask in unsure)
            for row, blob in zip(on, blobs, strict=True)
        )
        large = [j for j, mask in enumerate(one.movers) if mask.mean() > 0.003]
        moving += len(large)
        noticed += sum(any(row[j] for row in on) for j in large)
    return Score(pictures, false, right, moving, noticed)


def _on(blob: MovingBlob, mask: Mask) -> bool:
    """Return whether the point of the target is there."""
    assert blob.centre_px is not None
    x, y = (round(v) for v in blob.centre_px)
    height, width = mask.shape
    return 0 <= x < width and 0 <= y < height and bool(mask[y, x])


def rendered(name: str, seconds: float) -> dict[str, float]:
    """Return the figures of one of FILMS."""
    motion, people, room, measured, _ = FILMS[name]
    seen = frames(motion, seconds, people, room)
    figures = judged(seen, None if measured is None else measured_head(measured)).figures(name)
    return {key: value for key, value in figures.items() if people or "false" in key}


def measure(full: bool) -> dict[str, float]:
    """Measure in the rendered room."""
    cv2.setNumThreads(1)
    out: dict[str, float] = {}
    for name in FILMS:
        out |= rendered(name, 6.0 if full else 1.5)
    return out
