"""Any picture, any order of times, any depth: an honest answer, and the same one each time."""

from dataclasses import astuple
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.types import MovingBlob
from gazerig.drivers.vision.motion.detector import MotionDetector, relative_rotation
from gazerig.drivers.vision.motion.image import scale_down
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


def test_a_square_is_where_it_is_and_as_large_as_it_is() -> None:
    blob = last(FIVE)
    assert blob.kind == "thing" and blob.box_px is not None and blob.centre_px is not None
    left, top, width, height = blob.box_px
    assert (left, top) == pytest.approx((40 + 12 - 0.5, 80 - 0.5), abs=6)
    assert (width, height) == pytest.approx((64, 64), abs=12)
    assert blob.area_px == pytest.approx(64 * 64, rel=0.25)
    assert blob.centre_px == pytest.approx((52 + 31.5, 80 + 31.5), abs=6)
    assert blob.flow_px_s == pytest.approx((90.0, 0.0), abs=3)
    assert blob.radius_m == pytest.approx(2.0 * 36 / 233.6, rel=0.15)


def test_without_depth_the_distance_is_assumed_and_says_so() -> None:
    blob = last(FIVE)
    assert not blob.depth_known
    assert blob.p_camera_m[2] == 2.0 and blob.depth_sd_m == 1.0
    assert blob.v_camera_m_s is not None
    assert blob.v_camera_m_s[0] == pytest.approx(2.0 * 90 / 233.6, rel=0.05)


def test_depth_is_the_median_of_what_is_known() -> None:
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


@pytest.mark.parametrize(
    "depth_m",
    [
        np.full((240, 320), np.nan),
        np.zeros((240, 320)),
        np.full((240, 320), -1.0),
        np.zeros((0, 0)),
        np.full((240, 320, 1), 1.0),
    ],
)
def test_a_depth_picture_of_holes_is_none(depth_m: NDArray[np.float64]) -> None:
    blob = last(FIVE, depth_m)
    assert not blob.depth_known and np.isfinite(blob.p_camera_m).all()


def test_grey_colour_and_alpha_say_the_same() -> None:
    three = FIVE[:3]
    plain = last(three)
    for code in (cv2.COLOR_GRAY2BGR, cv2.COLOR_GRAY2BGRA):
        assert astuple(last([np.asarray(cv2.cvtColor(p, code)) for p in three])) == astuple(plain)
    assert astuple(last([picture[..., None] for picture in three])) == astuple(plain)


def test_a_large_picture_says_the_same_in_its_own_pixels() -> None:
    large = [np.asarray(cv2.resize(p, (960, 720), interpolation=cv2.INTER_CUBIC)) for p in FIVE]
    small, blob = last(FIVE), last(large)
    assert small.centre_px is not None and blob.centre_px is not None
    assert blob.centre_px == pytest.approx(np.array(small.centre_px) * 3 + 1, abs=9)
    assert blob.flow_px_s == pytest.approx(np.array(small.flow_px_s) * 3, rel=0.1, abs=9)
    assert blob.p_camera_m == pytest.approx(small.p_camera_m, abs=0.05)


@pytest.mark.parametrize(
    "shape", [(1, 1), (1, 320), (240, 1), (8, 8), (16, 200), (47, 300), (60, 1000), (3000, 64)]
)
def test_pictures_too_small_or_narrow_are_silent(shape: tuple[int, int]) -> None:
    detector = MotionDetector(MotionParams())
    for k in range(3):
        assert look(detector, np.full(shape, 9 * k, dtype=np.uint8), k * DT_S) == ()
    assert detector.report.no_result_reason == "frame too small"


@pytest.mark.parametrize("preset", ["ultrafast", "fast", "medium"])
@pytest.mark.parametrize("finest_level", [0, 1, 2])
@pytest.mark.parametrize("shape", [(48, 48), (48, 192), (192, 48), (64, 65)])
def test_the_smallest_allowed_are_borne(
    shape: tuple[int, int], preset: Any, finest_level: int
) -> None:
    detector = MotionDetector(MotionParams(preset=preset, finest_level=finest_level))
    for k in range(3):
        look(detector, GROUND[k : k + shape[0], : shape[1]], k * DT_S)
    assert detector.report.no_result_reason != "frame too small"


def test_a_change_of_size_begins_anew() -> None:
    detector = MotionDetector(MotionParams())
    for k in range(3):
        look(detector, scene(k), k * DT_S)
    assert look(detector, scene(3)[:200], 3 * DT_S) == ()
    assert detector.report.no_result_reason == "first frame"
    for k in range(4, 7):
        blobs = look(detector, scene(k)[:200], k * DT_S)
    assert len(blobs) == 1


