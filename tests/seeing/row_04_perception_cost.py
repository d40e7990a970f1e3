"""Perception in the loop: processor time of one picture of people, and of what moves besides."""

import sys
import time
from types import FrameType

import numpy as np
from seeing.row_09_identities import FIELD_DEG, RATE_HZ, SIZE, detected, perception

from gazerig.drivers.types import DetectedFace, Detections, MovingBlob
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.perception import Perception

PEOPLE = 1, 6, 20
THINGS = 8  # as many as the motion detector reports
WANTED = {
    "one person, us": (0.0, 150.0),
    "six people, us": (0.0, 400.0),
    "twenty people, us": (0.0, 1000.0),
    "one person, eight moving things, us": (0.0, 700.0),
    "twenty people, eight moving things, us": (0.0, 1700.0),
}


def crowd(people: int, count: int, things: int = 0) -> list[Detections]:
    """Return pictures of people who sway, located in the camera's axes as its process does.

    things: how many move besides
    """
    rng, locate = np.random.default_rng(0), FrameLocator(None, np.radians(FIELD_DEG), None)
    out = []
    for number in range(1, count + 1):
        faces: list[DetectedFace] = []
        for k in range(people):
            row, column = divmod(k, 5)
            x = 0.42 * (column - 2) + 0.1 * np.sin(2.0 * number / RATE_HZ + k)
            faces.append(detected(np.array([x, 0.35 * (row - 1.5), 2.4 + 0.1 * row]), rng))
        blobs = tuple(moving(k, number / RATE_HZ) for k in range(things))
        found = Detections(number / RATE_HZ, number, *SIZE, faces=tuple(faces), blobs=blobs)
        out.append(found.locate_in_camera(locate))
    return out


def moving(id: int, t_s: float) -> MovingBlob:
    """Return one of the things that move to and fro, as the motion detector gives it."""
    x, v = 0.1 * np.sin(3.0 * t_s + id), 0.3 * np.cos(3.0 * t_s + id)
    row, column = divmod(id, 4)
    p = 0.5 * (column - 1.5) + float(x), 0.6 * (row - 0.5), 2.0
    v_m_s = float(v), 0.0, 0.0
    return MovingBlob(
        id + 1,
        "thing",
        p,
        0.1,
        v_camera_m_s=v_m_s,
        depth_known=False,
        depth_sd_m=1.0,
        box_px=(0.0, 0.0, 60.0, 60.0),
        area_px=2800.0,
        fastest_m=p,
        fastest_m_s=v_m_s,
        thickness_m=0.2,
    )


def cost_us(people: int, count: int, rounds: int, things: int = 0) -> float:
    """Return the processor time that a picture costs, the least of the rounds of each."""
    pictures, least = crowd(people, count, things=things), np.full(count, np.inf)
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
    asked = [(people, 0) for people in PEOPLE] + [(1, THINGS), (20, THINGS)]
    return {
        name: cost_us(people, count, rounds, things)
        for name, (people, things) in zip(WANTED, asked, strict=True)
    }
