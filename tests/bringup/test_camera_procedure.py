"""Calibrating a camera step by step, with a simulated board, head and clock."""

from dataclasses import replace
from math import radians

import numpy as np
import pytest
from camera_bench import BOARD, KINEMATICS, RANGES

from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError
from gazerig.features.bringup.calibration.camera_calibration import (
    CameraCalibrationRefused,
    LensCalibrationParams,
)
from gazerig.features.bringup.calibration.camera_procedure import (
    LensSteps,
    NeckStepParams,
    neck_angles,
    neck_steps,
)
from gazerig.features.bringup.calibration.charuco_views import ViewParams
from gazerig.features.bringup.calibration.hand_eye import camera_on_head
from gazerig.gaze.types import Angles3
from gazerig.robot.model.clock import SimulatedClock
from gazerig.robot.model.frames import CameraParams
from gazerig.sim_mock.cameras.charuco_scene import BoardScene

CAMERA = CameraParams()
FEW = NeckStepParams(frames=2, timeout_s=1.0)


class MovedNeck:
    """A head that is at once where it is told to go."""

    def __init__(self, scene: BoardScene, clock: SimulatedClock) -> None:
        self.scene, self.clock = scene, clock
        self.went: list[Angles3] = []

    def turn(self, head_rad: Angles3) -> None:
        self.went.append(head_rad)
        self.scene.head_rad = head_rad
        self.rest(1.0)

    def rest(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now_s() + seconds)

    def angles(self) -> Angles3:
        return self.scene.head_rad


@pytest.fixture
def scene() -> BoardScene:
    return BoardScene(CAMERA, BOARD, KINEMATICS, np.random.default_rng(0))


@pytest.fixture
def neck(scene: BoardScene) -> MovedNeck:
    scene.hang()
    return MovedNeck(scene, SimulatedClock())


def test_somebody_who_shows_the_board_from_all_sides_gets_the_lens(scene: BoardScene) -> None:
    steps = LensSteps(BOARD, radians(CAMERA.horizontal_field_deg))
    shown = []
    for k in range(40):
        shown.append(steps.take(scene.look(k / 30)))
        if shown[-1].coverage.enough:
            break
    assert shown[0].kept and shown[0].coverage.views == 1 and shown[0].coverage.missing
    assert shown[-1].coverage.enough and len(shown) < 25
    lens = steps.result()
    assert lens.intrinsics.fx_px == pytest.approx(scene.lens.fx_px, rel=0.01)
    assert lens.params().width_px == 640


def test_pictures_without_a_new_view_say_why(scene: BoardScene) -> None:
    steps = LensSteps(BOARD, radians(69.0))
    shot = scene.look(0.0)
    assert steps.take(shot).kept
    again = steps.take(shot)
    assert not again.kept and again.why == "too much like a view before"
    empty = steps.take(Shot(0.1, 2, np.zeros((400, 640, 3), np.uint8)))
    assert (empty.kept, empty.corners, empty.why) == (False, 0, "no board seen")
    with pytest.raises(CameraCalibrationRefused, match="show 11 more views"):
        steps.result()


def test_more_views_are_asked_for_until_the_lens_is_sure(scene: BoardScene) -> None:
    strict = LensCalibrationParams(
        most_focal_error_percent=0.01, views=ViewParams(least_views=4, most_views=14)
    )
    steps = LensSteps(BOARD, radians(CAMERA.horizontal_field_deg), strict)
    assert steps.try_result()[0] is None
    for k in range(14):
        assert steps.take(scene.look(k / 30)).kept
        if k == 12:
            lens, why = steps.try_result()
            assert lens is None and "show more views" in why
    with pytest.raises(CameraCalibrationRefused, match="sure to"):
        steps.try_result()


def test_no_picture_at_all_is_no_lens() -> None:
    with pytest.raises(CameraCalibrationRefused, match="0 views"):
        LensSteps(BOARD, radians(69.0)).result()


def test_a_camera_that_changes_its_size_is_refused(scene: BoardScene) -> None:
    steps = LensSteps(BOARD, radians(69.0))
    steps.take(scene.look(0.0))
    with pytest.raises(CameraError, match="from 640 x 400 to 320 x 200"):
        steps.take(Shot(0.1, 2, np.zeros((200, 320, 3), np.uint8)))


def test_a_head_that_looks_around_finds_its_camera(scene: BoardScene, neck: MovedNeck) -> None:
    angles = neck_angles(RANGES, scene.lens, 640, 400)[:12]
    now_s = neck.clock.now_s
    steps = list(
        neck_steps(neck, lambda: scene.look(now_s()), now_s, BOARD, KINEMATICS, angles, FEW)
    )
    assert [step.number for step in steps] == list(range(1, 13))
    views = [step.view for step in steps if step.view is not None]
    assert len(views) == 12 and neck.went == [*angles, (0.0, 0.0, 0.0)]
    found = camera_on_head(views, scene.lens, 640).camera_params(replace(CAMERA))
    assert found.position_mm == pytest.approx(scene.mount.position_mm, abs=3.0)
    assert found.yaw_deg == pytest.approx(scene.mount.yaw_deg, abs=0.3)
    assert found.pitch_deg == pytest.approx(scene.mount.pitch_deg, abs=0.3)
    assert found.roll_deg == pytest.approx(scene.mount.roll_deg, abs=0.3)


def test_pictures_from_before_the_head_stood_still_do_not_count(
    scene: BoardScene, neck: MovedNeck
) -> None:
    now_s = neck.clock.now_s
    old = scene.look(0.0)
    (step,) = neck_steps(neck, lambda: old, now_s, BOARD, KINEMATICS, [(0.1, 0.0, 0.0)], FEW)
    assert step.view is None and step.why == "no new frame came"
    (step,) = neck_steps(neck, lambda: None, now_s, BOARD, KINEMATICS, [(0.1, 0.0, 0.0)], FEW)
    assert step.view is None and step.why == "no new frame came"


def test_a_head_that_trembles_is_not_believed(scene: BoardScene, neck: MovedNeck) -> None:
    now_s = neck.clock.now_s

    def look() -> Shot:
        yaw, pitch, roll = scene.head_rad
        scene.head_rad = (yaw + radians(0.5), pitch, roll)
        return scene.look(now_s())

    short = replace(FEW, timeout_s=0.3)
    (step,) = neck_steps(neck, look, now_s, BOARD, KINEMATICS, [(0.0, 0.0, 0.0)], short)
    assert step.view is None and step.why == "the head does not hold still"


def test_a_board_out_of_sight_is_said(scene: BoardScene, neck: MovedNeck) -> None:
    now_s = neck.clock.now_s
    quick = NeckStepParams(frames=1, timeout_s=0.3)
    (step,) = neck_steps(
        neck, lambda: scene.look(now_s()), now_s, BOARD, KINEMATICS, [(1.2, 0.0, 0.0)], quick
    )
    assert step.view is None and step.corners == 0 and step.why == "no board seen"
