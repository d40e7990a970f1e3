"""PCA9685 boards on the I2C bus of the kernel, and one rig on either board."""

import errno
from dataclasses import replace

import pytest
from pca9685_world import GRAIN, QUICK, World

from gazerig.drivers.errors import BusLost, PortError
from gazerig.drivers.i2c import port as i2c_port
from gazerig.drivers.i2c.port import I2cPort
from gazerig.drivers.pca9685.board import Pca9685Bus
from gazerig.drivers.serial.list_ports import check_owner, open_failure_text
from gazerig.drivers.serial.port import BlockingPort, port_at_path
from gazerig.sim_mock.pca9685.smbus import EmulatedSMBus


@pytest.fixture
def world():
    return World()


# --- the kernel's bus


class Kernel:
    """A bus of the kernel: opened by its path, and the kernel's errors."""

    def __init__(self, world):
        self.bus, self.refuses = EmulatedSMBus(world.device.body), None

    def open(self, path):
        if self.refuses is not None:
            raise OSError(self.refuses, "refused")
        self.bus.gone = False
        return self.bus


@pytest.fixture
def kernel(world, monkeypatch):
    made = Kernel(world)
    port = I2cPort("/dev/i2c-7", open_bus=made.open)
    clock = type("Clock", (), {"monotonic": lambda: world.now[0], "sleep": lambda seconds: None})
    monkeypatch.setattr(i2c_port, "time", clock)
    made.servos = Pca9685Bus(port, world.setups, replace(QUICK, give_up_s=2.0))  # type: ignore[attr-defined]
    return made


def ticks(world, bus, seconds, goals=None):
    world.bus = bus
    return world.run(seconds, goals)


def test_the_kernels_bus_is_driven_as_a_bridge_is(world, kernel):
    bus = kernel.servos
    bus.open()
    # Its oscillator's start is waited for by the clock of this world.
    world.now[0] += 0.01
    bus.enable_torque()
    world.now[0] += 0.01
    ticks(world, bus, 0.6, [5000, 6500, 7000])
    assert world.widths() == pytest.approx([5000, 6500, 7000], abs=GRAIN / 2)
    assert bus.health().errors == {}
    bus.disable_torque()
    assert world.widths() == [0, 0, 0]
    bus.close()


def test_an_adapter_that_goes_comes_back_and_holds(world, kernel):
    bus = kernel.servos
    bus.open()
    bus.enable_torque()
    ticks(world, bus, 0.3, [6500] * 3)
    kernel.bus.gone, kernel.refuses = True, errno.ENOENT
    assert ticks(world, bus, 0.3, [6500] * 3) == (None,) * 3
    kernel.refuses = None
    readings = ticks(world, bus, 1.0, [6500] * 3)
    assert all(r is not None and r.torque for r in readings)
    reported = " ".join(bus.events())
    assert "port lost: /dev/i2c-7 is gone" in reported and "port back after" in reported
    kernel.bus.gone, kernel.refuses = True, errno.ENOENT
    with pytest.raises(BusLost, match="has been gone for 2"):
        ticks(world, bus, 3.0)


@pytest.mark.parametrize(
    ("code", "reported"),
    [
        (errno.ENOENT, "no I2C bus /dev/i2c-7: switch I2C on"),
        (errno.EACCES, "'sudo usermod -aG i2c [$]USER'"),
        (errno.EBUSY, "is busy: close the other program"),
        (errno.ENOTTY, "is not an I2C bus"),
    ],
)
def test_a_bus_that_cannot_be_opened_is_named_with_its_cure(kernel, code, reported):
    kernel.refuses = code
    with pytest.raises(PortError, match=reported) as caught:
        kernel.servos.open()
    assert "\n" not in str(caught.value)


def test_a_path_says_what_kind_of_port_it_is(tmp_path):
    assert isinstance(port_at_path("/dev/i2c-1"), I2cPort)
    assert isinstance(port_at_path("/dev/ttyUSB0"), BlockingPort)
    link = tmp_path / "servos"
    link.symlink_to("/dev/i2c-3")
    assert isinstance(port_at_path(str(link)), I2cPort)
    assert "no I2C bus" in open_failure_text("/dev/i2c-99", errno.ENOENT)


def test_a_maestros_yaml_on_an_i2c_bus_is_refused():
    for kind in ("maestro", "dynamixel"):
        with pytest.raises(PortError, match="is an I2C bus, not a serial port.*pca9685"):
            check_owner("/dev/i2c-1", kind, ())
    check_owner("/dev/i2c-1", "pca9685", ())


# --- the same head on either board
