"""Identities: a cut ends them, and people who cross keep theirs."""

from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from itertools import pairwise
from math import radians
from types import SimpleNamespace

import cv2
import numpy as np
from numpy.typing import NDArray
from present import present

from gazerig.drivers.camera.capture_loop import FrameAnalyzer
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, Detections
from gazerig.drivers.vision.clothing import add_clothing
from gazerig.drivers.vision.cut_detector import CutDetector
from gazerig.gaze.types import Percept
from gazerig.robot.model.face_geometry import LANDMARKS_FACE_M
from gazerig.robot.model.frames import CameraMount, CameraParams, PoseHistory
from gazerig.robot.model.intrinsics import project
from gazerig.robot.perception.perception import Perception

SIZE = 640, 400
FIELD_DEG = 69.0
LENS = intrinsics_of_view(radians(FIELD_DEG), *SIZE)
RATE_HZ = 30.0
Image = NDArray[np.uint8]
Place = NDArray[np.float64]
Way = Callable[[float], tuple[float, float, float]]
"""Where a face is at a time: to the right of the camera's axis, below it and before it, m."""

_FRONTAL = np.array([(0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (-1.0, 0.0, 0.0)])
_HIDDEN_M = 0.16  # a face nearer than this to the view of a nearer one is not found
_MISSED, _MARKS_PX = 0.05, 0.8
_SAME_DEG = 3.0
_FALSE = 2.0 / 60.0 / RATE_HZ  # false faces in a picture

# Clothes above and below the hips as the street shows them, blue, green, red: most are dark.
_CLOTHES = [
    (35, 33, 32), (40, 38, 36), (30, 30, 30), (70, 68, 66), (85, 80, 78), (70, 45, 35),
    (85, 55, 40), (140, 100, 70), (175, 175, 175), (225, 225, 222), (50, 45, 160), (70, 95, 60),
    (140, 170, 190), (50, 70, 95),
]  # fmt: skip
_SKIN = 130, 160, 205
_SENSOR_SD = 4.0

WANTED = {
    "two cross: IDF1": (0.95, 1.0),
    "two meet and turn back: IDF1": (0.95, 1.0),
    "six cross: IDF1": (0.95, 1.0),
    "six stroll, for seconds behind others: IDF1": (0.95, 1.0),
    "one comes and goes: returns with the same number, %": (60.0, 100.0),
    "six come and go: visits with another person's number, %": (0.0, 15.0),
}


def walk(start_m: float, speed_m_s: float, away_m: float, turns_s: float = 1e9) -> Way:
    """Return a straight path, or one with a return from a time on."""
    return lambda t: (start_m + speed_m_s * (t if t < turns_s else 2.0 * turns_s - t), 0.0, away_m)


def stroll(rng: np.random.Generator, away_m: float) -> Way:
    """Return a slow path back and forth that never repeats, of a person of any height."""
    pace, phase = rng.uniform(0.25, 0.6, 2), rng.uniform(0.0, 6.28, 3)
    wide, below = 0.45 * away_m, rng.normal(0.0, 0.08)
    return lambda t: (
        0.6 * wide * np.sin(pace[0] * t + phase[0]) + 0.4 * wide * np.sin(pace[1] * t + phase[1]),
        below,
        away_m + 0.1 * np.sin(0.5 * t + phase[2]),
    )


def crossings(rng: np.random.Generator) -> dict[str, tuple[list[Way], float]]:
    """Return who walks how, and for how many seconds; every call other speeds and distances."""
    v, w, far = rng.uniform(0.5, 1.2), rng.uniform(0.5, 1.2), rng.uniform(1.6, 2.2)
    six = [(-1) ** k * 0.5 * (1.2 + 0.4 * k) for k in range(6)]
    return {
        "two cross": ([walk(-1.0, v, far), walk(1.0, -w, far + 0.6)], 2.0),
        "two meet and turn back": (
            [walk(-0.9, 0.5, far, 1.4), walk(0.9, -0.5, far + 0.2, 1.4)],
            2.8,
        ),
        "six cross": (
            [
                walk(x, -np.sign(x) * rng.uniform(0.5, 1.2), 1.2 + 0.4 * k)
                for k, x in enumerate(six)
            ],
            2.5,
        ),
        "six stroll, for seconds behind others": (
            [stroll(rng, 1.2 + 0.5 * k) for k in range(6)],
            10.0,
        ),
    }


def pictures(
    ways: list[Way], seconds: float, rng: np.random.Generator
) -> Iterator[tuple[Detections, dict[int, Place], set[int]]]:
    """Yield what a detector finds, where people are by number, and who of them can be found."""
    crowd = Crowd(len(ways), rng.spawn(1)[0])
    for k in range(1, int(seconds * RATE_HZ) + 1):
        places = {i: np.array(way(k / RATE_HZ)) for i, way in enumerate(ways)}
        seen = {i: p for i, p in places.items() if _in_view(p) and not _hidden(p, places.values())}
        faces = [detected(p, rng) for p in seen.values() if rng.random() >= _MISSED]
        found = tuple(faces[n] for n in rng.permutation(len(faces)))
        found, _ = add_clothing(crowd.image(places, k), found)
        yield Detections(k / RATE_HZ, k, *SIZE, faces=found), places, set(seen)


def visit(rng: np.random.Generator, below_m: float, start_s: float) -> tuple[float, Way]:
    """Return the end and the way of a visit: from one side, for a while, to one side."""
    far, pace, (side, other) = rng.uniform(0.8, 2.0), rng.uniform(0.6, 1.2), rng.choice((-1, 1), 2)
    end_s, wide, height = start_s + rng.uniform(15, 70), 0.75 * far, rng.normal(below_m, 0.03)

    def way(t: float) -> tuple[float, float, float]:
        come, go = wide - pace * (t - start_s), wide - pace * (end_s - t)
        aside = side * max(come, 0.0) + other * max(go, 0.0) + 0.05 * np.sin(0.7 * t)
        return float(aside), height + 0.02 * np.sin(0.4 * t), far + 0.05 * np.sin(0.3 * t)

    return end_s, way


def come_and_go(people: int, seconds: float, rng: np.random.Generator) -> Counter[str]:
    """Count visits, returns within 5 minutes, kept numbers and numbers of others.

    The number of a visit is the one that it had in most pictures.
    """
    see, poses = perception()
    crowd = Crowd(people, rng.spawn(1)[0])
    last: dict[int, tuple[float, int]] = {}
    owner: dict[int, int] = {}
    count: Counter[str] = Counter()
    below_m, start_s = rng.normal(0.0, 0.08, people), 2.0
    while start_s < seconds:
        who = int(rng.integers(people))
        end_s, way = visit(rng, below_m[who], start_s)
        numbers: Counter[int] = Counter()
        for k in range(round(start_s * RATE_HZ), round((end_s + 2.0) * RATE_HZ)):
            t, faces, places = k / RATE_HZ, [], {}
            if t < end_s:
                places[who] = p = np.array(way(t))
                if _in_view(p) and rng.random() >= _MISSED:
                    faces.append(detected(p, rng))
            if rng.random() < _FALSE:
                faces.append(detected(rng.uniform((-0.7, -0.2, 1.0), (0.7, 0.4, 2.0)), rng))
            found, _ = add_clothing(crowd.image(places, k), tuple(faces))
            percept = present(see.see(Detections(t, k, *SIZE, faces=found), poses))
            numbers.update(number for i, number in _matched(places, percept) if i is not None)
        ((number, _),) = numbers.most_common(1)
        if who in last and start_s - last[who][0] < 300.0:
            count["returns"] += 1
            count["kept"] += number == last[who][1]
        count["visits"] += 1
        count["wrong"] += owner.setdefault(number, who) != who
        last[who] = end_s, number
        start_s = end_s + rng.uniform(4, 120)
    return count


class Crowd:
    """Draws people before a room, the nearer over the farther, in uneven light.

    Every third wears stripes.
    """

    def __init__(self, people: int, rng: np.random.Generator) -> None:
        picked = rng.choice(len(_CLOTHES), (people, 3))
        self._worn = [
            [np.array(_CLOTHES[i]) + rng.normal(0.0, 6.0, 3) for i in of] for of in picked
        ]
        self._striped = rng.random(people) < 1.0 / 3.0
        self._room = room(rng, *SIZE)
        self._noise = [
            rng.normal(0.0, _SENSOR_SD, (*SIZE[::-1], 3)).astype(np.float32) for _ in "abc"
        ]
        self._light = 1.0 + 0.25 * np.sin(np.linspace(0.0, 5.0, SIZE[0]) + rng.uniform(0.0, 6.28))

    def image(self, places: dict[int, Place], number: int) -> Image:
        """Return a picture of people at places."""
        drawn = self._room.copy()
        for i, p in sorted(places.items(), key=lambda one: (-one[1][2], -one[1][0])):
            (x, y), px_m = project(p[None], LENS)[0].tolist(), LENS.fx_px / float(p[2])
            light = self._light[int(np.clip(x, 0, SIZE[0] - 1))]
            upper, lower, other = (np.clip(light * of, 0, 255).tolist() for of in self._worn[i])
            _box(drawn, x, y, px_m, 0.19, 0.6, 1.55, lower)
            _box(drawn, x, y, px_m, 0.22, 0.13, 0.65, upper)
            for k in range(6 if self._striped[i] else 0):
                _box(drawn, x, y, px_m, 0.22, 0.16 + 0.08 * k, 0.2 + 0.08 * k, other)
            _box(drawn, x, y, px_m, 0.075, -0.14, 0.13, (light * np.array(_SKIN)).tolist())
        return np.asarray(cv2.add(drawn, self._noise[number % 3], dtype=cv2.CV_8U), np.uint8)


def _box(
    image: Image, x: float, y: float, px_m: float, half: float, top: float, bottom: float,
    colour: list[float],
) -> None:  # fmt: skip
    """Draw a box about the vertical through the tip of a nose, from above to below it, in m."""
    low = round(x - half * px_m), round(y + top * px_m)
    cv2.rectangle(image, low, (round(x + half * px_m), round(y + bottom * px_m)), colour, -1)


def _in_view(p: Place) -> bool:
    x, y = project(p[None], LENS)[0]
    return bool(20.0 < x < SIZE[0] - 20.0)


def _hidden(p: Place, others: Iterable[Place]) -> bool:
    """Return whether a nearer face covers this one; of two as near, the left one does."""
    return any(
        (q[2], q[0]) < (p[2], p[0]) and np.hypot(*(p[:2] / p[2] - q[:2] / q[2])) < _HIDDEN_M / q[2]
        for q in others
    )


def detected(p: Place, rng: np.random.Generator) -> DetectedFace:
    """Return a face at a place in the camera's axes, turned to it, as a detector finds it."""
    points = project(LANDMARKS_FACE_M @ _FRONTAL.T + p, LENS) + rng.normal(0.0, _MARKS_PX, (5, 2))
    (x, y), (right, bottom) = points.min(axis=0).tolist(), points.max(axis=0).tolist()
    return DetectedFace((x, y, right - x, bottom - y), points, 0.9)


def perception() -> tuple[Perception, PoseHistory]:
    """Return the perception of a stationary camera at the origin."""
    poses = PoseHistory(None)  # type: ignore[arg-type]
    poses.head_pose = lambda t_s: (tuple(map(tuple, np.eye(3).tolist())), (0.0, 0.0, 0.0))  # type: ignore
    mount = CameraMount(CameraParams(mount="base", position_mm=(0.0, 0.0, 0.0)))
    return Perception(mount, FIELD_DEG), poses


def _best_pairs(costs: NDArray[np.floating]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    from scipy.optimize import linear_sum_assignment

    rows, columns = linear_sum_assignment(costs)
    return rows, columns


def idf1(ways: list[Way], seconds: float, rng: np.random.Generator) -> float:
    """Return IDF1: pairs of truth and track that agree in the best pairing of whole identities.

    Source: Ristani et al., "Performance measures and a data set for multi-target, multi-camera
    tracking" (2016): 2 IDTP / (2 IDTP + IDFP + IDFN). Somebody behind another is no miss, and a
    track that goes on for them is no false one.
    """
    see, poses = perception()
    hits: Counter[tuple[int, int]] = Counter()
    true: Counter[int] = Counter()
    believed: Counter[int] = Counter()
    for found, there, seen in pictures(ways, seconds, rng):
        for i, number in _matched(there, present(see.see(found, poses))):
            if i in seen:
                hits[i, number] += 1
            if i is None or i in seen:
                believed[number] += 1
        true.update(seen)
    table = np.array([[hits[i, n] for n in sorted(believed)] for i in sorted(true)])
    best = table[_best_pairs(-table)].sum()
    return float(2.0 * best / (true.total() + believed.total()))


def _matched(people: dict[int, Place], percept: Percept) -> Iterator[tuple[int | None, int]]:
    """Yield the person of each face in a percept, None for no one, and its number."""
    p = np.array(list(people.values())).reshape(-1, 3)
    at = [face.p_world_m for face in percept.faces]
    q = np.array([(-y, -z, x) for x, y, z in at]).reshape(-1, 3)
    far, believed = np.linalg.norm(p, axis=1), np.linalg.norm(q, axis=1)
    cos = np.clip((p / far[:, None]) @ (q / believed[:, None]).T, -1.0, 1.0)
    apart_deg = np.degrees(np.arccos(cos))
    # Of two in one direction it is the one as far away.
    cost = apart_deg + _SAME_DEG * np.abs(np.log(far[:, None] / believed))
    cost[apart_deg > _SAME_DEG] = 1e6
    names = list(people)
    who = {j: names[i] for i, j in zip(*_best_pairs(cost), strict=True) if cost[i, j] < 1e6}
    for j, face in enumerate(percept.faces):
        yield who.get(j), face.id


def room(rng: np.random.Generator, width: int = 1000, height: int = 600) -> Image:
    """Return a drawn room: large and small patches of grey on a gradient."""
    image = (
        np.linspace(60, 150, width)[None] + np.linspace(0, rng.uniform(-50, 50), height)[:, None]
    )
    for _ in range(60):
        x, y = rng.integers(0, width), rng.integers(0, height)
        w, h = rng.integers(15, 260), rng.integers(15, 200)
        image[y : y + h, x : x + w] = rng.uniform(10, 245)
    return np.repeat(np.clip(image, 0, 255).astype(np.uint8)[:, :, None], 3, axis=2)


def cut_film(rng: np.random.Generator) -> tuple[list[Image], list[int]]:
    """Return pictures of rooms one after the other, and the numbers of those after a cut.

    In each room is trouble that is no cut: a pan of 11 deg a picture, light that is switched,
    noise, and a hand before the lens.
    """
    images: list[Image] = []
    noise = [rng.normal(0.0, 3.0, (*SIZE[::-1], 1)) for _ in range(4)]
    for _ in range(4):
        view = room(rng)
        for k in range(24):
            x = 100 + 100 * (0, 1, 2, 1)[k % 4] if k < 9 else 100  # 100 px are 11 deg
            image = view[100 : 100 + SIZE[1], x : x + SIZE[0]].astype(float)
            if 10 <= k < 13:
                image = 0.4 * image + 8.0
            if 14 <= k < 16:
                image = 0.0 * image + 12.0
            if 18 <= k < 21:
                image[60 * (k - 18) :, 200:380] = 170.0
            images.append(np.clip(image + noise[k % 4], 0, 255).astype(np.uint8))
    return images, list(range(24, len(images), 24))


def _changes(numbers: Iterable[int]) -> list[int]:
    return [k for k, (one, other) in enumerate(pairwise(numbers), start=1) if one != other]


def cuts_in(images: Iterable[Image]) -> list[int]:
    """Return the numbers of the pictures before which a cut is found."""
    return _changes(map(CutDetector().scene, images))


def ends_in(images: Iterable[Image], rng: np.random.Generator) -> list[int]:
    """Return the numbers of the pictures before which the identity of a steady face ends."""
    see, poses = perception()
    # So low that its clothes are below the picture: those would be the room, which pans.
    place = np.array([0.1, 0.5, 1.5])
    frames = FrameAnalyzer(SimpleNamespace(find=lambda _: (detected(place, rng),)))
    ids = []
    for k, image in enumerate(images, start=1):
        found = frames.analyze(Shot(k / RATE_HZ, k, image))
        ((face),) = present(see.see(found, poses)).faces
        ids.append(face.id)
    return _changes(ids)


def measure(full: bool) -> dict[str, float]:
    """Return the figures; full: more seeds."""
    figures: dict[str, list[float]] = {}
    for seed in range(20 if full else 3):
        rng = np.random.default_rng(seed)
        for name, (ways, seconds) in crossings(rng).items():
            figures.setdefault(f"{name}: IDF1", []).append(idf1(ways, seconds, rng))
    out = {name: float(np.mean(values)) for name, values in figures.items()}
    alone, six = (
        sum(
            (come_and_go(n, 1200.0 if full else 400.0, np.random.default_rng(k)) for k in range(3)),
            Counter(),
        )
        for n in (1, 6)
    )
    out["one comes and goes: returns with the same number, %"] = (
        100.0 * alone["kept"] / alone["returns"]
    )
    out["six come and go: visits with another person's number, %"] = (
        100.0 * six["wrong"] / six["visits"]
    )
    return out
