"""Hobby servos on emulated PCA9685 boards with our driver, and the kernel's bus to them."""

import errno
import os
from typing import Any

from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.pca9685.board import Pca9685Board, Pca9685Params
from gazerig.drivers.serial.port import BusTiming
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.pca9685.bridge import Bridge, TransferPart, build_bridge

SPEED_STEPS_S = 4000.0
GRAIN = 20
BOARD = Pca9685Params()
QUICK = BusTiming(stagger_s=0.0)
READ_FLAG = 0x0001


def setup(servo_id, **changes):
    made = ServoConfig(servo_id, "hobby", 4400, 7600, SPEED_STEPS_S, f"joint {servo_id}")
    return made._replace(**{"rest_steps": 6000, **changes})


class World:
    """Boards in this process, and a bus on them."""

    def __init__(
        self,
        ids=(0, 1, 5),
        params=BOARD,
        addresses=(0x40,),
        oscillator_hz=25e6,
        timing=QUICK,
        **more,
    ):
        self.now = [10.0]
        specs = [HobbySpec(i) for i in ids]
        self.device = build_bridge(addresses, lambda: self.now[0], oscillator_hz, 0, specs)
        self.sent: list[Any] = []
        self.port = InProcessPort(self.device, self.sent.append, "emulated", self._sleep_until)
        self.setups = [setup(i, **more) for i in ids]
        self.bus = HobbyBoardBus(Pca9685Board(self.port, params, timing), self.setups)

    def _sleep_until(self, t_s):
        self.now[0] = max(self.now[0], t_s)

    def held(self):
        self.bus.open()
        self.bus.enable_torque()
        self.bus.events()
        return self

    def run(self, seconds, goals=None, bus=None):
        """Tick every 10 ms; return the last feedback."""
        bus = bus or self.bus
        for _ in range(round(seconds / 0.01)):
            feedback = bus.read(self.now[0])
            if goals is not None:
                bus.write(goals)
            self.now[0] += 0.01
        return feedback

    def registers(self, address=0x40):
        return self.device.chips[address].registers

    def widths(self):
        return [self.device.pulse_steps(s.id) for s in self.setups]

    def places(self):
        positions = self.device.positions_steps()
        return [positions[s.id] for s in self.setups]

    def command(self, text):
        return self.device.faults.command(text)


class SMBus:
    """An open bus with the interface of smbus2; errors are those of the kernel's drivers.

    gone: whether the adapter was unplugged; stuck: whether the data line is held low
    """

    fd: int | None = None
    gone = stuck = False

    def __init__(self, device: Bridge) -> None:
        self._device = device

    def i2c_rdwr(self, *messages: Any) -> None:
        """Execute smbus2's messages as one transfer."""
        parts = [
            TransferPart(one.addr, b"", one.len)
            if one.flags & READ_FLAG
            else TransferPart(one.addr, bytes(one))
            for one in messages
        ]
        failed = errno.ENODEV if self.gone else errno.ETIMEDOUT if self.stuck else errno.EREMOTEIO
        found = None if self.gone or self.stuck else self._device.transfer(parts)
        if found is None:
            raise OSError(failed, os.strerror(failed))
        for one in messages:
            if one.flags & READ_FLAG:
                for at, byte in enumerate(found):
                    one.buf[at] = bytes((byte,))

    def close(self) -> None:
        """Close."""