@pytest.mark.parametrize("level", [0, 255])
def test_a_covered_lens_sees_nothing(level: int) -> None:
    detector = MotionDetector(MotionParams())
    for k in range(4):
        assert look(detector, np.full((240, 320, 3), level, dtype=np.uint8), k * DT_S) == ()


def test_noise_alone_is_nothing() -> None:
    rng = np.random.default_rng(1)
    detector = MotionDetector(MotionParams())
    for k in range(8):
        noise = rng.integers(0, 256, (240, 320, 3)).astype(np.uint8)
        assert look(detector, noise, k * DT_S) == ()


@pytest.mark.parametrize("times", [(0.0, 0.0), (1.0, 0.5), (0.0, 5.0), (0.0, float("nan"))])
def test_times_that_do_not_follow_are_not_compared(times: tuple[float, float]) -> None:
    detector = MotionDetector(MotionParams(confirm_frames=1))
    assert detector.before_s is None
    look(detector, scene(0), times[0])
    assert detector.before_s == times[0]
    assert look(detector, scene(1), times[1]) == ()
    assert detector.report.no_result_reason == "no frame shortly before"


def test_joints_without_a_number_count_as_unknown() -> None:
    detector = MotionDetector(MotionParams())
    for k, picture in enumerate(FIVE):
        blobs = detector.find(picture, k * DT_S, lens(320, 240), np.full((3, 3), np.nan))
    assert len(blobs) == 1


@pytest.mark.parametrize(
    "picture", [np.zeros((240, 320)), np.zeros((2, 2, 5), np.uint8), np.zeros((0, 4), np.uint8)]
)
def test_what_is_no_picture_is_refused_in_words(picture: NDArray[np.uint8]) -> None:
    with pytest.raises(ValueError, match="an image is"):
        scale_down(picture, 320, lens(320, 240), 0.0)


def test_same_pictures_same_answer() -> None:
    assert astuple(last(FIVE)) == astuple(last(FIVE))


def test_forgotten_is_forgotten_and_numbers_are_not_used_again() -> None:
    detector = MotionDetector(MotionParams())
    ids = []
    for _ in range(2):
        for k, picture in enumerate(FIVE):
            blobs = look(detector, picture, k * DT_S)
        ids.append(blobs[0].id)
        detector.forget()
        assert detector.before_s is None
    assert ids[0] != ids[1]


def test_the_turn_between_two_orientations() -> None:
    c, s = np.cos(0.1), np.sin(0.1)
    before, now = np.eye(3), np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
    ahead = relative_rotation(now, before) @ (0.0, 0.0, 1.0)
    assert ahead == pytest.approx((-s, 0.0, c))  # who turns right sees the room go left


# People who walk in a square, against a mask that knows nothing of flow


FILM = Path(__file__).parents[2] / "shared" / "media" / "vtest.avi"
RATE_HZ, LEARN, LOOK = 10.0, 40, 40
BEGIN = 210


@pytest.mark.skipif(not FILM.exists(), reason=f"no film at {FILM}")
def test_what_moves_lies_on_people_who_walk() -> None:
    film = cv2.VideoCapture(str(FILM))
    ground = cv2.createBackgroundSubtractorMOG2(detectShadows=True)
    detector = MotionDetector(MotionParams())
    speck, near = np.ones((3, 3), np.uint8), np.ones((11, 11), np.uint8)
    on = reported = peopled = noticed = 0
    for k in range(BEGIN + LOOK):
        good = film.grab()
        assert good
        if k < BEGIN - LEARN * 5 or (k < BEGIN and k % 5):
            continue
        _, picture = film.retrieve()
        moving = (ground.apply(picture) == 255).astype(np.uint8)
        if k < BEGIN:
            continue
        height, width = picture.shape[:2]
        lens = Intrinsics(
            fx_px=0.73 * width, fy_px=0.73 * width, cx_px=(width - 1) / 2, cy_px=(height - 1) / 2
        )
        blobs = detector.find(picture, k / RATE_HZ, lens, np.eye(3))
        if k < BEGIN + RATE_HZ:
            continue
        mask = cv2.dilate(cv2.morphologyEx(moving, cv2.MORPH_OPEN, speck), near)
        centres = [blob.centre_px for blob in blobs if blob.centre_px is not None]
        on += sum(int(mask[round(y), round(x)]) for x, y in centres)
        reported += len(centres)
        peopled += int(mask.sum() > 4000)
        noticed += int(mask.sum() > 4000 and bool(centres))
    film.release()
    assert reported > 2 * LOOK
    assert on >= 0.95 * reported
    assert noticed >= 0.98 * peopled > 0
