"""Faults of line, board and servos in motion: rules of every tick, and how each ends."""

import pytest
from bus_kinds import KINDS, Struck, in_process

LINE = (
    "lose {i}", "lose all", "delay {i} 8", "delay all 15", "truncate {i} 5", "corrupt {i}",
    "corrupt all", "noise before", "noise after", "unplug", "lose-writes 5",
)  # fmt: skip
SERVO = ("brown-out {i}", "echo on", "static 2", "overload {i}", "collide {i}", "stick {i}")
BOARD = ("brown-out", "power off", "stick {i}")
ENDS = {"unplug": "plug", "stick {i}": "free {i}", "power off": "power on"}
LEFT = {
    "overload {i}": ("dynamixel", "old dynamixel"),
    "collide {i}": ("dynamixel", "old dynamixel", "feetech", "scs"),
}
"""Only a person can help after these."""


@pytest.mark.parametrize(
    ("name", "fault"),
    [(n, f) for n in KINDS for f in (*LINE, *(BOARD if n in ("maestro", "pca9685") else SERVO))],
)
def test_whatever_befalls_a_bus_ends_well(name, fault):
    struck = Struck(in_process(name), 1)
    came_back = struck.strike(fault, ENDS.get(fault, "clear"), 0.6)
    assert came_back == (name not in LEFT.get(fault, ())), struck.bus.faults()
    # Where all answers come late each question of a recovery waits.
    assert struck.longest_s < (0.5 if fault in ("delay all 15", "static 2") else 0.1)
    struck.bus.disable_torque()
    assert not any(struck.bench.holding())
