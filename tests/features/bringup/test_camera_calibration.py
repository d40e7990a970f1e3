"""The lens found from pictures of a board, drawn through a lens that is known."""

import re
from collections.abc import Sequence
from dataclasses import replace
from math import radians
from typing import Any, cast

import numpy as np
import pytest
from desk import GAZE_JOINTS, LIDS

from gazerig.drivers.camera.pinhole import Intrinsics, intrinsics_of_view
from gazerig.drivers.vision.charuco_board import CharucoBoard, DetectedBoard
from gazerig.features.bringup.calibration.board_page import PAPERS_MM, write_page
from gazerig.features.bringup.calibration.board_views import ViewCollector, board_view
from gazerig.features.bringup.calibration.camera_procedure import neck_angles, neck_steps
from gazerig.features.bringup.calibration.hand_eye import NeckView, camera_on_head
from gazerig.features.bringup.calibration.lens_calibration import (
    CameraCalibrationRefused,
    LensCalibration,
    calibrate_lens,
)
from gazerig.gaze.types import Angles3
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.frames import CameraParams
from gazerig.robot.model.intrinsics import project
from gazerig.robot.model.kinematics import GeometryParams, Kinematics
from gazerig.sim_mock.cameras.charuco_scene import (
    BOARD_LENS,
    BoardPose,
    BoardScene,
    hand_held_pose,
)

SIZE = (640, 400)
BOARD = CharucoBoard()
KINEMATICS = Kinematics(GeometryParams(70.0, 38.0, 55.0), GAZE_JOINTS, LIDS)
RANGES = ((-1.2, 1.2), (-0.5, 0.5), (-0.35, 0.35))
"""Yaw, pitch and roll of the desk rig's neck, rad."""


def seen_board(
    pose: BoardPose, lens: Intrinsics, noise_px: float, rng: np.random.Generator
) -> DetectedBoard:
    """Return the corners that a detector would find, without a picture."""
    R, p_m = pose
    px = project(BOARD.corners_m @ R.T + p_m, lens)
    inside = ((px > 0.0) & (px < np.array(SIZE) - 1.0)).all(axis=1)
    px += rng.normal(0.0, noise_px, px.shape)
    return DetectedBoard(np.flatnonzero(inside), px[inside], BOARD.corners_m[inside])


LENS = replace(BOARD_LENS, distortion=(-0.11, 0.06, 0.0008, -0.0006, 0.0))
GUESS = intrinsics_of_view(radians(69.0), *SIZE)


def some_views(noise_px: float = 0.3, count: int = 16) -> list[DetectedBoard]:
    rng = np.random.default_rng(0)
    return [seen_board(hand_held_pose(k, BOARD), LENS, noise_px, rng) for k in range(count)]


def calibrated(views: list[DetectedBoard]) -> LensCalibration:
    """Calibrate from fewer views than 0.3 px of noise would really ask for."""
    return calibrate_lens(views, *SIZE, 0.6)


def assert_true(found: LensCalibration, true: Intrinsics) -> None:
    lens, slack = found.intrinsics, 0.01 * SIZE[0]
    assert (lens.fx_px, lens.fy_px) == pytest.approx((true.fx_px, true.fy_px), rel=0.01)
    assert (lens.cx_px, lens.cy_px) == pytest.approx((true.cx_px, true.cy_px), abs=slack)


def test_a_view_that_does_not_fit_is_dropped():
    views = some_views()
    rng = np.random.default_rng(9)
    views[4] = views[4]._replace(corners_px=views[4].corners_px + rng.normal(0.0, 4.0, (1, 2)))
    bent = views[7].corners_px + 5.0 * np.sin(views[7].corners_px / 40.0)
    views[7] = views[7]._replace(corners_px=bent)
    found = calibrated(views)
    assert found.dropped == 1
    assert_true(found, LENS)


def flat(view: DetectedBoard) -> bool:
    how = board_view(view, GUESS, *SIZE)
    return how is not None and how[4:8].max() < 14.0


@pytest.mark.parametrize(
    ("made", "missing"),
    [
        (lambda: [], "left edge of the image"),
        (lambda: some_views(count=60)[:9], "show [3-9] more views|edge|tilt|nearer"),
        (lambda: [v for v in some_views(count=90) if flat(v)], "tilt the board"),
        (
            lambda: [v for v in some_views(count=60) if v.corners_px[:, 0].min() > 90.0],
            "left edge of the image",
        ),
    ],
)
def test_views_that_do_not_show_the_lens_are_not_enough(made, missing):
    collector = ViewCollector(GUESS, *SIZE)
    for view in made():
        collector.offer(view)
    assert re.search(missing, collector.missing)


def test_each_view_is_a_new_one():
    collector, (view,) = ViewCollector(GUESS, *SIZE), some_views(count=1)
    answers = [collector.offer(one) for one in (None, view, view)]
    assert answers == ["no board seen", "", "too much like a view before"]


