"""Four moving STS servos in this process on a line whose time passes as it is waited for."""

from moving_bus import IDS, NAMES, MovingBus

from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.feetech.chain import build_feetech
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.smart_servo.physics import ServoSpec

SPEED = 3000.0


class Rig(MovingBus):
    """A bus of emulated STS servos; its chain may contain others, unknown to the driver."""

    alone = False

    def __init__(self, specs=None, setups=None, baud=None, wire_time=False):
        super().__init__()
        specs = specs or [ServoSpec(i, "sts3215", 2000) for i in IDS]
        self.chain = build_feetech(specs, lambda: self.now_s, baud=baud)
        self.port = InProcessPort(
            self.chain, self.sent.append, sleep_until=self.sleep_until, wire_time=wire_time
        )
        self.setups = setups or [
            ServoConfig(i, "sts3215", 1000, 3000, SPEED, name)
            for i, name in zip(IDS, NAMES, strict=True)
        ]
        self.bus = SmartServoBus(FEETECH, self.port, self.setups)

    def run(self, seconds, goals):
        for _ in range(round(seconds / 0.01)):
            readings = self.tick(goals)
        return readings

    def get(self, servo_id, address, size=1):
        """Look into a servo, apart from driver and line."""
        return int.from_bytes(self.chain.find_servo(servo_id).read(address, size)[1], "little")
