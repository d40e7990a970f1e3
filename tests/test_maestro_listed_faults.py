"""Every fault of the line and the board: bounded reads, no stale value, recovery, no jump."""

import pytest
from numpy.random import default_rng

from gazerig.drivers.maestro.board import MaestroBus, MaestroParams
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board
from gazerig.testing.bus_bench import rows

SPEED = 12_000.0
LOW, HIGH = 4400, 7600
SETUPS = tuple(ServoConfig(i, "hobby", LOW, HIGH, SPEED, rest_steps=6000) for i in (0, 1, 2, 7))
TICK_S = 0.01
TIMEOUT_S = 0.02

FAULTS = (
    "lose all count 1",
    "lose all for 0.5",
    "lose 2 for 0.5",
    "delay all 5 for 0.5",
    "delay all 30 count 2",
    "delay all 60 for 0.4",
    "truncate all 1 count 3",
    "duplicate all count 3",
    "corrupt all count 5",
    "drop all 0 count 3",
    "stall all 30 count 2",
    "noise before random count 5",
    "noise after FF01 count 5",
    "echo for 0.3",
    "babble for 0.3",
    "unplug for 0.4",
    "block for 0.3",
    "lose-writes 5",
    "lose-bytes 7",
    "error protocol",
    "error overrun",
    "error timeout",
    "brown-out",
)


class Bench:
    def __init__(self, seed=1):
        self.now_s = 0.0
        self.board = build_board(12, lambda: self.now_s, seed=seed)
        self.port = InProcessPort(self.board, None, "board", self._sleep_until, wire_time=True)
        self.bus = MaestroBus(self.port, SETUPS, MaestroParams(stagger_ms=0.0))
        self.bus.open()
        self.bus.enable_torque()
        self.goals = [6000.0] * len(SETUPS)
        self.slowest_s = 0.0

    def _sleep_until(self, at_s):
        self.now_s = max(self.now_s, at_s)

    def pulses(self):
        channels = self.board.faults.reports()
        return [channels[setup.id]["position"] for setup in SETUPS]

    def tick(self, desired):
        """Read and write once, as a loop does: goals go on from where servos are held."""
        slot_s = self.now_s = self.now_s + TICK_S
        readings = rows(self.bus.read(slot_s))
        self.slowest_s = max(self.slowest_s, self.now_s - slot_s)
        for i, reading in enumerate(readings):
            if reading is not None and reading.rearmed:
                self.goals[i] = float(reading.position_steps)
            if reading is not None:
                step = desired[i] - self.goals[i]
                self.goals[i] += max(-60.0, min(60.0, step))
        self.bus.write([round(goal) for goal in self.goals])
        return readings


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_on_the_way(fault):
    bench = Bench()
    desired = [5000.0, 7000.0, 6400.0, 5600.0]
    shafts = bench.board.positions_steps()
    for n in range(450):
        if n == 60:
            print(bench.board.faults.command(fault))
        if n == 110:
            desired = desired[::-1]
        readings = bench.tick(desired)
        for setup, goal, pulse, reading in zip(
            SETUPS, bench.goals, bench.pulses(), readings, strict=True
        ):
            assert pulse == 0 or LOW <= pulse <= HIGH
            # A reading is a recent goal of the servo, or no reading.
            if reading is not None and reading.torque and n > 60:
                assert abs(reading.position_steps - goal) < 700, (n, setup.id)
        now = bench.board.positions_steps()
        moved = max(abs(now[s.id] - shafts[s.id]) for s in SETUPS)
        # No jump: nothing moves faster than planned but for a moment of catching up.
        assert n < 2 or moved <= 600, n
        shafts = now
    assert bench.pulses() == [round(place) for place in desired]
    assert [r.position_steps for r in readings] == bench.pulses()
    # One lost answer, and what else a look at all channels costs on the wire.
    assert bench.slowest_s < 2.0 * TIMEOUT_S + 0.01 or fault.startswith("block")


@pytest.mark.parametrize("seed", range(4))
def test_many_faults_in_a_row(seed):
    dice, bench = default_rng(seed), Bench(seed)
    desired = [6000.0] * len(SETUPS)
    for n in range(1500):
        if n % 75 == 20:
            bench.board.faults.command(FAULTS[int(dice.integers(len(FAULTS)))])
        if n % 40 == 0:
            desired = [float(goal) for goal in dice.integers(LOW, HIGH, len(SETUPS))]
        for reading in bench.tick(desired):
            assert reading is None or LOW <= reading.position_steps <= HIGH
        assert all(pulse == 0 or LOW <= pulse <= HIGH for pulse in bench.pulses())
    bench.board.faults.command("clear")
    for _ in range(300):
        readings = bench.tick(desired)
    for reading, pulse in zip(readings, bench.pulses(), strict=True):
        assert reading is not None and reading.torque is (pulse > 0)
        assert reading.position_steps == pulse or "again and again" in reading.fault
    # An adapter that takes nothing gives up after 0.25 s.
    assert bench.slowest_s < 0.25 + 2.0 * TIMEOUT_S
