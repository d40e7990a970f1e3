"""Hobby servos on emulated PCA9685 boards with our driver."""

from typing import Any

from feedback_rows import rows

from gazerig.drivers.bus.timing import BusTiming
from gazerig.drivers.pca9685.board import Pca9685Bus, Pca9685Params
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.pca9685.bridge import build_bridge

SPEED_STEPS_S = 4000.0
GRAIN = 20
BOARD = Pca9685Params()
QUICK = BusTiming(stagger_s=0.0)


def setup(servo_id, **changes):
    made = ServoConfig(servo_id, "hobby", 4400, 7600, SPEED_STEPS_S, f"joint {servo_id}")
    return made._replace(rest_steps=6000, **changes)


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
        self.bus = Pca9685Bus(self.port, self.setups, params, timing)

    def _sleep_until(self, t_s):
        self.now[0] = max(self.now[0], t_s)

    def held(self):
        self.bus.open()
        self.bus.enable_torque()
        self.bus.events()
        return self

    def run(self, seconds, goals=None, period_s=0.01):
        for _ in range(round(seconds / period_s)):
            readings = rows(self.bus.read(self.now[0]))
            if goals is not None:
                self.bus.write(goals)
            self.now[0] += period_s
        return readings

    def chip(self, address=0x40):
        return self.device.body.chips[address]

    def widths(self):
        return [self.device.body.width_steps(s.id, self.now[0]) for s in self.setups]

    def places(self):
        positions = self.device.positions_steps()
        return [positions[s.id] for s in self.setups]

    def command(self, text):
        return self.device.faults.command(text)
