"""Noise on the line of smart servos, to and fro: damaged bytes are never data."""

import pytest
from bus_kinds import BOARDS, SMART, in_process

PERCENT = {0.5: 1.0, 3.0: 1.0, 10.0: 4.0}
"""Shares of the bytes that are hit, and for how long."""
DAMAGED = 3_000
"""Bytes hit in a test."""


@pytest.mark.parametrize("name", SMART)
def test_damaged_bytes_make_no_wrong_value(name):
    """``tick`` compares every value with the true servo; the noise has the seed of the device."""
    bench = in_process(name)
    bus = bench.hold()
    bench.ticks(bus, 0.3)
    hit, fresh = 0.0, 0
    while hit < DAMAGED:
        for percent, seconds in PERCENT.items():
            before = bus.health()
            bench.command(f"static {percent}")
            fresh += sum(4 - len(f.missing) for f in bench.ticks(bus, seconds))
            bench.command("clear")
            after = bus.health()
            sent = after.tx_bytes + after.rx_bytes - before.tx_bytes - before.rx_bytes
            hit += sent * percent / 100.0
            bench.recovered(bus)
    bench.ticks(bus, 1.0)
    assert fresh > 0.2 * DAMAGED and bus.faults() == ()
    assert bus.health().errors["corrupt"] > 0.02 * DAMAGED


@pytest.mark.parametrize("name", BOARDS)
def test_noise_on_the_line_of_a_board_leads_no_joint_out_for_long_and_passes_or_is_named(name):
    """Its bytes have no check: a pulse made by noise lasts until the next goals."""
    bench = in_process(name)
    bus, kind = bench.hold(), bench.kind
    bench.ticks(bus, 0.3)
    bench.command("static 0.5")
    outside = 0
    for _ in range(500):
        bench.tick(bus, follows=False)
        outside += any(not kind.low - 30 <= at <= kind.high + 30 for at in bench.places())
    assert outside <= 10
    bench.command("clear")
    for _ in range(500):
        feedback = bench.tick(bus, follows=False)
    if not all(feedback.torque):  # a person has to look at such a line
        assert all(has_label(bus.faults(), setup.name) for setup in bench.setups)
        bench.brown_out()  # who switches it off and on
        bus.disable_torque()
        bus.enable_torque()
    bench.go(bus, [0.5] * 4)


def has_label(lines, name):
    return any(f"{name} (channel" in line for line in lines)
