"""Landmarks outside the picture: reported once, and the gaze continues without such a face."""

from dataclasses import replace

import numpy as np
import pytest
from test_face_pose import CAMERA, image_of, turned
from test_gaze_at_head import AT_EYES, standing

from gazerig.drivers.camera.capture_loop import FrameAnalyzer, is_off_frame
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import DetectedFace, Detections
from gazerig.robot.perception.perception import Perception
from gazerig.robot.perception.tracker import Tracker

PIXELS = image_of(turned(0.1, 0.0, 0.0), np.array((0.0, 0.0, 0.8)))
FACE = DetectedFace((290.0, 200.0, 80.0, 80.0), PIXELS, 0.9)
# As a detector gives it that was made for frames of three times the size.
OFF = replace(FACE, landmarks_px=3.0 * PIXELS)


@pytest.mark.parametrize(
    ("shift", "off"),
    [((0, 0), False), ((-300, 0), False), ((-330, 0), True), ((0, 250), True), ((400, 0), True)],
)
def test_a_face_that_the_edge_cuts_is_one_while_its_middle_is_inside(
    shift: tuple[float, float], off: bool
) -> None:
    assert is_off_frame(replace(FACE, landmarks_px=PIXELS + shift), 640, 480) is off


def test_one_point_far_outside_is_no_face() -> None:
    points = PIXELS.copy()
    points[4] = (5000.0, 200.0)
    assert is_off_frame(replace(FACE, landmarks_px=points), 640, 480)
    assert not is_off_frame(FACE, 640, 480)


def test_the_others_are_looked_at() -> None:
    perception = Perception(AT_EYES, 65.0, Tracker())
    percept = perception.see(Detections(1.0, 1, 640, 480, (OFF, FACE), lens=CAMERA), standing())
    assert percept is not None and len(percept.faces) == 1
    none = perception.see(Detections(9.0, 2, 640, 480, (OFF,), lens=CAMERA), standing())
    assert none is not None and none.faces == ()


def test_it_is_left_out_by_the_process_of_the_camera() -> None:
    class Detector:
        def find(self, image: object) -> tuple[DetectedFace, ...]:
            return (FACE, OFF)

    image = np.zeros((480, 640, 3), np.uint8)
    (seen,) = FrameAnalyzer(Detector()).analyze(Shot(0.1, 1, image)).faces
    assert np.array_equal(seen.landmarks_px, PIXELS)
