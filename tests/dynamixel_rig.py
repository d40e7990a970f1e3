"""Four moving Dynamixel servos in this process on a line whose time passes as it is waited for."""

from moving_bus import IDS, NAMES, MovingBus

from gazerig.drivers.dynamixel.control_table import BAUD_RATES
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec


class Rig(MovingBus):
    """A bus of emulated servos, read by one of several methods."""

    def __init__(self, fast=True, indirect=True, check_baud=False, servo_baud=None, **params):
        super().__init__()
        specs = [ServoSpec(i, "xl330-m077", 2000) for i in IDS]
        self.chain = build_dynamixel(specs, lambda: self.now_s)
        self.chain.check_baud = check_baud
        for servo in self.chain.servos if servo_baud else ():
            servo.memory.set("baud_rate", BAUD_RATES.index(servo_baud))
        self.chain.refresh()
        self.port = InProcessPort(self.chain, self.sent.append, sleep_until=self.sleep_until)
        setups = [
            ServoConfig(i, "xl330-m077", 1000, 3000, 6000.0, name)
            for i, name in zip(IDS, NAMES, strict=True)
        ]
        chosen = DynamixelParams(fast_sync_read=fast, indirect_block=indirect, **params)
        self.bus = SmartServoBus(DYNAMIXEL, self.port, setups, chosen)

    def errors(self):
        return self.bus.health().errors


WAYS = {"fast indirect": (True, True), "plain direct": (False, False)}
