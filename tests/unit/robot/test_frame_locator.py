"""Faces and things are located next to the detector; the tick only places and associates them."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from present import present
from seen_people import STILL, face_at, picture, standing

from gazerig.drivers.camera.capture_loop import FrameAnalyzer
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, Detections, MovingBlob
from gazerig.gaze.types import Percept
from gazerig.robot.model.frames import LensParams
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.perception import Perception

FIELD_DEG = 69.0
FACE = face_at((0.1, 0.05, 1.0))
LOCATOR = FrameLocator(None, radians(FIELD_DEG))
BALL = MovingBlob(3, "ball", (0.2, 0.1, 1.5), 0.1, v_camera_m_s=(0.1, 0.0, 0.0))
LENS = LensParams((640, 400), (520.0, 520.0), (319.5, 199.5))


class OneFace:
    """A detector that always finds the same face."""

    def find(self, image: np.ndarray) -> tuple[DetectedFace, ...]:
        return (FACE,)


def perception(lens: LensParams | None = None) -> Perception:
    return Perception(STILL, FIELD_DEG, lens=lens)


def percept_of(seeing: Perception, found: Detections) -> Percept:
    return present(seeing.see(found, standing()))


def shot(number: int) -> Shot:
    return Shot(number / 30, number, np.zeros((400, 640, 3), np.uint8))


def located(found: Detections, locator: FrameLocator = LOCATOR) -> Detections:
    return replace(found, located=locator(found))


def test_what_the_camera_has_located_is_where_the_tick_would_put_it():
    found = located(picture(1, faces=(FACE,), blobs=(BALL,)))
    wanted = percept_of(perception(), replace(found, located=None))
    percept = percept_of(perception(), found)
    assert percept.faces == wanted.faces
    assert percept.bodies.p_world_m.tolist() == wanted.bodies.p_world_m.tolist()
    assert percept.bodies.v_world_m_s.tolist() == wanted.bodies.v_world_m_s.tolist()
    assert percept.bodies.kinds == ("face", "ball")


@pytest.mark.parametrize(
    ("sure", "below_px", "wide_px", "faces"),
    [
        (0.8, 150.0, 140.0, 1),
        (0.95, 150.0, 140.0, 2),
        (0.8, 20.0, 140.0, 2),
        (0.95, 150.0, 30.0, 1),
    ],
)
def test_a_face_printed_on_a_shirt_or_badge_is_no_second_face(
    sure: float, below_px: float, wide_px: float, faces: int
):
    one = replace(FACE, confidence=0.999, box_px=(300.0, 60.0, 65.0, 80.0))
    box = (330.0 - wide_px / 2.0, 60.0 + below_px, wide_px, 170.0)
    other = replace(face_at((0.1, 0.25, 0.6)), confidence=sure, box_px=box)
    assert len(LOCATOR(picture(1, faces=(one, other))).faces) == faces


def test_places_of_another_calibration_are_not_used():
    under_way = located(picture(1, faces=(FACE,)))
    wanted = percept_of(perception(LENS), replace(under_way, located=None))
    assert percept_of(perception(LENS), under_way).faces == wanted.faces


def test_a_frame_comes_with_what_it_shows_located():
    frames = FrameAnalyzer(OneFace(), lambda shot: (BALL,), LOCATOR)
    found = frames.analyze(shot(1))
    assert found.located == LOCATOR(found)
    assert [len(of) for of in present(found.located)[1:3]] == [1, 1]
    assert FrameAnalyzer(OneFace()).analyze(shot(3)).located is None


@pytest.mark.parametrize(
    ("height_px", "area_px", "compact"),
    [(48.0, 1800.0, True), (30.0, 1200.0, False), (48.0, 1200.0, False), (0.0, 0.0, False)],
)
def test_a_patch_as_wide_as_high_that_fills_its_box_is_compact(
    height_px: float, area_px: float, compact: bool
):
    patch = replace(BALL, box_px=(9.0, 9.0, 50.0, height_px), area_px=area_px)
    (thing,) = LOCATOR(picture(1, blobs=(patch,))).things
    assert thing.compact is compact
