"""Wrong settings of a board of hobby servos: one line with its cure, and nothing moves."""

import json
from pathlib import Path

import pytest
from board_rig import SECTION, on_pca9685
from fakes.pty_bus import PtyBus
from typer.testing import CliRunner

from gazerig.robot.cli.main import app
from gazerig.sim_mock.devices import MaestroLine, Pca9685Line

PULSES = "hobby servos without pulses go to their parking place"


def jog(rig: str, *words: str) -> str:
    """Type a jog that must be refused; return the message, which has one line."""
    pytest.importorskip("gazerig.features.bringup")
    result = CliRunner().invoke(app, ["jog", rig, "eyes_pan", "5", "--yes", *words])
    assert result.exit_code == 2, result.output
    (line,) = [one for one in result.stderr.splitlines() if PULSES not in one]
    return line


@pytest.mark.parametrize(
    ("was", "written", "reported"),
    [
        ("kind: pca9685", "kind: pca6985", "bus.kind: no bus 'pca6985'; did you mean "
         "'pca9685'? available: dynamixel, feetech, maestro, pca9685"),
        ("0x40", "0x70", "bus.pca9685: address 0x70 is reserved: boards have 0x40 to 0x77"),
        ("kind: pca9685", "kind: maestro", "/dev/i2c-1 is an I2C bus, not a serial port: name the "
         "adaptor's port with --port or in the YAML, or set the kind of the bus to pca9685"),
        ("i2c-1", "i2c-99", "no I2C bus /dev/i2c-99: switch I2C on"),
    ],
)  # fmt: skip
def test_a_file_that_cannot_be_right(tmp_path, was, written, reported):
    assert reported in jog(on_pca9685(tmp_path, SECTION.replace(was, written)))


@pytest.mark.parametrize(
    ("device", "rig", "reported"),
    [
        (Pca9685Line(), "maker", "no Maestro answers: take the first of its two USB ports"),
        (MaestroLine(12), "pca9685", "no answer as an I2C bus (timeout): a PCA9685 is "
         "reached over an I2C bus such as /dev/i2c-1: write it under bus.port"),
    ],
)  # fmt: skip
def test_a_board_that_is_not_the_one(tmp_path, device, rig, reported):
    with PtyBus() as bus:
        path = bus.start_device(device)
        assert reported in jog(on_pca9685(tmp_path) if rig == "pca9685" else rig, "--port", path)
        assert not any(one["target"] for one in json.loads(bus.command("status"))["servos"])
        folder = Path(path).parent
    assert not folder.exists()
