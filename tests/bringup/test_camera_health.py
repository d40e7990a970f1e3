"""Bad conditions of a camera are reported once at their start and end; good ones never."""

from functools import cache
from typing import Any

import cv2
import numpy as np
import pytest
from present import present
from seeing.material import background, noisy, paste, portrait

from gazerig.drivers.camera.health import (
    CameraHealth,
    CameraObservation,
    HealthModel,
    TurnedFaceSearch,
)
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
from gazerig.drivers.vision.face.params import FaceDetectorParams

WIDTH, HEIGHT = 640, 480
FAST = {"faces": 0.01}
GOOD = 200.0


@cache
def room(people: int = 2) -> np.ndarray:
    """Return a real room with real heads in it."""
    image = background(WIDTH, HEIGHT).copy()
    for k, name in enumerate(("astronaut", "hopper")[:people]):
        paste(image, portrait(name), (200.0 + 240.0 * k, 220.0), 36.0)
    image.setflags(write=False)
    return image


def turned(image: np.ndarray, clockwise_deg: float) -> np.ndarray:
    turn = cv2.getRotationMatrix2D((WIDTH / 2.0, HEIGHT / 2.0), -clockwise_deg, 1.0)
    return cv2.warpAffine(image, turn, (WIDTH, HEIGHT), borderMode=cv2.BORDER_REPLICATE)


def looked(
    images: list[np.ndarray], detector: Any = None, rotation: int = 0
) -> tuple[list[str], tuple[str, ...]]:
    """Return the reports on frames that are a second apart, and the conditions at their end."""
    health, told = CameraHealth(rotation), list[str]()
    conditions: tuple[str, ...] = ()
    for k, image in enumerate(images):
        faces = detector.find(image) if detector is not None else ()
        conditions = health.assess(Shot(float(k), k + 1, image), faces, FAST)
        told += health.events()
    return told, conditions


def stepped(model: HealthModel, count: int, **seen: Any) -> list[str]:
    return [
        line
        for _ in range(count)
        for line in model.step(CameraObservation(GOOD, True)._replace(**seen))
    ]


@pytest.mark.parametrize(
    ("bad", "begins", "ends"),
    [
        (room() // 16, "camera: the picture is too dark: ", "bright enough again"),
        (np.zeros((HEIGHT, WIDTH, 3), np.uint8), "camera: the picture is black: uncover", "bright"),
    ],
)
def test_a_bad_picture_is_told_as_it_begins_and_as_it_ends(bad, begins, ends):
    good = np.asarray(room())
    told, conditions = looked([good] * 3 + [bad] * 20)
    assert len(told) == 1 and told[0].startswith(begins)
    assert conditions == (told[0].removeprefix("camera: "),)
    told, conditions = looked([bad] * 20 + [good] * 20)
    assert len(told) == 2 and told[1].endswith(ends) or ends in told[1]
    assert conditions == ()


@pytest.mark.parametrize(
    "image",
    [
        np.asarray(room()),
        np.asarray(room(0)),
        noisy(room() // 4, 4.0, np.random.default_rng(2)),
        np.full((HEIGHT, WIDTH, 3), 200, np.uint8),
    ],
    ids=["people", "nobody", "dim and noisy", "one colour"],
)
def test_good_pictures_are_left_alone(image):
    detector = MtcnnDetector(FaceDetectorParams())
    assert looked([image] * 18, detector) == ([], ())


@pytest.mark.parametrize(
    ("deg", "says", "rotation", "set_to"),
    [
        (180, "turned by 180 deg", 0, 180),
        (90, "turned by 90 deg", 0, 270),
        (90, "turned by 90 deg", 90, 0),
        (180, "turned by 180 deg", 270, 90),
    ],
)
def test_a_turned_camera_is_told_with_its_rotation(deg, says, rotation, set_to):
    found = TurnedFaceSearch()
    image = turned(room(), deg)
    at = [found.find(image) for _ in range(3)]
    off = [abs((present(one) - deg + 180.0) % 360.0 - 180.0) for one in at if one]
    assert off and max(off) < 15.0
    model = HealthModel(rotation)
    assert not stepped(model, 5, has_upright_face=False)
    assert model.lacks_upright_faces
    told = stepped(
        model, 8, has_upright_face=False, turned_deg=max(at, key=lambda one: abs(one or 0.0))
    )
    assert len(told) == 1 and says in told[0]
    assert told[0].endswith(f"set camera.rotation: {set_to}")
    assert stepped(model, 20) == ["camera: the picture is upright again"]


def test_frames_that_come_too_fast_are_told_with_the_stage():
    health, told = CameraHealth(), list[str]()
    for k in range(60):  # 60 a second, of which 8 are looked at
        shot = Shot(k / 8.0, 1 + round(7.5 * k), np.asarray(room()))
        health.assess(shot, (), {"faces": 0.01, "motion": 0.1})
        told += health.events()
    assert told == [
        "camera: 8 of 60 frames a second are analysed; motion takes 100 of 125 ms a frame: "
        "lower motion.work_px, or set motion.enabled: false"
    ]
    for k in range(60, 200):
        health.assess(Shot(k / 8.0, 391 + k, np.asarray(room())), (), FAST)
        told += health.events()
    assert told[1:] == ["camera: frames are analysed in time again"]
