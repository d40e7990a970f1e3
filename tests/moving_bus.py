"""Four moving smart servos in this process, and the faults that all such buses live through."""

from typing import Any

from gazerig.drivers.types import ServoBus
from gazerig.testing.bus_bench import rows

IDS = (1, 2, 3, 4)
NAMES = ("eye", "jaw", "neck", "lid")
LONGEST_S = 0.1
"""No read takes longer, but the one that opens a port again or sets a servo up again."""


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


def live_through_harmless(rig, fault):
    rig.command(fault)
    assert [rig.heard() for _ in range(20)] == [[True] * 4] * 20
    assert rig.longest_s < LONGEST_S


def live_through_duplicates(rig):
    rig.command("duplicate all")
    for _ in range(30):
        assert rig.heard() == [True] * 4


def live_through_everybody_late(rig, late_ms):
    for times in (1, 3, 12):
        rig.command(f"delay all {late_ms} count {times}")
        for _ in range(10):
            rig.tick()
        rig.until_all()
    assert rig.longest_s < 0.3


def live_through_answers_out_of_order(rig):
    rig.command("reorder count 1")
    rig.tick()
    assert rig.heard() == [True] * 4


def live_through_missing_ids(rig, policy, missing):
    rig.command(f"set after-missing {policy}")
    for servo_id in missing:
        rig.command(f"lose {servo_id}")
    expected = [servo_id not in missing for servo_id in IDS]
    assert [rig.heard() for _ in range(50)] == [expected] * 50
    assert rig.longest_s < LONGEST_S
    lines = rig.bus.events()
    assert all(f"{NAMES[i - 1]} (servo {i}) does not answer" in lines for i in missing)
    rig.command("clear")
    assert rig.until_all() <= 60
    assert any("answers again after" in line for line in rig.bus.events())
