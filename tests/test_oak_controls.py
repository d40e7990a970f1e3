"""Exposure, flicker and focus from the rig's file to the camera, and what is refused."""

from pathlib import Path

import pytest

from gazerig.config.load import ConfigError
from gazerig.config.schema import load_rig
from gazerig.drivers.camera.oak.controls import set_controls
from gazerig.drivers.camera.oak.params import OakParams
from gazerig.drivers.camera.oak.sdk import load_depthai

RIG = (Path(__file__).parents[1] / "config/rigs/maker.yaml").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def dai():
    return load_depthai()


def commands(dai, **wanted):
    """Return the text of what is sent to a camera; untouched commands are not in it."""
    control = dai.CameraControl()
    set_controls(dai, control, OakParams(**wanted))
    return control


def test_nothing_is_sent_where_nothing_is_asked(dai):
    assert str(commands(dai).getData()) == str(dai.CameraControl().getData())
    assert commands(dai).aeMaxExposureTimeUs == dai.CameraControl().aeMaxExposureTimeUs


def test_exposure_limit_flicker_and_focus_are_sent(dai):
    control = commands(dai, exposure_limit_ms=8.5, anti_flicker="60hz", focus=130)
    assert control.aeMaxExposureTimeUs == 8500
    assert control.antiBandingMode == dai.CameraControl.AntiBandingMode.MAINS_60_HZ
    assert control.getLensPosition() == 130


@pytest.mark.parametrize("name", ["off", "50hz", "60hz", "auto"])
def test_every_way_against_flicker_is_one_of_depthais(dai, name):
    members = dai.CameraControl.AntiBandingMode.__members__
    chosen = commands(dai, anti_flicker=name).antiBandingMode
    assert chosen in members.values() and name[:2].upper() in chosen.name


@pytest.mark.parametrize(
    ("keys", "told"),
    [
        ("exposure_limit_ms: 20\n  rate_hz: 60", "longer than a frame lasts"),
        ("exposure_limit_ms: 0", "0.1"),
        ("focus: 256", "255"),
        ("focus: near", "focus"),
        ("anti_flicker: 55hz", "50hz"),
        ("width_px: 650", "width_px is a multiple of 16"),
        ("height_px: 401", "height_px of 2"),
        ("imu_rotation_deg: [0, 0, 181]", "180"),
        ("imu_rotation_deg: [0, 0]", "imu_rotation_deg"),
    ],
)
def test_keys_are_checked(tmp_path, keys, told):
    file = tmp_path / "rig.yaml"
    file.write_text(RIG + f"\noak:\n  {keys}\n")
    with pytest.raises(ConfigError) as caught:
        load_rig(str(file))
    assert told in str(caught.value)


def test_keys_reach_the_parameters(tmp_path):
    file = tmp_path / "rig.yaml"
    keys = (
        "exposure_limit_ms: 10\n  focus: 0\n  anti_flicker: 'off'\n  imu_rotation_deg: [0, 0, 90]"
    )
    file.write_text(RIG + f"\noak:\n  {keys}\n  undistort: false\n  gyro: false\n")
    oak = load_rig(str(file)).oak
    assert (oak.exposure_limit_ms, oak.focus, oak.anti_flicker) == (10.0, 0, "off")
    assert (oak.imu_rotation_deg, oak.undistort, oak.gyro) == ((0.0, 0.0, 90.0), False, False)
