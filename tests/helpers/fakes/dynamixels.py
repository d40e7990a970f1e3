"""Three Dynamixel servos in this process, with a wire that can be spoilt."""

from typing import Any

from feedback_rows import rows

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.errors import BusLost
from gazerig.drivers.serial.port import BusTiming
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

IDS = (1, 2, 3)


class SpoiltPort(InProcessPort):
    """A port whose wire can be spoilt: ``spoil(instruction, answer)`` gives what arrives."""

    spoil: Any = None
    gone = False

    def write(self, data):
        if self.gone:
            raise BusLost(f"{self.port_name} is gone")
        before = len(self._waiting)
        super().write(data)
        if self.spoil is not None:
            answer = self.spoil(data[7], self._waiting[before:])
            self._waiting = self._waiting[:before] + answer


class Rig:
    """Three servos, a driver that is not yet open, and a clock set by hand."""

    def __init__(
        self, fast=True, starts=(2001, 2002, 2003), model="xl330-m077", direct=False, **timing
    ):
        self.now_s = 100.0
        self.sent: list[Any] = []
        # The first servo's firmware decides about fast reads.
        first = 53 if fast and not direct else 46 if fast else 45
        versions = (first, 53, 53) if direct else (first,) * 3
        specs = [ServoSpec(*one) for one in zip(IDS, (model,) * 3, starts, versions, strict=True)]
        self.chain = build_dynamixel(specs, lambda: self.now_s)
        self.port = SpoiltPort(self.chain, self.sent.append)
        setups = [ServoConfig(i, model, 1000, 3000, 6000.0) for i in IDS]
        self.bus = SmartServoBus(DYNAMIXEL, self.port, setups, timing=BusTiming(**timing))

    def open(self):
        self.bus.open()
        return self

    def tick(self, goals=None, dt_s=0.005):
        self.now_s += dt_s
        readings = rows(self.bus.read(self.now_s))
        if goals is not None:
            self.bus.write(goals)
        return readings

    def places(self):
        return [None if r is None else r.position_steps for r in self.tick()]

    def errors(self):
        return self.bus.health().errors
