"""Cost of one tick of six servos on a PCA9685: this driver and Adafruit's library.

Both over smbus2's methods on the emulated bus. Adafruit's library is not installed with this
project: pip install --no-deps --target DIR adafruit-circuitpython-pca9685
adafruit-circuitpython-busdevice adafruit-circuitpython-register, and DIR in PYTHONPATH.

Without it this driver is measured alone. Run: python tests/bench/bench_pca9685.py
"""

import sys
import time
from importlib.util import find_spec
from pathlib import Path
from types import SimpleNamespace

from gazerig.drivers.i2c.port import I2cPort
from gazerig.drivers.pca9685.board import Pca9685Bus, Pca9685Params
from gazerig.drivers.types import ServoConfig

sys.path.insert(0, str(Path(__file__).parents[1]))

from test_pca9685_chip import Bench, CircuitPythonI2C

TICKS, CHANNELS, I2C_HZ = 3000, 6, 100_000.0


class Counted:
    """A bus that counts transfers, bytes on its wires, addresses among them, and its own time."""

    def __init__(self, bus):
        self.bus, self.fd, self.transfers, self.bytes, self.spent_s = bus, None, 0, 0, 0.0

    def i2c_rdwr(self, *messages):
        began = time.process_time()
        self.transfers += 1
        self.bytes += sum(1 + message.len for message in messages)
        self.bus.i2c_rdwr(*messages)
        self.spent_s += time.process_time() - began

    def close(self):
        """Stay open."""


def measured(name, bus, bench, tick):
    bus.transfers = bus.bytes = 0
    bus.spent_s = spent_s = 0.0
    for k in range(TICKS):
        began = time.process_time()
        tick(5900 + k % 200)
        spent_s += time.process_time() - began
        bench.wait(0.01)
    wire_ms = bus.bytes / TICKS * 9.0 / I2C_HZ * 1e3
    own_us = (spent_s - bus.spent_s) / TICKS * 1e6
    print(
        f"{name:42} {bus.transfers / TICKS:5.1f} transfers {bus.bytes / TICKS:5.1f} bytes "
        f"{wire_ms:4.1f} ms at 100 kHz {own_us:6.1f} us of processor"
    )


def ours():
    bench = Bench()
    bus = Counted(bench.bus)
    setups = [ServoConfig(i, "hobby", 4400, 7600, 1e5, rest_steps=6000) for i in range(CHANNELS)]
    made = Pca9685Bus(
        I2cPort("/dev/i2c-1", open_bus=lambda path: bus), setups, Pca9685Params(stagger_ms=0.0)
    )
    made.open()
    made.enable_torque()

    def both(steps):
        made.read(time.monotonic())
        made.write([steps] * CHANNELS)

    measured("ours: goals", bus, bench, lambda steps: made.write([steps] * CHANNELS))
    measured("ours: goals, mode, one channel read back", bus, bench, both)


def adafruits():
    names = dict.fromkeys(("I2C", "ReadableBuffer", "WriteableBuffer", "I2CDeviceDriver"), object)
    for module in ("busio", "circuitpython_typing", "circuitpython_typing.device_drivers"):
        sys.modules[module] = SimpleNamespace(**names)  # type: ignore[assignment]
    import adafruit_pca9685

    bench = Bench()
    bus = Counted(bench.bus)
    board = adafruit_pca9685.PCA9685(CircuitPythonI2C(bus), address=0x40)
    board.frequency = 50

    def goals(steps):
        for k in range(CHANNELS):
            board.channels[k].duty_cycle = round(steps / 4 / 20_000 * 0xFFFF)

    def both(steps):
        board.mode1_reg, board.pwm_regs[0]
        goals(steps)

    measured("Adafruit's: goals", bus, bench, goals)
    measured("Adafruit's: goals, mode, one channel read", bus, bench, both)


if __name__ == "__main__":
    ours()
    if find_spec("adafruit_pca9685") is None:
        print("Adafruit's library is not installed: this driver was measured alone")
    else:
        adafruits()
