"""Where the camera sits on the head, found from a board that hangs still."""

from collections.abc import Sequence
from dataclasses import replace
from math import radians
from typing import Any

import numpy as np
import pytest
from camera_bench import BOARD, KINEMATICS, RANGES, seen_board

from gazerig.features.bringup.calibration.camera_calibration import CameraCalibrationRefused
from gazerig.features.bringup.calibration.camera_procedure import neck_angles
from gazerig.features.bringup.calibration.hand_eye import (
    HandEye,
    HandEyeParams,
    NeckView,
    camera_on_head,
    turns_deg,
)
from gazerig.gaze.types import Angles3
from gazerig.robot.model.frames import CameraParams
from gazerig.sim_mock.cameras.charuco_scene import BoardScene


def scene_of(seed: int) -> BoardScene:
    camera = CameraParams(position_mm=(20.0, -30.0, 45.0))
    return BoardScene(camera, BOARD, KINEMATICS, np.random.default_rng(seed))


def planned(scene: BoardScene) -> tuple[Angles3, ...]:
    return neck_angles(RANGES, scene.lens, 640, 400)


def some_views(
    scene: BoardScene,
    noise_px: float = 0.3,
    joint_deg: float = 0.0,
    angles: Sequence[Angles3] = (),
    seed: int = 0,
) -> list[NeckView]:
    """Return what a detector would find, without pictures."""
    rng = np.random.default_rng(seed)
    views = []
    for truly in angles or planned(scene):
        seen = seen_board(*scene.seen_pose(truly), scene.lens, noise_px, rng)
        yaw, pitch, roll = (np.array(truly) + rng.normal(0.0, radians(joint_deg), 3)).tolist()
        views.append(NeckView(*KINEMATICS.head_pose((yaw, pitch, roll)), seen))
    return views


def found_in(scene: BoardScene, views: list[NeckView], **params: Any) -> HandEye:
    return camera_on_head(views, scene.lens, 640, HandEyeParams(**params))


def off(found: HandEye, true: CameraParams) -> tuple[float, float]:
    """Return by how many millimetres and degrees it is off."""
    at = found.camera_params(true)
    mm = float(np.linalg.norm(np.array(at.position_mm) - true.position_mm))
    angles = (at.yaw_deg - true.yaw_deg, at.pitch_deg - true.pitch_deg, at.roll_deg - true.roll_deg)
    return mm, max(map(abs, angles))


@pytest.mark.parametrize("seed", range(2))
def test_mount_from_pictures_is_within_3_mm_and_0_3_deg(seed: int) -> None:
    scene = scene_of(seed)
    scene.hang()
    rng = np.random.default_rng(100 + seed)
    views = []
    for angles in planned(scene):
        scene.head_rad = angles
        seen = BOARD.find(scene.look(0.0).image)
        assert seen is not None
        # 0.3 px on top of what the drawn pictures' own noise and blur do.
        noisy = seen.corners_px + rng.normal(0.0, 0.3, seen.corners_px.shape)
        views.append(NeckView(*KINEMATICS.head_pose(angles), seen._replace(corners_px=noisy)))
    found = found_in(scene, views)
    mm, deg = off(found, scene.mount)
    assert mm < 3.0 and deg < 0.3
    assert found.rms_px < 0.6 and found.dropped == ()
    assert np.linalg.norm(np.array(found.p_world_board_m) - scene.p_world_board_m) < 0.01


@pytest.mark.parametrize("seed", range(5))
def test_mount_from_corners_is_within_3_mm_and_0_3_deg(seed: int) -> None:
    scene = scene_of(0)
    found = found_in(scene, some_views(scene, 0.3, seed=seed))
    mm, deg = off(found, scene.mount)
    assert mm < 3.0 and deg < 0.3
    assert mm < 4.0 * np.linalg.norm(found.position_std_mm) + 0.2


@pytest.mark.parametrize("seed", range(3))
def test_joints_that_are_a_little_off_cost_little(seed: int) -> None:
    scene = scene_of(0)
    found = found_in(scene, some_views(scene, 0.3, 0.08, seed=seed))
    mm, deg = off(found, scene.mount)
    assert mm < 5.0 and deg < 0.6
    # Taken at their word the joints explain the corners badly; a tenth of a degree does it.
    assert found.rms_px > 2.0 * found.corner_px
    assert found.joint_error_deg == pytest.approx(0.08, abs=0.04)


