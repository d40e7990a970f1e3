"""The emulated PCA9685: rules of NXP's data sheet, smbus2's messages, Adafruit's library."""

import errno

import pytest
from pca9685_world import SMBus
from smbus2 import i2c_msg

from gazerig.sim_mock.pca9685.bridge import build_bridge
from gazerig.sim_mock.pca9685.chip import AI, LED0, MODE1, PRESCALE, SLEEP

ADDRESS = 0x40
MIDDLE = (0, 0, 307 & 0xFF, 307 >> 8)
"""1.5 ms of 20 ms, in 4096ths."""


class Bench:
    def __init__(self, oscillator_hz=25e6):
        self.now_s = 1.0
        self.bridge = build_bridge((ADDRESS, 0x41), lambda: self.now_s, oscillator_hz)
        self.bus = SMBus(self.bridge)

    def set(self, register, *values):
        self.bus.i2c_rdwr(i2c_msg.write(ADDRESS, (register, *values)))

    def get(self, register, length=1, address=ADDRESS):
        read = i2c_msg.read(address, length)
        self.bus.i2c_rdwr(i2c_msg.write(address, (register,)), read)
        return list(bytes(read))

    def wait(self, seconds):
        self.now_s += seconds

    def wake(self):
        self.set(MODE1, SLEEP | AI)
        self.set(PRESCALE, 121)
        self.set(MODE1, AI)

    def pulse_us(self, channel=0):
        return self.bridge.pulse_steps(channel) / 4


@pytest.fixture
def bench():
    return Bench()


def test_the_prescaler_is_written_asleep_only_and_not_below_3(bench):
    bench.set(PRESCALE, 1)
    assert bench.get(PRESCALE) == [3]
    bench.wake()
    bench.set(PRESCALE, 30)
    assert bench.get(PRESCALE) == [121]


@pytest.mark.parametrize("mhz", [25.0, 26.5])
def test_a_pulse_is_what_the_counts_and_the_oscillator_make_of_it(mhz):
    bench = Bench(mhz * 1e6)
    bench.set(LED0, *MIDDLE)
    assert bench.pulse_us() == 0
    bench.wake()
    bench.set(LED0, *MIDDLE)
    assert bench.pulse_us() == pytest.approx(307 * 122 / mhz, abs=0.2)


def test_auto_increment_runs_through_the_channels(bench):
    bench.wake()
    bench.set(LED0, *MIDDLE, *MIDDLE)
    assert bench.get(LED0, 9) == [*MIDDLE, *MIDDLE, 0]
    bench.set(MODE1, 0)
    assert bench.get(LED0 + 2, 3) == [51, 51, 51]


def test_boards_have_their_own_registers_and_strangers_are_not_there(bench):
    bench.wake()
    assert bench.get(MODE1, address=0x41) == [0x11]
    with pytest.raises(OSError) as caught:
        bench.get(MODE1, address=0x42)
    assert caught.value.errno == errno.EREMOTEIO
    with pytest.raises(ValueError, match="different addresses"):
        build_bridge((0x40, 0x40), lambda: 0.0)
