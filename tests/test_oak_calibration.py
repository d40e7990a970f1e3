"""The lens of an OAK camera: its distortion from memory, and gazerig calibrate camera --oak."""

import threading
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest
from command_line import invoked
from oak_packets import DISTORTION, calibrated
from oak_stand_in import Group, Message, Rig, real

from gazerig.config.schema import load_rig
from gazerig.drivers.camera.oak.calibration import raw_distortion
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.source import OakSource
from gazerig.drivers.camera.pinhole import Intrinsics
from gazerig.drivers.errors import CameraError
from gazerig.robot.model.intrinsics import project


def test_e98_five_numbers_place_points_as_the_fourteen_of_the_factory_do():
    stored = calibrated(real())
    K = np.array(stored.getCameraIntrinsics(real().CameraBoardSocket.CAM_A, 640, 400))
    plain = Intrinsics(K[0, 0], K[1, 1], K[0, 2], K[1, 2])
    bent = replace(plain, distortion=raw_distortion(real(), stored, OakParams(undistort=False)))
    rng = np.random.default_rng(0)
    points = np.column_stack(
        (rng.uniform(-0.5, 0.5, 200), rng.uniform(-0.3, 0.3, 200), np.ones(200))
    )
    true = cv2.projectPoints(points, np.zeros(3), np.zeros(3), K, np.array(DISTORTION))[0][:, 0]
    assert np.hypot(*(project(points, bent) - true).T).max() < 0.4
    assert np.hypot(*(project(points, plain) - true).T).max() > 2.0


def test_a_memory_without_a_lens_is_told():
    with pytest.raises(CameraError, match=r"does not contain its lens.*undistort: true"):
        raw_distortion(real(), calibrated(real(), colour=False), OakParams(undistort=False))


def test_a_fisheye_is_refused_where_frames_are_not_straightened():
    stored, dai = calibrated(real()), real()
    stored.setCameraType(dai.CameraBoardSocket.CAM_A, dai.CameraModel.Fisheye)
    stored.setDistortionCoefficients(
        dai.CameraBoardSocket.CAM_A, [0.9, -2.0, 3.0, 5.0] + [0.0] * 10
    )
    wide = [[900.0, 0.0, 1915.0], [0.0, 900.0, 1072.0], [0.0, 0.0, 1.0]]
    stored.setCameraIntrinsics(dai.CameraBoardSocket.CAM_A, wide, 3840, 2160)
    with pytest.raises(CameraError, match=r"set oak\.undistort: true"):
        raw_distortion(dai, stored, OakParams(undistort=False))


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


@pytest.fixture
def rig_file(tmp_path) -> Path:
    pytest.importorskip("gazerig.features.bringup")
    path = tmp_path / "rig.yaml"
    text = (Path(__file__).parents[1] / "config/rigs/desk.yaml").read_text(encoding="utf-8")
    path.write_text(text, encoding="utf-8")
    return path


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
    assert "the camera's own lens: focal length 560.0, 561.0 px" in done.err
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
        (("--oak", "--mock"), "simulates a webcam: leave --oak away"),
    ],
)
def test_what_cannot_be_is_said(rig_file, words, says):
    before = rig_file.read_bytes()
    done = invoked("calibrate", "camera", str(rig_file), *words)
    assert done.code == 2 and says in done.err, done.err
    assert rig_file.read_bytes() == before
