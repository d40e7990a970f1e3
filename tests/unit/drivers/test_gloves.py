"""Boxing gloves found by their colour."""

from dataclasses import astuple
from math import radians

import cv2
import numpy as np
import pytest
from reviewed import assert_reviewed

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.pinhole import intrinsics_of_view
from gazerig.drivers.types import ImageArray, MovingBlob
from gazerig.drivers.vision.motion.detector import MotionDetector
from gazerig.drivers.vision.motion.gloves import RADIUS_M, GloveDetector, exclude_gloves
from gazerig.drivers.vision.motion.params import MotionParams
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run_rig import with_options

LENS = intrinsics_of_view(radians(69.0), 640, 480)
RED, BRICK, SKIN = (38, 30, 206), (70, 90, 140), (120, 150, 205)
Ball = tuple[float, float, float]


def scene(*balls: Ball, colour: tuple[int, int, int] = RED, noise: float = 3.0) -> ImageArray:
    """Draw balls of a glove's size at places x, y, z of the camera, the farthest first."""
    image = np.full((480, 640, 3), BRICK, np.uint8)
    cv2.circle(image, (320, 100), 40, SKIN, -1)
    for x, y, z in sorted(balls, key=lambda ball: -ball[2]):
        u, v = x / z * LENS.fx_px + LENS.cx_px, y / z * LENS.fy_px + LENS.cy_px
        radius = RADIUS_M / z * LENS.fx_px
        cv2.circle(image, (round(u), round(v)), round(radius), colour, -1, cv2.LINE_AA)
    grain = np.random.default_rng(0).normal(0.0, noise, image.shape)
    return np.clip(image + grain, 0, 255).astype(np.uint8)


def found(finder: GloveDetector, image: ImageArray, t_s: float = 0.0) -> tuple[MovingBlob, ...]:
    return finder.find(image, t_s, LENS, 320)


@pytest.mark.parametrize("z", [0.35, 0.6, 0.9, 1.2])
def test_a_glove_is_where_it_is_and_as_far_away_as_its_size_says(z):
    (glove,) = found(GloveDetector(), scene((-0.1, 0.08, z)))
    assert glove.kind == "hand" and glove.depth_known
    assert glove.p_camera_m[:2] == pytest.approx((-0.1, 0.08), abs=0.02)
    assert glove.p_camera_m[2] == pytest.approx(z, rel=0.07)
    assert abs(glove.p_camera_m[2] - z) < 2.5 * glove.depth_sd_m


def test_what_is_not_red_or_too_far_or_too_small_is_no_glove():
    assert found(GloveDetector(), scene()) == ()
    assert found(GloveDetector(), scene((0.0, 0.1, 0.6), colour=SKIN)) == ()
    assert found(GloveDetector(), scene((0.0, 0.1, 0.6), colour=(200, 60, 30))) == ()
    assert found(GloveDetector(), scene((0.0, 0.1, 2.2))) == ()
    rope = scene()
    cv2.line(rope, (0, 300), (639, 310), RED, 8)
    assert found(GloveDetector(), rope) == ()
    grey = np.repeat(scene((0.0, 0.1, 0.6))[:, :, :1], 3, axis=2)
    assert found(GloveDetector(), grey) == ()


def test_a_glove_of_which_a_part_is_hidden_is_as_far_away_as_it_was():
    """It goes behind the other glove, which is nearer."""
    other: Ball = (0.2, 0.1, 0.4)
    finder = GloveDetector()
    for k in range(5):
        gloves = found(finder, scene((0.02 + 0.0375 * k, 0.1, 0.8), other), k / 30)
        far = [one.p_camera_m[2] for one in gloves if one.p_camera_m[2] > 0.5]
        assert len(far) == 1 and far[0] == pytest.approx(0.8, rel=0.1)
    unknown = found(GloveDetector(), scene((0.17, 0.1, 0.8), other))
    assert all(one.p_camera_m[2] < 0.5 for one in unknown)


def test_every_number_of_gloves_is_as_it_was_reviewed():
    """One goes behind another, one out of the picture, and one has a highlight."""
    finder, rows = GloveDetector(), []
    for k in range(7):
        image = scene((0.02 + 0.0375 * k, 0.1, 0.8), (0.15, 0.1, 0.4), (-0.3 - 0.06 * k, -0.1, 0.6))
        cv2.circle(image, (400, 330), 12, (225, 220, 240), -1)
        for one in found(finder, image, k / 30):
            rows.append(np.hstack([x for x in astuple(one) if x not in (None, "hand")]).tolist())
    assert_reviewed("gloves", rows)


def test_the_arm_and_trunk_behind_a_glove_are_nothing_of_their_own():
    glove = MovingBlob(1, "hand", (0.0, 0.0, 0.8), 0.07, centre_px=(110.0, 130.0))
    trunk = MovingBlob(2, "thing", (0.0, 0.0, 2.0), 0.3, box_px=(60.0, 120.0, 200.0, 300.0))
    other = MovingBlob(3, "thing", (1.0, 0.0, 2.0), 0.1, box_px=(400.0, 120.0, 30.0, 30.0))
    assert exclude_gloves((trunk, other), (glove,)) == (other,)
    assert exclude_gloves((trunk, other), ()) == (trunk, other)


@pytest.mark.parametrize("gloves", [True, False])
def test_the_motion_detector_finds_them_when_it_is_told_to(gloves):
    detector = MotionDetector(MotionParams(gloves=gloves))
    still = scene((0.1, 0.1, 0.8))
    kinds = [blob.kind for k in range(3) for blob in detector.find(still, k / 30, LENS, np.eye(3))]
    assert kinds == (["hand"] * 3 if gloves else [])


def test_a_world_with_a_boxer_is_looked_at_by_both_and_others_are_not():
    pytest.importorskip("gazerig.features.world")
    rig = load_rig("desk")
    for options, planned, gloves in (
        (RunOptions(mock=True, world="boxing"), True, True),
        (RunOptions(mock=True, scene="boxing"), True, False),
        (RunOptions(mock=True, world="living-room"), False, False),
        (RunOptions(mock=True, scene="visitor"), False, False),
    ):
        made = with_options(rig, options)
        assert (made.gaze.top_down.planner, made.motion.gloves) == (planned, gloves)
