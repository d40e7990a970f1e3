"""Which nodes are asked of a camera, and with what; the nodes themselves are stood in for."""

from types import SimpleNamespace
from unittest.mock import MagicMock

import pytest
from oak_packets import face_archive

from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.pipeline import device_nodes, imu_queue
from gazerig.drivers.camera.oak.sdk import load_depthai


class Pipeline:
    """Makes a stand-in for each node, and keeps them by name."""

    def __init__(self, dai, platform="RVC4") -> None:
        self.made: dict[str, list[MagicMock]] = {}
        device = SimpleNamespace(getPlatform=lambda: getattr(dai.Platform, platform))
        self.getDefaultDevice = lambda: device

    def create(self, node):
        made = MagicMock()
        made.build.return_value = made
        self.made.setdefault(node.__name__, []).append(made)
        return made


@pytest.fixture(scope="module")
def dai():
    return load_depthai()


def asked(dai, platform="RVC4", **wanted):
    """Return the outputs and the nodes made for them."""
    pipeline = Pipeline(dai, platform)
    return device_nodes(dai, pipeline, OakParams(**wanted)), pipeline.made


def test_colour_is_straightened_unless_it_is_not_wanted(dai):
    for undistort in (True, False):
        _, made = asked(dai, depth=False, undistort=undistort, rate_hz=20.0)
        request = made["Camera"][0].requestOutput
        assert request.call_args.args == ((640, 400),)
        assert request.call_args.kwargs["enableUndistortion"] is undistort
        assert request.call_args.kwargs["fps"] == 20.0


def test_exposure_and_focus_are_set_before_the_start(dai):
    _, made = asked(dai, depth=False, exposure_limit_ms=5.0, focus=120)
    control = made["Camera"][0].initialControl
    control.setAutoExposureLimit.assert_called_once_with(5000)
    control.setManualFocus.assert_called_once_with(120)
    control.setAntiBandingMode.assert_not_called()


def test_gyro_is_asked_for_in_small_batches(dai):
    outputs, made = asked(dai, depth=False)
    (imu,) = made["IMU"]
    imu.enableIMUSensor.assert_called_once_with(dai.IMUSensor.GYROSCOPE_RAW, 200)
    imu.setBatchReportThreshold.assert_called_once_with(2)
    assert imu_queue(outputs) is not None
    outputs, made = asked(dai, depth=False, gyro=False)
    assert "IMU" not in made and imu_queue(outputs) is None


def test_yunet_gets_the_frame_in_whole_and_is_decoded_on_the_host(dai, tmp_path):
    file = face_archive(tmp_path / "faces.tar.xz")
    outputs, made = asked(dai, depth=False, face_model=str(file))
    (network,) = made["NeuralNetwork"]
    assert network.build.call_args.kwargs["resizeMode"] == dai.ImgResizeMode.LETTERBOX
    (decoder,) = made["YunetDecoder"]
    decoder.link_args.assert_called_once_with(network.out)
    assert outputs.faces is decoder.out and outputs.face_fault() == ""
    assert "DetectionNetwork" not in made


def test_yolo_is_decoded_by_the_camera(dai, tmp_path):
    file = face_archive(tmp_path / "faces.tar.xz", parser="YOLO", points=5)
    outputs, made = asked(dai, depth=False, face_model=str(file), min_confidence=0.4)
    (network,) = made["DetectionNetwork"]
    network.setConfidenceThreshold.assert_called_once_with(0.4)
    assert outputs.faces is network.out and outputs.face_fault() == ""


@pytest.mark.parametrize("platform", ["RVC2", "RVC4"])
def test_depth_lies_on_the_colour_frame(dai, platform):
    outputs, made = asked(dai, platform)
    assert len(made["Camera"]) == 3
    (stereo,) = made["StereoDepth"]
    if platform == "RVC4":
        assert outputs.depth is made["ImageAlign"][0].outputAligned
    else:
        assert outputs.depth is stereo.depth and "ImageAlign" not in made
