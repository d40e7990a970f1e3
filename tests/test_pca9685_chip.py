"""The emulated PCA9685: NXP's data sheet rule by rule, smbus2's messages, Adafruit's library."""

import errno
import sys
from types import SimpleNamespace
from typing import Any, cast

import pytest
from smbus2 import i2c_msg

from gazerig.sim_mock.pca9685.body import Pca9685Body
from gazerig.sim_mock.pca9685.bridge import build_bridge
from gazerig.sim_mock.pca9685.chip import AI, MODE1, PRESCALE, RESTART, SLEEP, START_S
from gazerig.sim_mock.pca9685.smbus import EmulatedSMBus

ADDRESS = 0x40
LED0, ALL_LED = 0x06, 0xFA
AWAKE = AI
MIDDLE = (0, 0, 307 & 0xFF, 307 >> 8)
"""1.5 ms of 20 ms, in 4096ths."""


class Bench:
    def __init__(self):
        self.now = [1.0]
        self.bridge = build_bridge((ADDRESS, 0x41), lambda: self.now[0])
        self.body: Pca9685Body = self.bridge.body
        self.bus = EmulatedSMBus(self.body)

    def set(self, register, *values):
        self.bus.i2c_rdwr(i2c_msg.write(ADDRESS, (register, *values)))

    def get(self, register, length=1):
        read = i2c_msg.read(ADDRESS, length)
        self.bus.i2c_rdwr(i2c_msg.write(ADDRESS, (register,)), read)
        return list(iter(cast(Any, read)))

    def wait(self, seconds):
        self.now[0] += seconds

    def wake(self, prescale=121):
        self.set(MODE1, SLEEP | AI)
        self.set(PRESCALE, prescale)
        self.set(MODE1, AWAKE)
        self.wait(START_S)

    def pulse_us(self, channel=0):
        return self.body.width_steps(channel, self.now[0]) / 4


@pytest.fixture
def bench():
    return Bench()


def test_the_prescaler_is_written_asleep_only_and_not_below_3(bench):
    bench.set(PRESCALE, 121)
    assert bench.get(PRESCALE) == [121]
    bench.set(PRESCALE, 1)
    assert bench.get(PRESCALE) == [3]
    bench.set(PRESCALE, 121)
    bench.set(MODE1, AWAKE)
    bench.set(PRESCALE, 30)
    assert bench.get(PRESCALE) == [121]


def test_a_pulse_is_what_the_counts_and_the_oscillator_make_of_it(bench):
    bench.wake()
    bench.set(LED0, *MIDDLE)
    assert bench.pulse_us() == pytest.approx(307 * 122 / 25, abs=0.2)
    bench.bridge.choose_behaviour("oscillator-mhz", "26.5")
    assert bench.pulse_us() == pytest.approx(307 * 122 / 26.5, abs=0.2)


def test_restart_bit_holds_pulses_back_until_it_is_written_or_a_channel_is(bench):
    for go_on in (lambda: bench.set(MODE1, AWAKE | RESTART), lambda: bench.set(LED0, *MIDDLE)):
        bench.wake()
        bench.set(LED0, *MIDDLE)
        bench.set(MODE1, SLEEP | AI)
        assert bench.get(MODE1) == [RESTART | SLEEP | AI]
        bench.set(MODE1, AWAKE)
        bench.wait(0.01)
        assert (bench.get(MODE1), bench.pulse_us()) == ([RESTART | AWAKE], 0)
        go_on()
        assert bench.get(MODE1) == [AWAKE]
        assert bench.pulse_us() > 1490


def test_auto_increment_runs_through_the_channels_and_begins_again(bench):
    bench.wake()
    bench.set(LED0, *MIDDLE, *MIDDLE)
    assert bench.get(LED0, 9) == [*MIDDLE, *MIDDLE, 0]
    assert bench.get(0x45, 3) == [0x10, AWAKE, 4]
    assert bench.get(PRESCALE, 2) == [121, AWAKE]
    bench.set(MODE1, 0)
    assert bench.get(LED0 + 2, 3) == [51, 51, 51]


