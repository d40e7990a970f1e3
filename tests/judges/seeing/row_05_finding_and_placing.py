"""Faces found in the dark, blurred, tilted and narrow, and how truly they are placed."""

from collections.abc import Callable, Iterator
from pathlib import Path

import cv2
import numpy as np
from seeing.material import (
    background,
    carphone,
    eyes_at,
    landmark_error,
    noisy,
    paste,
    portrait,
)

from gazerig.drivers.types import FaceDetector, ImageArray
from gazerig.drivers.vision.face.detector import face_detector
from gazerig.drivers.vision.face.params import FaceDetectorParams

WANTED = {
    "found of hard faces, share": (80 / 117, 1),
    "landmark error, eye distances": (0, 0.05),
    "frames of the car film with one face": (0.99, 1),
}
# Frames of a still after which what is found is counted.
_FRAMES = 9


def measure(full: bool) -> dict[str, float]:
    """Return the figures; full: of more frames."""
    return {
        "found of hard faces, share": hard_faces(),
        "landmark error, eye distances": placing_error(24 if full else 10),
        "frames of the car film with one face": shown(carphone(), 1 if full else 4),
    }


def hard_faces() -> float:
    """Return the share of portraits found that are dark, blurred, tilted, narrow or small."""
    found = [
        bool(after_frames(face_detector(FaceDetectorParams()), hard)) for hard in hard_portraits()
    ]
    return float(np.mean(found))


def hard_portraits() -> Iterator[ImageArray]:
    """Yield the portraits with twelve kinds of difficulties, and frames of the film with three."""
    rng = np.random.default_rng(0)
    changes: tuple[Callable[[ImageArray], np.ndarray], ...] = (
        lambda image: image * 0.2,
        lambda image: image * 0.08,
        lambda image: cv2.GaussianBlur(image, (0, 0), 3.0),
        lambda image: cv2.GaussianBlur(image, (0, 0), 5.0),
        lambda image: cv2.blur(image, (15, 1)),
        lambda image: _tilted(image, 30.0),
        lambda image: _tilted(image, -30.0),
        lambda image: cv2.resize(image, None, fx=0.6, fy=1.0),
        lambda image: cv2.resize(image, None, fx=0.1, fy=0.1, interpolation=cv2.INTER_AREA),
        lambda image: image[:, : image.shape[1] // 2],
        lambda image: 255.0 - (255.0 - image) * 0.3,
        lambda image: image + rng.normal(0.0, 30.0, image.shape),
    )
    for who in ("astronaut", "hopper"):
        image = portrait(who).image
        small = cv2.resize(image, (320, image.shape[0] * 320 // image.shape[1]))
        for change in changes:
            yield noisy(change(small.astype(np.uint8)), 2.0, rng)
    poor: tuple[Callable[[ImageArray], np.ndarray], ...] = (
        lambda image: 0.15 * image,
        lambda image: 0.15 * image + rng.normal(0.0, 6.0, image.shape),
        lambda image: 255.0 - (255.0 - image) * 0.15,
    )
    for frame in _frames(carphone(), (5, 40, 75, 110)):
        for change in poor:
            yield noisy(np.clip(change(frame), 0, 255).astype(np.uint8), 2.0, rng)


def _frames(film: Path, numbers: tuple[int, ...]) -> list[ImageArray]:
    video, found = cv2.VideoCapture(str(film)), []
    for number in range(numbers[-1] + 1):
        _, frame = video.read()
        if number in numbers:
            found.append(np.asarray(frame, np.uint8))
    return found


def placing_error(frames: int) -> float:
    """Return the mean landmark error of faces that move at 1 to 2.5 m, in eye distances."""
    errors: list[float] = []
    for who in ("astronaut", "hopper"):
        for far_m in (1.0, 2.5):
            detector, eyes = face_detector(FaceDetectorParams()), eyes_at(far_m, 640, 69.0)
            for step in range(frames):
                frame = background(640, 400).copy()
                at = 250.0 + 0.15 * eyes * step, 200.0
                truth = paste(frame, portrait(who), at, eyes, 10.0 * np.sin(step / 6.0))
                frame = noisy(frame, 2.0, np.random.default_rng(step))
                for face in detector.find(frame):
                    errors.append(min(landmark_error(face, truth), 1.0))
    return float(np.mean(errors))


def shown(film: Path, step: int) -> float:
    """Return the share of a film's frames with one face."""
    video, detector = cv2.VideoCapture(str(film)), face_detector(FaceDetectorParams())
    found: list[bool] = []
    for number in range(10**6):
        read, frame = video.read()
        if not read:
            return float(np.mean(found))
        if number % step == 0:
            found.append(len(detector.find(np.asarray(frame, np.uint8))) == 1)
    raise AssertionError("a film without an end")


def after_frames(detector: FaceDetector, image: ImageArray) -> int:
    """Return how many faces are found when a still has been shown for some frames."""
    return [len(detector.find(image)) for _ in range(_FRAMES)][-1]


def _tilted(image: ImageArray, angle_deg: float) -> np.ndarray:
    height, width = image.shape[:2]
    M = cv2.getRotationMatrix2D((width / 2.0, height / 2.0), angle_deg, 1.0)
    return cv2.warpAffine(image, M, (width, height))
