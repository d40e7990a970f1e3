"""The calibration in an OAK camera's memory, and gazerig calibrate camera --oak."""

import threading
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import invoked
from oak_packets import DISTORTION, R_CAMERA_IMU, calibrated
from oak_stand_in import Group, Message, Rig, real

from gazerig.config.schema import load_rig
from gazerig.drivers.camera import recording_format as fmt
from gazerig.drivers.camera.oak.calibration import read_calibration
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.source import OakSource
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError
from gazerig.robot.model.intrinsics import project

pytestmark = pytest.mark.usefixtures("branched_children")


def found(wanted=None, **has):
    return read_calibration(real(), calibrated(real(), **has), wanted or OakParams())


@pytest.mark.parametrize("size", [(640, 400), (1280, 720), (1920, 1080)])
def test_lens_is_that_of_frames_of_the_size_asked_for(size):
    lens = found(OakParams(width_px=size[0], height_px=size[1])).lens
    # The sensor's 3840 x 2160, made as wide or as high, and the rest cut off on both sides.
    scale = max(size[0] / 3840.0, size[1] / 2160.0)
    cut = [(3840.0 * scale - size[0]) / 2.0, (2160.0 * scale - size[1]) / 2.0]
    assert (lens.fx_px, lens.fy_px) == pytest.approx((3080.0 * scale, 3082.0 * scale), rel=1e-5)
    middle = 1915.0 * scale - cut[0], 1072.0 * scale - cut[1]
    assert (lens.cx_px, lens.cy_px) == pytest.approx(middle, abs=0.51)


def test_frames_of_4_to_3_show_more_of_the_sensor_above_and_below():
    lens = found(OakParams(width_px=640, height_px=480)).lens
    assert (lens.fx_px, lens.fy_px) == pytest.approx((3080.0 / 6.0, 3082.0 / 6.0), rel=1e-5)
    assert (lens.cx_px, lens.cy_px) == pytest.approx((1915.0 / 6.0, 1072.0 / 6.0 + 60.0), abs=0.51)


