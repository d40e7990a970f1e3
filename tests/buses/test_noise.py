"""Noise on the line of smart servos, to and fro: damaged bytes are never data."""

import pytest
from bus_kinds import SMART, in_process

PERCENT = (0.5, 3.0, 10.0)
DAMAGED = 10_000
"""Bytes hit in a test; tests/attack/soak.py hits millions."""


@pytest.mark.parametrize("name", SMART)
def test_ten_thousand_damaged_bytes_make_no_wrong_value(name):
    """``tick`` compares every value with the true servo; the noise has the seed of the device."""
    bench = in_process(name)
    bus = bench.hold()
    bench.ticks(bus, 0.3)
    hit, fresh = 0.0, 0
    while hit < DAMAGED:
        for percent in PERCENT:
            before = bus.health()
            bench.command(f"static {percent}")
            fresh += sum(4 - len(f.missing) for f in bench.ticks(bus, 2.0))
            bench.command("clear")
            after = bus.health()
            sent = after.tx_bytes + after.rx_bytes - before.tx_bytes - before.rx_bytes
            hit += sent * percent / 100.0
            bench.recovered(bus)
    assert fresh > 0.2 * DAMAGED and bus.faults() == ()
    assert bus.health().errors["corrupt"] > 0.02 * DAMAGED
