"""Any picture, any order of times, any depth: an honest answer, and the same one each time."""

from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.detector import MotionDetector
from gazerig.drivers.vision.motion.flow import is_searchable
from gazerig.drivers.vision.motion.params import MotionParams

DT_S = 1 / 30
GRAIN = cv2.GaussianBlur(np.random.default_rng(0).standard_normal((700, 900)), (0, 0), 3.0)
GROUND = np.clip(128 + 400 * GRAIN, 0, 255).astype(np.uint8)
Pictures = NDArray[np.uint8]


def lens(width: int, height: int) -> Intrinsics:
    focal = 0.73 * width
    return Intrinsics(fx_px=focal, fy_px=focal, cx_px=(width - 1) / 2, cy_px=(height - 1) / 2)


def scene(k: int, width: int = 320, height: int = 240, step: int = 3) -> Pictures:
    """Return ground with a square fifth of its width that moves right by ``step`` a picture."""
    out = GROUND[:height, :width].copy()
    side, x = width // 5, width // 8 + k * step
    out[height // 3 : height // 3 + side, x : x + side] = GROUND[300 : 300 + side, 500 : 500 + side]
    return out


def look(
    detector: MotionDetector,
    picture: Pictures,
    t_s: float,
    depth_m: NDArray[np.float64] | None = None,
) -> tuple[MovingBlob, ...]:
    height, width = picture.shape[:2]
    return detector.find(picture, t_s, lens(width, height), np.eye(3), depth_m)


def last(pictures: list[Pictures], depth_m: NDArray[np.float64] | None = None) -> MovingBlob:
    """Return the one thing found in the last of some pictures."""
    detector = MotionDetector(MotionParams())
    for k, picture in enumerate(pictures):
        blobs = look(detector, picture, k * DT_S, depth_m)
    assert len(blobs) == 1
    return blobs[0]


FIVE: list[Any] = [scene(k) for k in range(5)]


def test_depth_is_the_median_of_what_is_known():
    rng = np.random.default_rng(0)
    depth = np.full((120, 160), 4.0)  # of half the size, too
    depth[36:80, 18:66] = 1.0 + rng.normal(0.0, 0.02, (44, 48))
    depth[rng.random(depth.shape) < 0.2] = np.nan
    depth[rng.random(depth.shape) < 0.2] = 0.0
    depth[rng.random(depth.shape) < 0.05] = np.inf
    blob = last(FIVE, depth)
    assert blob.depth_known
    assert blob.p_camera_m[2] == pytest.approx(1.0, abs=0.02)
    assert 0.005 <= blob.depth_sd_m < 0.05
    x = (52 + 31.5 - 159.5) / 233.6
    assert blob.p_camera_m[0] == pytest.approx(x, abs=0.03)


@pytest.mark.parametrize("depth_m", [np.full((240, 320), np.nan), np.zeros((0, 0))])
def test_a_depth_picture_of_holes_is_none(depth_m):
    blob = last(FIVE, depth_m)
    assert not blob.depth_known and np.isfinite(blob.p_camera_m).all()


@pytest.mark.parametrize("shape", [(1, 1), (47, 300), (3000, 64)])
def test_pictures_too_small_or_narrow_are_silent(shape):
    detector = MotionDetector(MotionParams())
    for k in range(3):
        assert look(detector, np.full(shape, 9 * k, dtype=np.uint8), k * DT_S) == ()
    assert detector.no_result_reason == "frame too small"


def test_flow_needs_48_pixels_and_a_side_of_at_most_four_times_the_other():
    """Below 8 pixels at the finest level OpenCV reads outside its memory."""
    for shape in ((48, 48), (192, 48)):
        assert is_searchable(np.zeros(shape, np.uint8))
    for shape in ((47, 60), (48, 193)):
        assert not is_searchable(np.zeros(shape, np.uint8))


@pytest.mark.parametrize("level", [0, 255])
def test_a_covered_lens_sees_nothing(level):
    detector = MotionDetector(MotionParams())
    for k in range(4):
        assert look(detector, np.full((240, 320, 3), level, dtype=np.uint8), k * DT_S) == ()


def test_noise_alone_is_nothing():
    rng = np.random.default_rng(1)
    detector = MotionDetector(MotionParams())
    for k in range(8):
        noise = rng.integers(0, 256, (240, 320, 3)).astype(np.uint8)
        assert look(detector, noise, k * DT_S) == ()


@pytest.mark.parametrize("times", [(0.0, 0.0), (1.0, 0.5), (0.0, 5.0), (0.0, float("nan"))])
def test_times_that_do_not_follow_are_not_compared(times):
    detector = MotionDetector(MotionParams())
    assert detector.before_s is None
    look(detector, scene(0), times[0])
    assert detector.before_s == times[0]
    assert look(detector, scene(1), times[1]) == ()
    assert detector.no_result_reason == "no frame shortly before"


def test_forgotten_is_forgotten_and_numbers_are_not_used_again():
    detector = MotionDetector(MotionParams())
    ids = []
    for _ in range(2):
        for k, picture in enumerate(FIVE):
            blobs = look(detector, picture, k * DT_S)
        ids.append(blobs[0].id)
        detector.forget()
        assert detector.before_s is None
    assert ids[0] != ids[1]
