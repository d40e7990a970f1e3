"""Patience and journal: the driver's small parts."""

from dataclasses import replace
from math import inf

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.event_log import MOST, EventLog
from gazerig.drivers.servo_bus.transaction import Transactions

LATE = bytes.fromhex("FFFFFD000107005500060426655D")


class Line:
    """A port whose answers come after ``late_s`` and their time on the wire."""

    port_name = "line"

    def __init__(self):
        self.time_s, self.late_s, self.due_s = 0.0, 0.0, 0.0

    def now_s(self):
        return self.time_s

    def write(self, request):
        self.due_s = self.time_s + (len(request) + 6) * 1e-5 + self.late_s

    def read_until(self, length, deadline_s):
        """Return an answer when it is due; a late one is an answer to a ping."""
        if self.due_s > deadline_s:
            self.time_s = max(self.time_s, deadline_s)
            return b""
        is_late, self.time_s, self.due_s = length > 6, max(self.time_s, self.due_s), inf
        return LATE if is_late else b"x" * length


@given(st.lists(st.floats(0.0, 0.1), max_size=300), st.floats(0.0, 0.0198))
def test_patience_is_twice_the_worst_delay_within_its_bounds(delays, late_s):
    port = Line()
    family = replace(DYNAMIXEL, prompt_timeout_s=0.001)
    line = Transactions(port, family, 1_000_000)  # type: ignore[arg-type]
    assert line.timeout_s == 0.02
    for port.late_s in delays:
        line.exchange(b"ask", 6)
        assert 0.001 <= line.timeout_s <= 0.02
    port.late_s = late_s
    for _ in range(20):
        if not line.exchange(b"ask", 6)[0]:
            line.drain()
    assert line.exchange(b"ask", 6)[0]
    for _ in range(1000):
        line.exchange(b"ask", 6)
    assert line.timeout_s == pytest.approx(min(0.02, max(0.001, 2.0 * late_s)), abs=1e-6)


def test_a_line_that_never_falls_silent_is_drained_for_a_while():
    port = Line()

    def babble(length, deadline_s):
        port.time_s += 0.001
        return b"x"

    port.read_until = babble  # type: ignore[method-assign]
    Transactions(port, DYNAMIXEL).drain()  # type: ignore[arg-type]
    assert port.time_s == pytest.approx(0.06)


def test_the_journal_forgets_what_nobody_takes():
    journal = EventLog()
    for k in range(MOST + 5):
        journal.add(str(k))
    lines = journal.drain()
    assert (len(lines), lines[-1]) == (MOST, str(MOST + 4))
    assert journal.drain() == ()
