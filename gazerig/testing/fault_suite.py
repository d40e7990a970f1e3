"""Test suite for faults of a bus while a head moves on it.

Each fault lasts 0.6 s in a running loop of bus and guard. Every tick checks the true servos:
goals inside the limits, positions inside the range, speeds below the maximum. After the fault
all joints move as before, or some stay limp or still, each named with its cause.
"""

import random
from collections.abc import Sequence

import pytest

from gazerig.config.schema import load_rig
from gazerig.testing.fault_machine import LINE, RESTARTS, Case, Machine, pair_of

STRUCK_S = 0.6


class FaultSuite:
    """Faults of line and servos, one at a time and three at a time.

    rig_file: a rig whose servos are all on the bus; rate_hz: rate of its loop
    cases: the faults; left: names of the faults after which a servo does not recover
    longest_s: longest permitted read
    """

    rig_file = ""
    rate_hz = 100.0
    cases: Sequence[Case] = (*LINE, *RESTARTS)
    left: frozenset[str] = frozenset()
    longest_s = 0.1

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Create a test for every case."""
        if "case" in metafunc.fixturenames:
            metafunc.parametrize("case", self.cases, ids=[case.name for case in self.cases])

    @pytest.fixture
    def machine(self) -> Machine:
        """Return the rig's joints, in motion."""
        machine = Machine(load_rig(self.rig_file), self.rate_hz)
        machine.start()
        return machine

    def test_whatever_befalls_a_bus_ends_well(self, machine, case):
        outcome = machine.apply_fault(*pair_of(machine.rig, machine.rig.bus.kind), case, STRUCK_S)
        assert outcome.survived, outcome
        assert (outcome.end == "left, named") == (case.name in self.left), outcome
        # A write to an adapter that accepts no bytes times out after 0.25 s.
        assert outcome.longest_s < (0.3 if "block" in case.name else self.longest_s)
        machine.body.stop()
        assert all(machine.true_goal(i) is None for i in range(len(machine.names)))

    def test_many_at_once_and_nothing_leaves_its_limits(self, machine):
        """Three random faults at a time; afterwards the remaining joints must recover."""
        dice = random.Random(machine.rig.bus.kind)
        gentle = [case for case in self.cases if case.name not in self.left]
        # Servos that catch up by themselves have no other limit.
        machine.own_speed = True
        for _ in range(6):
            three = dice.sample(gentle, 3)
            both = Case(
                tuple(text for case in three for text in case.begins),
                tuple(text for case in three for text in case.ends),
                own_speed=True,
            )
            outcome = machine.apply_fault(*pair_of(machine.rig, machine.rig.bus.kind), both)
            assert outcome.survived, (both.name, outcome)
