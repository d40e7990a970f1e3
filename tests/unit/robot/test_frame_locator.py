"""Faces and things are located next to the detector; the tick only places and associates them."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from present import present
from seen_people import STILL, face_at, picture, standing
from text_table import rows

from gazerig.drivers.camera.capture_loop import FrameAnalyzer
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.types import (
    DetectedFace,
    DetectedPalm,
    DetectedPerson,
    Detections,
    Located,
    MovingBlob,
)
from gazerig.gaze.types import Percept
from gazerig.robot.model.frames import LensParams
from gazerig.robot.perception.frame_locator import FrameLocator
from gazerig.robot.perception.perception import Perception

FIELD_DEG = 69.0
FACE = face_at((0.1, 0.05, 1.0))
LOCATOR = FrameLocator(None, radians(FIELD_DEG))
BALL = MovingBlob(3, "ball", (0.2, 0.1, 1.5), 0.1, v_camera_m_s=(0.1, 0.0, 0.0))
OWN = Intrinsics(500.0, 500.0, 320.0, 200.0)
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


COMPACT = """
48 1800 1, 43.6 1400 1, 43.4 1400 0, 57.4 1800 1, 57.5 1800 0, 48 1441 1, 48 1439 0, 0 0 0
"""


@pytest.mark.parametrize(("height_px", "area_px", "compact"), rows(COMPACT.replace(",", "\n")))
def test_a_patch_as_wide_as_high_that_fills_its_box_is_compact(height_px, area_px, compact):
    patch = replace(BALL, box_px=(9.0, 9.0, 50.0, height_px), area_px=area_px)
    (thing,) = LOCATOR(picture(1, blobs=(patch,))).things
    assert thing.compact == bool(compact)


PARTS = """
# A body's middle of the head, or a palm, at x and y; length of its trunk or palm; depth there,
# from and to; its place, error along the view, and whether it is at the edge
face 320  200  100 none 0    |  0        0        4.15     0.6225    0
face 12   200  100 none 0    | -2.54976  0        4.15     0.7306059 1
face 320  -60  100 none 0    |  0       -1.55376  4.15     0.6646989 1
face 630  390  100 none 0    |  2.54976  1.55376  4.15     0.7668793 1
face 420  200  100 2    2    |  0.42     0        2.1      0.0214159 0
face 320  200  100 2    0    |  0        0        4.15     0.6225    0
hand 320  200  50  none 0    |  0        0        0.88     0.132     0
hand 420  300  50  2    2    |  0.4      0.4      2        0.0207846 0
"""


@pytest.mark.parametrize("row", rows(PARTS))
def test_a_part_of_a_body_is_where_its_length_or_depth_puts_it(row):
    kind, x, y, size, depth, to, *place, along, edge = row
    depth_m = None if depth == "none" else np.full((400, 640), depth, np.float32)
    if depth_m is not None and to != depth:  # too few of its pixels have one
        depth_m[np.arange(400) % 4 > 0] = np.nan
    body = DetectedPerson((0.0, 0.0, 1.0, 1.0), (x, y), size, 0.8)
    found = picture(1, depth_m=depth_m, lens=OWN, people=(body,),
                    palms=(DetectedPalm((x, y), size, 0.8),))  # fmt: skip
    frame = LOCATOR(found)
    (one,) = frame.faces if kind == "face" else present(frame.palms)
    radius_m, across_m = (0.1, 0.05) if kind == "face" else (0.07, 0.03)
    assert one.p_m == pytest.approx(place) and one.along_sd_m == pytest.approx(along, rel=1e-5)
    assert one == Located(
        kind, one.p_m, None, radius_m, 0.0, 0.8, depth_measured=depth == to,
        across_sd_m=across_m, along_sd_m=one.along_sd_m, from_side=bool(edge),
    )  # fmt: skip


THINGS = """
# Whether its depth is known and how well; error of its growth; radius; box; errors across and
# along the view, of both speeds; height of its upper end, 2 m away, 1 m/s to the side
1  0     0     0.1  none    | 0.002      0.02       0.116619  1         none
1  0.05  0.4   0.1  none    | 0.002      0.0538516  0.116619  0.8       none
0  1     0     0.1  40 40   | 0.0300666  1.0002     0.116619  1.1661904 none
0  1     0.4   0.2  40 55   | 0.0600333  1.0002     0.116619  1         none
0  1     inf   0.2  40 60   | 0.0600333  1.0002     0.116619  20        -0.3760292
"""


@pytest.mark.parametrize("line", THINGS.splitlines()[3:])
def test_a_thing_has_the_errors_of_its_place_and_speed(line):
    given, _, wanted = line.partition("|")
    known, depth_sd, loom_sd, radius_m, *size = given.split()
    *errors, upper = wanted.split()
    box = None if size == ["none"] else (300.0, 100.0, float(size[0]), float(size[1]))
    blob = MovingBlob(
        5, "thing", (0.0, 0.0, 2.0), float(radius_m), v_camera_m_s=(1.0, 0.0, 0.0),
        depth_known=known == "1",
        depth_sd_m=float(depth_sd), loom_sd_1_s=float(loom_sd), box_px=box,
    )  # fmt: skip
    (one,) = LOCATOR(picture(1, lens=OWN, blobs=(blob,))).things
    found = one.across_sd_m, one.along_sd_m, one.across_sd_m_s, one.along_sd_m_s
    assert found == pytest.approx(tuple(map(float, errors)), rel=1e-5)
    assert (upper == "none") == (one.upper_m is None)
    assert one.upper_m is None or one.upper_m[1] == pytest.approx(float(upper), rel=1e-5)


CHESTS = """
# Confidence of both faces; middle of the other one, aside and below in heights of the first, and
# its width over the first one's; number of faces
0.999 0.89  0     2     1     1
0.999 0.91  0     2     1     2
0.9   0.85  0     2     1     2  # hardly less sure
0.999 0.95  0     2     0.59  1  # small
0.999 0.95  0     2     0.61  2
0.999 0.89  0.99  2     1     1
0.999 0.89  -1.01 2     1     2
0.999 0.89  0     1.01  1     1
0.999 0.89  0     0.99  1     2
0.999 0.89  0     2.99  1     1
0.999 0.89  0     3.01  1     2
"""


@pytest.mark.parametrize("row", rows(CHESTS))
def test_a_face_printed_on_a_shirt_or_badge_is_no_second_face(row):
    sure, other_sure, aside, below, wide, faces = row
    one = replace(FACE, confidence=sure, box_px=(300.0, 60.0, 64.0, 50.0))
    box = (332.0 + 50.0 * aside - 32.0 * wide, 85.0 + 50.0 * below - 40.0, 64.0 * wide, 80.0)
    other = replace(face_at((0.1, 0.25, 0.6)), confidence=other_sure, box_px=box)
    assert len(LOCATOR(picture(1, faces=(one, other))).faces) == faces


def test_the_largest_and_fastest_things_are_passed_on():
    still = [replace(BALL, id=k, radius_m=0.01 * k, v_camera_m_s=None) for k in range(24)]
    fast = replace(BALL, id=99, radius_m=0.0, v_camera_m_s=(0.0, 0.02, 0.0))
    things = LOCATOR(picture(1, blobs=(*still, fast))).things
    assert {thing.detector_id for thing in things} == {99, *range(1, 24)}


def test_a_lens_that_does_not_fit_is_told():
    locator = FrameLocator(LENS, radians(FIELD_DEG))
    assert locator.fault(picture(1)) == LOCATOR.fault(picture(1)) == ""
    fault = locator.fault(replace(picture(1), width_px=480))
    assert fault.startswith(
        "camera.lens does not fit: it was measured on 640 x 400, images are 480"
    )