def test_a_lens_that_is_a_little_off_is_noticed_by_a_head_that_turns() -> None:
    scene = scene_of(0)
    true = scene.lens
    wrong = replace(true, fx_px=true.fx_px * 1.005, fy_px=true.fy_px * 1.005)
    loose = HandEyeParams(lens_error_percent=1.0)
    stiff = HandEyeParams(lens_error_percent=0.001, centre_error_px=0.001)
    views = some_views(scene, 0.1)
    found = camera_on_head(views, wrong, 640, loose)
    trusting = camera_on_head(views, wrong, 640, stiff)
    assert found.lens.fx_px == pytest.approx(true.fx_px, rel=0.002)
    assert found.lens.distortion == true.distortion
    assert off(found, scene.mount)[0] < 3.0 < off(trusting, scene.mount)[0]


def test_perfect_sights_give_the_exact_place() -> None:
    scene = scene_of(0)
    found = found_in(scene, some_views(scene, 0.0))
    assert off(found, scene.mount) == pytest.approx((0.0, 0.0), abs=0.05)


def test_same_views_same_place() -> None:
    scene = scene_of(0)
    one, two = (found_in(scene, some_views(scene)).camera_params(scene.mount) for _ in range(2))
    assert one == two


def test_it_is_written_down_rounded_and_on_the_head() -> None:
    scene = scene_of(0)
    at = found_in(scene, some_views(scene)).camera_params(
        replace(scene.mount, horizontal_field_deg=70.0)
    )
    assert at.mount == "head" and at.horizontal_field_deg == 70.0
    assert at.position_mm == tuple(round(mm, 1) for mm in at.position_mm)


def test_a_view_during_which_the_board_was_knocked_is_dropped() -> None:
    scene = scene_of(0)
    views = some_views(scene)
    seen = views[3].seen
    views[3] = views[3]._replace(seen=seen._replace(corners_px=seen.corners_px + (25.0, 8.0)))
    found = found_in(scene, views)
    assert found.dropped == (3,)
    mm, deg = off(found, scene.mount)
    assert mm < 3.0 and deg < 0.3


def test_too_few_views_are_refused() -> None:
    scene = scene_of(0)
    with pytest.raises(CameraCalibrationRefused, match="from 5 neck angles, wanted are 8"):
        found_in(scene, some_views(scene)[:5])


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_turns_about_one_axis_are_refused(axis: int) -> None:
    scene = scene_of(0)
    angles = [
        tuple(a if k == axis else 0.0 for k in range(3)) for a in np.linspace(-0.25, 0.25, 12)
    ]
    with pytest.raises(CameraCalibrationRefused, match="about one axis and only by 0.0 deg"):
        found_in(scene, some_views(scene, angles=angles))  # type: ignore[arg-type]


def test_a_board_that_swings_is_refused() -> None:
    scene = scene_of(0)
    views = some_views(scene)
    rng = np.random.default_rng(5)
    swung = [
        v._replace(seen=v.seen._replace(corners_px=v.seen.corners_px + rng.normal(0.0, 12.0, 2)))
        for v in views
    ]
    with pytest.raises(CameraCalibrationRefused, match=r"error \d+\.\d+ px.*board hangs still"):
        found_in(scene, swung)


def test_a_place_that_is_not_sure_is_refused() -> None:
    scene = scene_of(0)
    small = [(0.3 * y, 0.45 * p, 0.3 * r) for y, p, r in planned(scene)]
    views = some_views(scene, 1.0, angles=small)
    with pytest.raises(CameraCalibrationRefused, match="sure to .* mm and .* deg only"):
        found_in(scene, views, least_turn_deg=1.0, most_position_std_mm=0.5)


def test_turns_are_told_apart_by_axis() -> None:
    yaws = [KINEMATICS.head_pose((a, 0.0, 0.0))[0] for a in (-0.2, 0.0, 0.2)]
    main, second = turns_deg(yaws)
    assert main > 10.0 and second == pytest.approx(0.0, abs=1e-3)
    nods = [KINEMATICS.head_pose((0.0, a, 0.0))[0] for a in (-0.2, 0.2)]
    assert turns_deg(yaws + nods)[1] > 5.0
    assert turns_deg(yaws[:1]) == (0.0, 0.0)


def test_angles_planned_stay_inside_the_neck_and_turn_about_all_axes() -> None:
    scene = scene_of(0)
    tight = ((-0.1, 0.3), (-0.05, 0.5), (0.0, 0.0))
    for ranges in (RANGES, tight):
        angles = neck_angles(ranges, scene.lens, 640, 400)
        assert len(set(angles)) == len(angles) and angles[0] == (0.0, 0.0, 0.0)
        for axis, (low, high) in enumerate(ranges):
            assert all(low <= a[axis] <= high for a in angles)
    _, second = turns_deg([KINEMATICS.head_pose(a)[0] for a in planned(scene)])
    assert second > HandEyeParams().least_turn_deg
