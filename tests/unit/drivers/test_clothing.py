"""Colours of clothes below a face: their use, and their part of a picture."""

from dataclasses import replace

import cv2
import numpy as np
import pytest
from present import present
from reviewed import assert_reviewed
from seeing.row_09_identities import LENS, SIZE, Crowd, detected

from gazerig.drivers.camera.capture_loop import FrameAnalyzer
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import Clothing, DetectedFace, DetectedPerson, ImageArray
from gazerig.drivers.vision.clothing import add_clothing
from gazerig.robot.model.intrinsics import project

RED, GREEN = [40.0, 40.0, 170.0], [60.0, 140.0, 60.0]


def face(x: float, z: float, y: float = -0.2) -> DetectedFace:
    return detected(np.array([x, y, z]), np.random.default_rng(0))


def picture(*people: tuple[DetectedFace, list[float]]) -> ImageArray:
    """Return people in plain clothes, the last before the others."""
    image = np.full((SIZE[1], SIZE[0], 3), 128, np.uint8)
    for one, colour in people:
        x, y = one.landmarks_px[2]
        px_m = float(one.landmarks_px[1, 0] - one.landmarks_px[0, 0]) / 0.062
        low = round(x - 0.22 * px_m), round(y + 0.13 * px_m)
        high = round(x + 0.22 * px_m), round(y + 0.65 * px_m)
        cv2.rectangle(image, low, high, colour, -1)
    return image


def worn(image: ImageArray, *faces: DetectedFace) -> list[Clothing | None]:
    return [one.clothing for one in add_clothing(image, faces)[0]]


def apart(one: Clothing | None, other: Clothing | None) -> float:
    assert one is not None and other is not None
    return float(np.sqrt(max(0.0, 1.0 - np.dot(one.colours, other.colours))))


def test_clothes_are_told_apart_and_known_again_elsewhere_and_in_other_light():
    near, far = face(-0.3, 1.2), face(0.5, 2.4)
    red, green = worn(picture((near, RED), (far, GREEN)), near, far)
    dim = cv2.convertScaleAbs(picture((far, RED)), alpha=0.85)
    assert apart(red, green) > 0.3
    assert apart(red, worn(np.asarray(dim, np.uint8), far)[0]) < 0.15
    assert red is not None and np.linalg.norm(red.colours) == pytest.approx(1.0, abs=1e-3)
    assert red.share == 1.0


def test_what_somebody_nearer_covers_does_not_count():
    far, near = face(0.0, 2.4), face(0.22, 1.4)
    alone, (partly, _) = (
        worn(picture((far, RED)), far),
        worn(picture((far, RED), (near, GREEN)), far, near),
    )
    assert partly is not None and partly.share < 0.6
    assert apart(alone[0], partly) < 0.1
    hidden, _ = worn(picture((far, RED), (face(0.0, 1.4), GREEN)), far, face(0.05, 1.4))
    assert hidden is None


def test_every_share_of_colours_is_as_it_was_reviewed():
    faces = face(-0.3, 1.2), face(0.1, 2.4)
    x, y = np.meshgrid(*map(np.arange, SIZE))
    image = np.dstack((x % 256, y % 256, (x + y) % 256)).astype(np.uint8)
    unknown = replace(faces[0], landmarks_px=np.zeros((0, 2)))
    assert worn(image, unknown) == [None]
    assert_reviewed(
        "clothes", [(*of.colours, of.share) for of in map(present, worn(image, *faces))]
    )


def test_a_person_without_a_face_wears_the_same():
    p = np.array([0.1, -0.2, 2.0])
    one, ((x, y),) = face(0.1, 2.0), project(p[None], LENS).tolist()
    px_m = LENS.fx_px / 2.0
    body = DetectedPerson((0, 0, 1, 1), (x, y - 0.05 * px_m), 0.83 * px_m, 0.9)
    (dressed,), (person,) = add_clothing(picture((one, RED)), (one,), (body,))
    assert apart(dressed.clothing, person.clothing) < 0.05


def test_frames_come_with_clothes_and_the_same_ones_again():
    one = face(0.0, 1.6)

    class Found:
        def find(self, _: ImageArray) -> tuple[DetectedFace, ...]:
            return (one,)

    image = Crowd(1, np.random.default_rng(0)).image({0: np.array([0.0, -0.2, 1.6])}, 1)
    first, again = (FrameAnalyzer(Found()).analyze(Shot(0.0, 1, image)).faces for _ in "ab")
    assert first[0].clothing is not None and first[0].clothing == again[0].clothing
