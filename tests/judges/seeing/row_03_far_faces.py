"""Range of face detection with the default settings, 640 x 400 at 69 deg."""

import numpy as np
from seeing.material import background, eyes_at, noisy, paste, portrait

from gazerig.drivers.types import FaceDetector, ImageArray, Pixels
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams

WANTED = {
    "found of 12 at 2.5 m": (12, 12),
    "found of 12 at 5 m": (12, 12),
    "found of 12 at 7 m": (10, 12),
    "found in a crowd at 3 to 6 m, of 105": (100, 105),
    "faces that are none, a frame": (0, 0.05),
}

_WIDTH_PX, _HEIGHT_PX, _FIELD_DEG = 640, 400, 69.0
_WHO = ("astronaut", "hopper")
# Landmarks that are off by less than this, in distances between the eyes, are those of the face.
_ITS_OWN = 0.4


def measure(full: bool) -> dict[str, float]:
    """Return the figures."""
    figures: dict[str, float] = {}
    wrong: list[int] = []
    for far_m in (2.5, 5.0, 7.0):
        hits = 0
        seeds = range(12) if full else range(4)
        for seed in seeds:
            frame, truth = one_person(far_m, seed)
            found, extra = judged(face_detector(FaceDetectorParams()), [frame], truth)
            hits, wrong = hits + found, [*wrong, extra]
        figures[f"found of 12 at {far_m:g} m"] = 12.0 * hits / len(seeds)
    frames, hits, every = 60 if full else 40, 0, 0
    for seed in range(15 if full else 2):
        still, truth = crowd(seed)
        rng = np.random.default_rng(seed)
        shown = [background(_WIDTH_PX, _HEIGHT_PX)]
        shown += [noisy(still, 2.0, rng) for _ in range(frames)]
        found, extra = judged(face_detector(FaceDetectorParams()), shown, truth)
        hits, every, wrong = hits + found, every + len(truth), [*wrong, extra]
    figures["found in a crowd at 3 to 6 m, of 105"] = 105.0 * hits / every
    figures["faces that are none, a frame"] = float(np.mean(wrong))
    return figures


def one_person(far_m: float, seed: int) -> tuple[ImageArray, list[Pixels]]:
    """Return a frame of a room with one person somewhere in it, and their landmarks."""
    rng = np.random.default_rng(seed)
    frame = background(_WIDTH_PX, _HEIGHT_PX).copy()
    eyes = eyes_at(far_m, _WIDTH_PX, _FIELD_DEG)
    x = rng.uniform(3.0 * eyes, _WIDTH_PX - 3.0 * eyes)
    y = rng.uniform(3.5 * eyes, _HEIGHT_PX - 3.5 * eyes)
    truth = paste(frame, portrait(_WHO[seed % 2]), (x, y), eyes, rng.uniform(-8.0, 8.0))
    return noisy(frame, 2.0, rng), [truth]


def crowd(seed: int) -> tuple[ImageArray, list[Pixels]]:
    """Return a frame of seven people at 3 to 6 m side by side, and their landmarks."""
    rng = np.random.default_rng(100 + seed)
    frame, truth = background(_WIDTH_PX, _HEIGHT_PX).copy(), []
    for i in range(7):
        eyes = eyes_at(rng.uniform(3.0, 6.0), _WIDTH_PX, _FIELD_DEG)
        at = 60.0 + 87.0 * i + rng.uniform(-15.0, 15.0), rng.uniform(100.0, 250.0)
        roll = rng.uniform(-8.0, 8.0)
        truth.append(paste(frame, portrait(_WHO[rng.integers(2)]), at, eyes, roll))
    return frame, truth


def judged(
    detector: FaceDetector, frames: list[ImageArray], truth: list[Pixels]
) -> tuple[int, int]:
    """Return how many people are found in the last frame, and how many faces are none."""
    for frame in frames:
        faces = detector.find(frame)
    landmarks = [face.landmarks_px for face in faces]
    near = [
        [
            np.linalg.norm(five - own, axis=1).mean() < _ITS_OWN * np.linalg.norm(own[1] - own[0])
            for five in landmarks
        ]
        for own in truth
    ]
    return sum(map(any, near)), sum(not any(row[i] for row in near) for i in range(len(landmarks)))
