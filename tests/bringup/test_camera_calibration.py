"""The lens found from pictures of a board, drawn through a lens that is known."""

from collections.abc import Callable
from math import radians
from typing import Any

import numpy as np
import pytest
from camera_bench import BOARD, SIZE, seen_board

from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.features.bringup.calibration.camera_calibration import (
    CameraCalibrationRefused,
    LensCalibration,
    LensCalibrationParams,
    calibrate_lens,
)
from gazerig.features.bringup.calibration.charuco_views import (
    BoardView,
    ViewParams,
    coverage,
    view_of,
)
from gazerig.robot.model.charuco_board import SeenBoard
from gazerig.robot.model.intrinsics import project
from gazerig.sim_mock.cameras.charuco import BoardCamera, BoardCameraParams, true_lens
from gazerig.sim_mock.cameras.charuco_scene import hand_held_pose

LENS = true_lens(*SIZE)
GUESS = intrinsics_of_view(radians(69.0), *SIZE)
VIEWS = 16


def corners(number: int, noise_px: float, rng: np.random.Generator, lens: Intrinsics) -> SeenBoard:
    """What a detector would find of the board, without a picture."""
    return seen_board(
        *hand_held_pose(number, BoardCameraParams(), lens, BOARD), lens, noise_px, rng
    )


def some_views(noise_px: float = 0.3, seed: int = 0, count: int = VIEWS) -> list[SeenBoard]:
    rng = np.random.default_rng(seed)
    return [corners(k, noise_px, rng, LENS) for k in range(count)]


def calibrated(views: list[SeenBoard], **params: Any) -> LensCalibration:
    """Calibrate from fewer views than 0.3 px of noise would really ask for."""
    params.setdefault("most_focal_error_percent", 0.6)
    return calibrate_lens(views, GUESS, *SIZE, LensCalibrationParams(**params))


def assert_true(found: LensCalibration, true: Intrinsics) -> None:
    lens = found.intrinsics
    assert lens.fx_px == pytest.approx(true.fx_px, rel=0.01)
    assert lens.fy_px == pytest.approx(true.fy_px, rel=0.01)
    assert lens.cx_px == pytest.approx(true.cx_px, abs=0.01 * SIZE[0])
    assert lens.cy_px == pytest.approx(true.cy_px, abs=0.01 * SIZE[0])


@pytest.mark.parametrize("seed", range(3))
def test_lens_from_pictures_is_within_one_percent(seed: int) -> None:
    rng = np.random.default_rng(seed)
    camera = BoardCamera(BoardCameraParams(), LENS, BOARD, rng)
    views = []
    for number in range(24):
        pose = hand_held_pose(number + 5 * seed, camera.params, LENS, BOARD)
        seen = BOARD.find(camera.image(*pose))
        assert seen is not None
        # 0.3 px on top of what the drawn pictures' own noise and blur do.
        views.append(
            seen._replace(corners_px=seen.corners_px + rng.normal(0, 0.3, (len(seen[0]), 2)))
        )
    found = calibrated(views)
    assert_true(found, LENS)
    assert found.rms_px == pytest.approx(0.3 * 2**0.5, rel=0.2)
    assert found.dropped == ()
    # The whole picture, not only the four numbers: no pixel's direction is 0.5 % of the
    # focal length off.
    grid = np.stack(np.meshgrid(np.linspace(-0.55, 0.55, 9), np.linspace(-0.33, 0.33, 7)), axis=-1)
    points = np.concatenate((grid.reshape(-1, 2), np.ones((63, 1))), axis=1)
    off = project(points, found.intrinsics) - project(points, LENS)
    assert np.abs(off - off.mean(axis=0)).max() < 0.005 * LENS.fx_px


@pytest.mark.parametrize("seed", range(6))
def test_what_it_says_of_its_own_error_holds(seed: int) -> None:
    found = calibrated(some_views(0.3, seed))
    off = abs(found.intrinsics.fx_px - LENS.fx_px), abs(found.intrinsics.cx_px - LENS.cx_px)
    assert 0.0 < found.focal_std_px[0] < 0.01 * LENS.fx_px
    assert off[0] < 4.0 * found.focal_std_px[0]
    assert off[1] < 4.0 * found.centre_std_px[0]


def test_the_third_radial_coefficient_is_found_where_there_is_one() -> None:
    bent = Intrinsics(420.0, 420.0, 322.0, 197.0, (-0.3, 0.1, 0.0, 0.0, 0.05))
    rng = np.random.default_rng(3)
    shown = [corners(k, 0.02, rng, bent) for k in range(20)]
    found = calibrate_lens(
        shown, GUESS, *SIZE, LensCalibrationParams(views=ViewParams(edge_share=0.2))
    )
    assert found.intrinsics.distortion[4] == pytest.approx(0.05, abs=0.03)
    plain = calibrated(some_views(0.3))
    assert plain.intrinsics.distortion[4] == 0.0