def test_all_channels_at_once_and_what_cannot_be_read(bench):
    bench.wake()
    bench.set(ALL_LED, *MIDDLE)
    assert all(bench.pulse_us(channel) > 1490 for channel in range(16))
    assert bench.get(ALL_LED, 4) == [0] * 4
    bench.set(ALL_LED, 0, 0, 0, 0x10)
    assert not any(bench.pulse_us(channel) for channel in range(16))


def test_boards_have_their_own_registers_and_strangers_are_not_there(bench):
    bench.wake()
    assert bench.bus.read_byte_data(0x41, MODE1) == 0x11
    with pytest.raises(OSError) as caught:
        bench.bus.read_byte_data(0x42, MODE1)
    assert caught.value.errno == errno.EREMOTEIO
    bench.body.stuck = True
    with pytest.raises(OSError) as caught:
        bench.get(MODE1)
    assert caught.value.errno == errno.ETIMEDOUT


def test_a_servo_follows_its_pulses_and_is_limp_without(bench):
    bench.wake()
    bench.set(LED0, 0, 0, 0x9A, 0x01)
    bench.wait(0.5)
    place = bench.bridge.positions_steps()[0]
    assert place == pytest.approx(0x19A * 122 / 25 * 4, abs=21)
    bench.bridge.faults.command("brown-out")
    bench.wait(0.5)
    assert bench.bridge.find_servo(0).is_unpowered
    assert bench.bridge.positions_steps()[0] == pytest.approx(place, abs=30)


class CircuitPythonI2C:
    """What Adafruit's library asks of a bus, over smbus2's methods."""

    def __init__(self, bus):
        self.bus = bus

    def try_lock(self):
        return True

    def unlock(self):
        pass

    def writeto(self, address, buffer, *, start=0, end=None):
        self.bus.i2c_rdwr(i2c_msg.write(address, bytes(buffer[start:end])))

    def readfrom_into(self, address, buffer, *, start=0, end=None):
        end = len(buffer) if end is None else end
        read = i2c_msg.read(address, end - start)
        self.bus.i2c_rdwr(read)
        buffer[start:end] = bytes(read)

    def writeto_then_readfrom(
        self, address, out, into, *, out_start=0, out_end=None, in_start=0, in_end=None
    ):
        in_end = len(into) if in_end is None else in_end
        read = i2c_msg.read(address, in_end - in_start)
        self.bus.i2c_rdwr(i2c_msg.write(address, bytes(out[out_start:out_end])), read)
        into[in_start:in_end] = bytes(read)


def test_adafruits_library_finds_a_board_that_does_as_a_real_one(bench, monkeypatch):
    # It needs only names of Blinka, for its annotations.
    names = dict.fromkeys(("I2C", "ReadableBuffer", "WriteableBuffer", "I2CDeviceDriver"), object)
    for module in ("busio", "circuitpython_typing", "circuitpython_typing.device_drivers"):
        monkeypatch.setitem(sys.modules, module, SimpleNamespace(**names))
    adafruit = pytest.importorskip(
        "adafruit_pca9685",
        reason="pip install --no-deps adafruit-circuitpython-pca9685, -busdevice and -register",
    )
    monkeypatch.setattr("time.sleep", bench.wait)
    board = adafruit.PCA9685(CircuitPythonI2C(bench.bus), address=ADDRESS)
    board.frequency = 50
    assert bench.get(PRESCALE) == [121]
    assert board.frequency == pytest.approx(50, rel=0.01)
    board.channels[3].duty_cycle = round(0.075 * 0xFFFF)
    assert bench.pulse_us(3) == pytest.approx(1500, abs=8)
    assert board.channels[3].duty_cycle == pytest.approx(0.075 * 0xFFFF, abs=16)
    board.channels[3].duty_cycle = 0
    assert bench.pulse_us(3) == 0
    board.deinit()
    assert not any(bench.pulse_us(channel) for channel in range(16))
