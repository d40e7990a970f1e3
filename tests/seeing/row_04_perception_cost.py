"""Perception in the loop: processor time of one picture with one, six and twenty people."""

import sys
import time
from types import FrameType

import numpy as np
from seeing.row_09_identities import FIELD_DEG, RATE_HZ, SIZE, detected, perception

from gazerig.drivers.types import DetectedFace, Detections
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.perception import Perception

PEOPLE = 1, 6, 20
WANTED = {
    "one person, us": (0.0, 150.0),
    "six people, us": (0.0, 400.0),
    "twenty people, us": (0.0, 1000.0),
}


def crowd(people: int, count: int, seed: int = 0) -> list[Detections]:
    """Return pictures of people who sway, located in the camera's axes as its process does."""
    rng, locate = np.random.default_rng(seed), FrameLocator(None, np.radians(FIELD_DEG), None)
    out = []
    for number in range(1, count + 1):
        faces: list[DetectedFace] = []
        for k in range(people):
            row, column = divmod(k, 5)
            x = 0.42 * (column - 2) + 0.1 * np.sin(2.0 * number / RATE_HZ + k)
            faces.append(detected(np.array([x, 0.35 * (row - 1.5), 2.4 + 0.1 * row]), rng))
        found = Detections(number / RATE_HZ, number, *SIZE, faces=tuple(faces))
        out.append(found.located_by(locate))
    return out


def cost_us(people: int, count: int, rounds: int) -> float:
    """Return the processor time that a picture costs, the least of the rounds of each."""
    pictures, least = crowd(people, count), np.full(count, np.inf)
    for _ in range(rounds):
        see, poses = perception()
        spent = []
        for found in pictures:
            began = time.thread_time_ns()
            see.see(found, poses)
            spent.append((time.thread_time_ns() - began) / 1e3)
        least = np.minimum(least, spent)
    return float(least[len(least) // 10 :].mean())


def calls(see: Perception, poses: object, found: Detections) -> int:
    """Return how many functions of Python a picture takes: the same on every computer."""
    counted = 0

    def count(frame: FrameType, event: str, arg: object) -> None:
        nonlocal counted
        counted += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(count)
    try:
        see.see(found, poses)  # type: ignore[arg-type]
    finally:
        sys.setprofile(before)
    return counted


def measure(full: bool) -> dict[str, float]:
    """Return the figures; full: over more pictures and rounds."""
    count, rounds = (150, 9) if full else (60, 4)
    names = dict(zip(PEOPLE, WANTED, strict=True))
    return {name: cost_us(people, count, rounds) for people, name in names.items()}