def test_it_is_written_down_with_the_field_of_view() -> None:
    found = calibrated(some_views(0.05))
    params = found.params()
    assert (params.width_px, params.height_px) == SIZE
    assert params.fx_px == pytest.approx(found.intrinsics.fx_px, abs=0.006)
    assert params.distortion == pytest.approx(found.intrinsics.distortion, abs=1e-6)
    assert found.horizontal_field_deg == pytest.approx(69.6, abs=0.3)


def test_same_views_same_lens_in_the_file() -> None:
    # OpenCV sums in threads: beyond the tenth digit two runs differ.
    assert calibrated(some_views()).params() == calibrated(some_views()).params()


def test_a_view_that_does_not_fit_is_dropped() -> None:
    views = some_views()
    rng = np.random.default_rng(9)
    views[4] = views[4]._replace(corners_px=views[4].corners_px + rng.normal(0.0, 4.0, (1, 2)))
    bent = views[7].corners_px + 5.0 * np.sin(views[7].corners_px / 40.0)
    views[7] = views[7]._replace(corners_px=bent)
    found = calibrated(views)
    assert found.dropped == (7,)
    assert_true(found, LENS)


def flat(view: SeenBoard) -> bool:
    how = view_of(view, GUESS, *SIZE)
    return how is not None and abs(how.tilt_right_deg) < 14 and abs(how.tilt_down_deg) < 14


@pytest.mark.parametrize(
    ("made", "message"),
    [
        (lambda: [], "show 12 more views"),
        (lambda: some_views(count=5), "show 7 more views"),
        (lambda: some_views(count=1) * 20, "19 of them too much like others.*show 11 more"),
        (lambda: [v for v in some_views(count=90) if flat(v)], "tilt the board"),
        (
            lambda: [v for v in some_views(count=60) if v.corners_px[:, 0].min() > 90.0],
            "left edge of the image",
        ),
    ],
)
def test_views_that_do_not_show_the_lens_are_refused(
    made: Callable[[], list[SeenBoard]], message: str
) -> None:
    with pytest.raises(CameraCalibrationRefused, match=message):
        calibrated(made())


def test_corners_that_jump_about_are_refused_with_the_number() -> None:
    with pytest.raises(CameraCalibrationRefused, match=r"error 2\.\d+ px, wanted at most 0.70"):
        calibrated(some_views(1.6))


def test_a_focal_length_that_is_not_sure_is_refused() -> None:
    with pytest.raises(CameraCalibrationRefused, match="sure to .* % only.*tilted"):
        calibrated(some_views(0.3), most_focal_error_percent=0.05)


def test_a_board_that_is_another_one_is_refused() -> None:
    views = [v._replace(corners_px=np.roll(v.corners_px, 3, axis=0)) for v in some_views()]
    with pytest.raises(CameraCalibrationRefused):
        calibrated(views)


def test_coverage_says_what_to_do_next() -> None:
    middle = BoardView(0.4, 0.6, 0.4, 0.6, 0.0, 0.0)
    params = ViewParams(least_views=2)
    wishes = coverage([middle], params).missing
    assert len(wishes) == 10 and wishes[-1] == "show 1 more view, each a new one"
    left = middle._replace(left=0.05, tilt_right_deg=20.0)
    fewer = coverage([middle, left], params).missing
    assert set(wishes) - set(fewer) == {
        "bring the board to the left edge of the image",
        "tilt the board, its right side nearer",
        "hold the board nearer",
        "show 1 more view, each a new one",
    }
    full = BoardView(0.05, 0.95, 0.05, 0.95, 0.0, 0.0)
    tilts = [full._replace(tilt_right_deg=t) for t in (20.0, -20.0)]
    tilts += [full._replace(tilt_down_deg=t) for t in (20.0, -20.0)]
    assert coverage(tilts, params).enough


def test_tilt_is_told_from_the_right_side() -> None:
    angle = radians(25.0)
    R = np.array([(np.cos(angle), 0, np.sin(angle)), (0, 1, 0), (-np.sin(angle), 0, np.cos(angle))])
    centre = np.array((0.126, 0.09, 0.0))
    points = (BOARD.corners_m - centre) @ R.T + (0.0, 0.0, 0.5)
    assert points[5, 2] < points[0, 2]  # the right side is nearer
    how = view_of(SeenBoard(np.arange(24), project(points, GUESS), BOARD.corners_m), GUESS, *SIZE)
    assert how is not None
    assert (how.tilt_right_deg, how.tilt_down_deg) == pytest.approx((25.0, 0.0), abs=0.1)
