"""Four moving STS servos in this process on a line whose time passes as it is waited for."""

from drivers.feetech.bus import FeetechBus, FeetechParams
from drivers.types import ServoSetup
from sim_mock.ports import InProcessPort
from sim_mock.servo_physics import ServoSpec
from sim_mock.sts.chain import build_sts

IDS = (1, 2, 3, 4)
NAMES = ("eye", "jaw", "neck", "lid")
SPEED = 3000.0


class Rig:
    """A bus of emulated servos; ``tick`` runs one cycle and judges what it gives."""

    def __init__(self, specs=None, setups=None, baud=None, wire_time=False, **params):
        self.now_s = 50.0
        specs = specs or [ServoSpec(i, "sts3215", 2000) for i in IDS]
        self.chain = build_sts(specs, lambda: self.now_s, baud=baud)
        self.sent = []
        self.port = InProcessPort(
            self.chain, self.sent.append, sleep_until=self.sleep_until, wire_time=wire_time
        )
        self.setups = setups or [
            ServoSetup(i, "sts3215", 1000, 3000, SPEED, name)
            for i, name in zip(IDS, NAMES, strict=True)
        ]
        self.bus = FeetechBus(self.port, self.setups, FeetechParams(**params))
        self.k = self.longest_s = 0

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)

    def start(self):
        self.bus.open()
        self.bus.engage()
        self.bus.events()
        # So many answers it takes to know how late they are.
        for _ in range(130):
            self.tick()
        self.longest_s = 0.0
        return self

    def command(self, text):
        self.chain.faults.command(text)

    def tick(self, goals=None):
        """Run one cycle with joints in motion; every value must have been true in it."""
        self.now_s += 0.01
        self.k += 1
        before, began_s = self.chain.positions_steps(), self.now_s
        readings = self.bus.read(self.now_s)
        self.longest_s = max(self.longest_s, self.now_s - began_s)
        after = self.chain.positions_steps()
        for reading, was, is_now in zip(readings, before, after, strict=False):
            if reading is not None:
                assert min(was, is_now) - 1 <= reading.position_steps <= max(was, is_now) + 1
        self.bus.write(goals or [2000 + abs(self.k % 80 - 40) * 10] * len(readings))
        return readings

    def run(self, seconds, goals):
        for _ in range(round(seconds / 0.01)):
            readings = self.tick(goals)
        return readings

    def heard(self):
        return [reading is not None for reading in self.tick()]

    def until_all(self, most=300):
        """Run until all servos give values under torque; gives the cycles that took."""
        for k in range(most):
            if all(r is not None and r.torque for r in self.tick()):
                return k
        raise AssertionError(f"not well after {most} cycles: {self.bus.faults()}")

    def get(self, servo_id, address, size=1):
        """Look into a servo, apart from driver and line."""
        return int.from_bytes(self.chain.here(servo_id).read(address, size), "little")
