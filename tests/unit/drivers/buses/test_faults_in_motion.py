"""Faults of line, board and servos in motion: rules of every tick, and how each ends."""

import pytest
from bus_kinds import FEETECH, KINDS, Struck, faults_of, in_process

DYNAMIXEL = ("dynamixel", "old dynamixel")
LEFT = {"overload {i}": DYNAMIXEL, "collide {i}": (*DYNAMIXEL, *FEETECH)}
"""Only a person can help after these."""


@pytest.mark.parametrize(
    ("name", "fault"), [(name, fault) for name in KINDS for fault in faults_of(name)]
)
def test_whatever_befalls_a_bus_ends_well(name, fault):
    struck = Struck(in_process(name), 1)
    came_back = struck.strike((fault,), 0.6)
    assert came_back == (name not in LEFT.get(fault, ())), struck.bus.faults()
    # Where all answers come late each question of a recovery waits.
    assert struck.longest_s < (0.5 if fault in ("delay all 15", "static 2") else 0.1)
    struck.bus.disable_torque()
    assert not any(struck.bench.holding())
