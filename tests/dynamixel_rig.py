"""Four moving Dynamixel servos in this process on a line whose time passes as it is waited for."""

from moving_bus import IDS, NAMES, MovingBus

from gazerig.drivers.dynamixel.control_table import BAUD_RATES
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec


class Rig(MovingBus):
    """A bus of emulated servos, read by one of several methods."""

    def __init__(self, firmwares=(53, 53), servo_baud=None, baud=1_000_000):
        super().__init__()
        first, *others = IDS
        old, new = firmwares
        specs = [ServoSpec(first, "xl330-m077", 2000, old)]
        specs += [ServoSpec(i, "xl330-m077", 2000, new) for i in others]
        self.chain = build_dynamixel(specs, lambda: self.now_s)
        self.chain.check_baud = servo_baud is not None
        for servo in self.chain.servos if servo_baud else ():
            servo.memory.set("baud_rate", BAUD_RATES.index(servo_baud))
        self.chain.refresh()
        self.port = InProcessPort(self.chain, self.sent.append, sleep_until=self.sleep_until)
        setups = [
            ServoConfig(i, "xl330-m077", 1000, 3000, 6000.0, name)
            for i, name in zip(IDS, NAMES, strict=True)
        ]
        self.bus = SmartServoBus(DYNAMIXEL, self.port, setups, baud)

    def errors(self):
        return self.bus.health().errors


WAYS = {"fast indirect": (53, 53), "plain direct": (45, 53)}
"""Firmware of the first servo and of the others; only both together decide how they are read."""