def test_e98_straightened_frames_have_no_distortion_others_that_of_the_lens():
    straight, bent = found(), found(OakParams(undistort=False))
    assert not straight.lens.has_distortion and bent.lens.has_distortion
    assert straight.raw_distortion == bent.lens.distortion
    # The five numbers place points as the fourteen of the factory do.
    rng = np.random.default_rng(0)
    points = np.column_stack(
        (rng.uniform(-0.5, 0.5, 200), rng.uniform(-0.3, 0.3, 200), np.ones(200))
    )
    K = bent.lens.matrix
    true = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, np.array(DISTORTION))[0][:, 0]
    assert np.hypot(*(project(points, bent.lens) - true).T).max() < 0.4
    plain = Intrinsics(K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    assert np.hypot(*(project(points, plain) - true).T).max() > 2.0
    assert bent.fit_error_px < 0.1


def test_fisheye_is_refused_where_frames_are_not_straightened():
    stored, dai = calibrated(real()), real()
    stored.setCameraType(dai.CameraBoardSocket.CAM_A, dai.CameraModel.Fisheye)
    stored.setDistortionCoefficients(
        dai.CameraBoardSocket.CAM_A, [0.9, -2.0, 3.0, 5.0] + [0.0] * 10
    )
    wide = [[900.0, 0.0, 1915.0], [0.0, 900.0, 1072.0], [0.0, 0.0, 1.0]]
    stored.setCameraIntrinsics(dai.CameraBoardSocket.CAM_A, wide, 3840, 2160)
    assert not read_calibration(dai, stored, OakParams()).lens.has_distortion
    with pytest.raises(CameraError, match=r"set oak\.undistort: true"):
        read_calibration(dai, stored, OakParams(undistort=False))


def test_stereo_cameras_gyro_and_focus_are_read():
    whole = found()
    assert whole.left_camera_m == pytest.approx((-0.0375, 0.0, 0.0))
    assert whole.right_camera_m == pytest.approx((0.0375, 0.0, 0.0))
    assert whole.R_camera_imu == pytest.approx(np.array(R_CAMERA_IMU))
    assert whole.imu_rotation_deg == pytest.approx((0.0, 0.0, 90.0))
    assert whole.focus == 130 and whole.label == "OAK-D"
    poor = found(stereo=False, imu=False)
    assert (poor.left_camera_m, poor.right_camera_m, poor.imu_rotation_deg) == (None, None, None)


def test_memory_without_a_lens_is_told():
    with pytest.raises(CameraError, match=r"does not contain the lens.*printed board"):
        found(colour=False)


def test_frames_that_are_not_straightened_carry_the_distortion():
    rig = Rig()
    K = [[570.0, 0.0, 319.0], [0.0, 571.0, 199.0], [0.0, 0.0, 1.0]]
    for undistort in (True, False):
        source = rig.source(undistort=undistort)
        source.open()
        rig.queue.fed.append(Message(5.0, 100.0, K))
        shot = source.take(lambda: 100.0, threading.Event())
        assert shot is not None and shot.lens is not None
        assert shot.lens.has_distortion is not undistort
        assert shot.lens.fx_px == 570.0
        source.close()


def test_recording_keeps_the_distortion():
    lens = Intrinsics(570.0, 571.0, 319.0, 199.0, (0.1, -0.2, 0.001, -0.002, 0.3))
    shot = Shot(1.0, 1, np.zeros((4, 6, 3), np.uint8), lens=lens)
    messages = dict(fmt.encode_shot(shot, None))
    assert fmt.decode_lens(messages[fmt.LENS]) == lens


@pytest.fixture
def rig_file(tmp_path) -> Path:
    pytest.importorskip("gazerig.features.bringup")
    path = tmp_path / "rig.yaml"
    text = (Path(__file__).parents[1] / "config/rigs/desk.yaml").read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    return path


def test_file_of_a_calibration_goes_into_the_rig(rig_file, tmp_path):
    stored = tmp_path / "oak.json"
    calibrated(real()).eepromToJsonFile(str(stored))
    words = "--oak-calibration", str(stored), "--what", "lens", "--yes"
    done = invoked("calibrate", "camera", str(rig_file), *words)
    assert done.code == 0, done.err
    told = done.err + done.out
    assert "OAK-D: focal length 570.4, 570.7 px" in told and "75.0 mm apart" in told
    assert "oak.focus: 130" in told and "zeros are written" in told
    rig = load_rig(str(rig_file))
    lens = rig.camera.lens
    assert lens is not None and (lens.width_px, lens.height_px) == (640, 400)
    assert (lens.fx_px, lens.fy_px, lens.cx_px) == (570.37, 570.74, 319.07)
    assert lens.distortion == (0.0, 0.0, 0.0, 0.0, 0.0)
    assert rig.oak.imu_rotation_deg == pytest.approx((0.0, 0.0, 90.0))
    assert rig.camera.horizontal_field_deg == pytest.approx(58.59)


def test_dry_run_shows_the_differences_and_writes_nothing(rig_file, tmp_path):
    stored = tmp_path / "oak.json"
    calibrated(real()).eepromToJsonFile(str(stored))
    before = rig_file.read_bytes()
    words = "--oak-calibration", str(stored), "--what", "lens", "--dry-run"
    done = invoked("calibrate", "camera", str(rig_file), *words)
    assert done.code == 0, done.err
    row = next(line for line in done.out.splitlines() if "horizontal_field_deg" in line)
    assert "69.0" in row and "58.59" in row
    assert any("imu_rotation_deg" in line and "90" in line for line in done.out.splitlines())
    assert rig_file.read_bytes() == before


class Looping(Rig):
    """A camera that gives the same frame again and again."""

    def __init__(self, lens) -> None:
        super().__init__()
        self.count = 0

        def get(timeout):
            self.count += 1
            at = self.count / 30.0
            return Group(colour=Message(at, 0.0, lens, (640, 400)))

        self.queue.get = get  # type: ignore[method-assign]


def test_camera_that_is_there_goes_into_the_rig_with_its_frames_own_lens(rig_file, monkeypatch):
    command = pytest.importorskip("gazerig.features.bringup.cli.calibrate.camera")
    seen = [[560.0, 0.0, 321.0], [0.0, 561.0, 198.0], [0.0, 0.0, 1.0]]
    camera = Looping(seen)
    monkeypatch.setattr(command, "OakSource", stood_in(camera))
    done = invoked("calibrate", "camera", str(rig_file), "--oak", "--what", "lens", "--yes")
    assert done.code == 0, done.err
    assert "its frames come through another lens: 560.0, 561.0 px" in done.err + done.out
    lens = load_rig(str(rig_file)).camera.lens
    assert lens is not None and (lens.fx_px, lens.cy_px) == (560.0, 198.0)
    assert camera.device.closed


def stood_in(camera):
    """Return a class of sources that look through a camera that is stood in for."""

    class Source(OakSource):
        def __init__(self, params) -> None:
            whole = camera.source()
            super().__init__(params, whole._nodes, True, lambda: camera.dai)

    return Source


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--oak", "--camera", "1"), "--oak and --camera name two cameras"),
        (("--oak", "--mock"), "without a memory: leave --oak away"),
        (("--oak-calibration", "x.json"), "add --what lens"),
        (("--oak-calibration", "nope.json", "--what", "lens"), "no calibration at nope.json"),
        (("--oak-calibration", "WRONG", "--what", "lens"), "is no calibration of an OAK camera"),
        (("--oak-calibration", "EMPTY", "--what", "lens"), "does not contain the lens"),
    ],
)
def test_what_cannot_be_is_said(rig_file, tmp_path, words, says):
    wrong, empty = tmp_path / "wrong.json", tmp_path / "empty.json"
    wrong.write_text("no calibration")
    calibrated(real(), colour=False, imu=False).eepromToJsonFile(str(empty))
    files = {"WRONG": str(wrong), "EMPTY": str(empty)}
    before = rig_file.read_bytes()
    done = invoked("calibrate", "camera", str(rig_file), *(files.get(w, w) for w in words))
    assert done.code == 2 and says in done.err, done.err
    assert rig_file.read_bytes() == before