def test_corners_that_jump_about_are_refused_with_the_number():
    with pytest.raises(CameraCalibrationRefused, match=r"error 2\.\d+ px, wanted at most 0.70"):
        calibrated(some_views(1.6))


# --- The calibration board: on paper in true size, and found in pictures


@pytest.mark.parametrize("paper", sorted(PAPERS_MM))
def test_the_page_has_the_size_of_the_paper_in_print(paper, tmp_path):
    from PIL import Image

    wide_mm, high_mm = PAPERS_MM[paper]
    png, pdf = tmp_path / "board.png", tmp_path / "board.pdf"
    write_page(BOARD, paper, png)
    write_page(BOARD, paper, pdf)
    with Image.open(png) as image:
        dots_mm = [
            size / dpi * 25.4 for size, dpi in zip(image.size, image.info["dpi"], strict=True)
        ]
    assert dots_mm == pytest.approx((wide_mm, high_mm), abs=0.1)
    box = re.search(rb"/MediaBox \[ ([\d. ]+) \]", pdf.read_bytes())
    assert box is not None
    left, low, right, top = map(float, box.group(1).split())
    assert ((right - left) / 72 * 25.4, (top - low) / 72 * 25.4) == pytest.approx(
        (wide_mm, high_mm), abs=0.1
    )


# --- Calibrating a camera step by step, with a simulated board, head and clock


CAMERA = CameraParams()


class MovedNeck:
    """A head that reaches its commands immediately."""

    def __init__(self, scene: BoardScene, clock: SimulatedClock) -> None:
        self.scene, self.clock = scene, clock
        self.went: list[Angles3] = []

    def turn(self, head_rad: Angles3) -> None:
        self.went.append(head_rad)
        self.scene.head_rad = head_rad
        self.rest(1.0)

    def rest(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now_s() + seconds)

    @property
    def angles(self) -> Angles3:
        assert self.scene.head_rad is not None
        return self.scene.head_rad


@pytest.fixture
def scene() -> BoardScene:
    return BoardScene(CAMERA, BOARD, KINEMATICS)


@pytest.fixture
def neck(scene: BoardScene) -> MovedNeck:
    scene.head_rad = (0.0, 0.0, 0.0)
    return MovedNeck(scene, SimulatedClock())


def test_a_head_that_looks_around_finds_its_camera(scene, neck):
    angles = neck_angles(RANGES, BOARD_LENS, 640, 400)[:12]
    now_s = neck.clock.now_s
    steps = list(
        neck_steps(cast(Any, neck), lambda: scene.look(now_s()), now_s, BOARD, KINEMATICS, angles)
    )
    views = [step.view for step in steps if step.view is not None]
    assert len(views) == 12 and neck.went == [*angles, (0.0, 0.0, 0.0)]
    found = camera_on_head(views, BOARD_LENS, 640).camera_params(replace(CAMERA))
    assert found.position_mm == pytest.approx(scene.mount.position_mm, abs=3.0)
    turned = [(one.yaw_deg, one.pitch_deg, one.roll_deg) for one in (found, scene.mount)]
    assert turned[0] == pytest.approx(turned[1], abs=0.3)


# --- The camera's pose on the head, from a stationary board


def neck_views(scene: BoardScene, angles: Sequence[Angles3], noise_px: float) -> list[NeckView]:
    """Return what a detector would find, without pictures."""
    rng = np.random.default_rng(0)
    views = []
    for truly in angles:
        seen = seen_board(scene.seen_pose(truly), BOARD_LENS, noise_px, rng)
        views.append(NeckView(*KINEMATICS.head_pose(truly), seen))
    return views


def test_a_place_that_is_not_sure_is_refused():
    camera = CameraParams(position_mm=(20.0, -30.0, 45.0))
    planned = neck_angles(RANGES, BOARD_LENS, 640, 400)
    small = [(0.3 * y, 0.3 * p, 0.3 * r) for y, p, r in planned]
    with pytest.raises(CameraCalibrationRefused, match="sure to .* mm and .* deg only"):
        camera_on_head(
            neck_views(BoardScene(camera, BOARD, KINEMATICS), small, 0.6), BOARD_LENS, 640
        )


def test_angles_planned_stay_inside_the_neck_and_turn_about_all_axes():
    tight = ((-0.1, 0.3), (-0.05, 0.5), (0.0, 0.0))
    for ranges in (RANGES, tight):
        angles = neck_angles(ranges, BOARD_LENS, 640, 400)
        assert len(set(angles)) == len(angles) and angles[0] == (0.0, 0.0, 0.0)
        for axis, (low, high) in enumerate(ranges):
            assert all(low <= a[axis] <= high for a in angles)
