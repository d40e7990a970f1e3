"""Four moving smart servos in this process; a rig of each family makes the chain and the driver."""

from typing import Any

from feedback_rows import rows

from gazerig.drivers.types import ServoBus

IDS = (1, 2, 3, 4)
NAMES = ("eye", "jaw", "neck", "lid")


class MovingBus:
    """A bus of emulated servos; ``tick`` runs one cycle and judges what it gives.

    chain, bus: the servos and their driver, to be set by whoever makes them; the chain's clock
        is ``now_s``, which moves on as it is waited for
    alone: the chain holds the driver's servos and no others
    """

    alone = True
    bus: ServoBus
    chain: Any

    def __init__(self):
        self.now_s = 50.0
        self.sent: list[Any] = []
        self.k = 0
        self.longest_s = 0.0

    def sleep_until(self, t_s):
        self.now_s = max(self.now_s, t_s)

    def start(self):
        self.bus.open()
        self.bus.enable_torque()
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
        readings = rows(self.bus.read(self.now_s))
        self.longest_s = max(self.longest_s, self.now_s - began_s)
        after = self.chain.positions_steps()
        for reading, was, is_now in zip(readings, before, after, strict=self.alone):
            if reading is not None:
                assert min(was, is_now) - 1 <= reading.position_steps <= max(was, is_now) + 1
        self.bus.write(goals or [2000 + abs(self.k % 80 - 40) * 10] * len(readings))
        return readings

    def heard(self):
        return [reading is not None for reading in self.tick()]

    def until_all(self, most=300):
        """Run until all servos give values under torque; gives the cycles that took."""
        for k in range(most):
            if all(r is not None and r.torque for r in self.tick()):
                return k
        raise AssertionError(f"not well after {most} cycles: {self.bus.faults()}")
