"""Bad conditions of a camera are reported once at their start and end; good ones never."""

from functools import cache
from typing import Any

import numpy as np
import pytest
from seeing.material import background, noisy, paste, portrait

from gazerig.drivers.camera.capture_loop import FrameAnalyzer
from gazerig.drivers.camera.health import CameraHealth
from gazerig.drivers.camera.orientation import FrameOrientation, Rotation
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import Detections
from gazerig.drivers.vision.face.mtcnn import MtcnnDetector
from gazerig.drivers.vision.face.params import FaceDetectorParams

WIDTH, HEIGHT = 640, 480
PERIOD_S = 0.25


@cache
def room(people: int = 2) -> np.ndarray:
    """Return a real room with real heads in it."""
    image = background(WIDTH, HEIGHT).copy()
    for k, name in enumerate(("astronaut", "hopper")[:people]):
        paste(image, portrait(name), (200.0 + 240.0 * k, 220.0), 36.0)
    image.setflags(write=False)
    return image


class Unseen:
    """Finds no face."""

    def find(self, image: np.ndarray) -> tuple[()]:
        return ()


_find, _found = MtcnnDetector.find, dict[object, Any]()


@pytest.fixture(autouse=True)
def pictures_are_searched_once(monkeypatch) -> None:
    """Remember faces: the detector keeps nothing from one picture to the next."""

    def find(self: MtcnnDetector, image: np.ndarray) -> Any:
        key = image.shape, image.tobytes()
        if key not in _found:
            _found[key] = _find(self, image)
        return _found[key]

    monkeypatch.setattr(MtcnnDetector, "find", find)


def looked(
    images: list[np.ndarray], detector: Any = None, **how: Any
) -> tuple[list[tuple[float, str]], Detections]:
    """Return the reports on frames with their times, and the last detections."""
    analyzer = FrameAnalyzer(detector or MtcnnDetector(FaceDetectorParams()), **how)
    told: list[tuple[float, str]] = []
    for k, image in enumerate(images):
        found = analyzer.analyze(Shot(PERIOD_S * k, k + 1, image))
        told += [(PERIOD_S * k, line) for line in analyzer.events()]
    return told, found


@pytest.mark.parametrize(
    ("spoilt", "begins", "ends"),
    [
        (lambda good: good // 16, "camera: the picture is too dark: ", "bright enough again"),
        (np.zeros_like, "camera: the picture is black: uncover", "bright"),
    ],
)
def test_a_bad_picture_is_told_as_it_begins_and_as_it_ends(spoilt, begins, ends):
    good = room()[::2, ::2]
    bad = spoilt(good)
    told, found = looked([good] * 12 + [bad] * 40, Unseen())
    assert len(told) == 1 and told[0][1].startswith(begins)
    assert found.conditions == (told[0][1].removeprefix("camera: "),)
    told, found = looked([bad] * 40 + [good] * 40, Unseen())
    assert len(told) == 2 and ends in told[1][1]
    assert found.conditions == ()


@pytest.mark.parametrize(
    "picture",
    [
        room,
        lambda: room(0),
        lambda: noisy(room() // 4, 4.0, np.random.default_rng(2)),
        lambda: np.full((HEIGHT, WIDTH, 3), 200, np.uint8),
    ],
)
def test_good_pictures_are_left_alone(picture):
    image = picture()
    for turns_film in (False, True):
        told, found = looked([image] * 40, turns_film=turns_film)
        assert (told, found.conditions, found.width_px) == ([], (), WIDTH)


def turned(image: np.ndarray, clockwise: Rotation) -> np.ndarray:
    return FrameOrientation(clockwise).turn_image(image)


@pytest.mark.parametrize(
    ("deg", "mounted", "set_to"), [(180, 0, 180), (90, 0, 270), (270, 0, 90), (90, 90, 0)]
)
def test_a_turned_camera_is_told_within_five_seconds_with_its_rotation(deg, mounted, set_to):
    # As the camera delivers it: before its present rotation.
    as_delivered = turned(room(), (deg - mounted) % 360)
    told, found = looked([as_delivered] * 40 + [turned(as_delivered, -deg % 360)] * 40,
                         orientation=FrameOrientation(mounted))  # fmt: skip
    (t_s, line), (_, end) = told
    assert t_s < 5.0 and f"camera is turned by {deg} deg" in line
    assert line.endswith(f"set camera.rotation: {set_to}")
    assert end == "camera: the picture is upright again" and found.conditions == ()


def test_frames_analysed_too_slowly_are_told_with_the_slowest_stage():
    health = CameraHealth()
    for k in range(0, 300, 5):
        told = health.assess(Shot(k / 30, k, room()), {"faces": 0.05, "motion": 0.1})
    assert told == (
        "6 of 30 frames a second are analysed; one takes 167 ms (motion 100 ms), and the camera "
        "delivers one every 33 ms: lower motion.work_px, or set motion.enabled: false",
    )
