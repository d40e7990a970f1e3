"""When bytes arrive on the emulated line: the written formula, to the microsecond."""

import struct

import pytest
from fastcrc.crc16 import umts

from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.wire import ServoLine


def instruction(servo_id, code, params=b""):
    packet = b"\xff\xff\xfd\x00" + struct.pack("<BHB", servo_id, len(params) + 3, code) + params
    return packet + struct.pack("<H", umts(packet))


IDS = tuple(range(1, 10))
SENSED = struct.pack("<HH", 126, 10) + bytes(IDS)
PLAIN, FAST = instruction(0xFE, 0x82, SENSED), instruction(0xFE, 0x8A, SENSED)
GOALS = instruction(
    0xFE, 0x83, struct.pack("<HH", 116, 4) + b"".join(struct.pack("<Bi", i, 2048) for i in IDS)
)
PING = instruction(1, 1)


class Wire:
    """Nine servos on a line with wire time, and a clock that is set by hand."""

    def __init__(self, return_delay=0):
        self.now_s = 0.0
        self.chain = build_dynamixel([(i, "xl330-m077", 2048) for i in IDS], lambda: self.now_s)
        self.chain.receive(instruction(0xFE, 3, struct.pack("<HB", 9, return_delay)))
        self.chain.refresh()
        self.line = ServoLine(self.chain, wire_time=True)

    def answers(self, data, baud=1_000_000):
        """Send bytes; give (time, bytes) of all that arrives."""
        assert self.line.send(data, baud) == b""
        out = []
        while (due_s := self.line.next_due_s()) is not None:
            self.now_s = due_s
            out.append((due_s, self.line.take_arrived()))
        return out


@pytest.mark.parametrize("baud", [57_600, 4_000_000])
@pytest.mark.parametrize(
    ("request_bytes", "size"), [(PLAIN, 23 + 189), (FAST, 23 + 134)], ids=["plain", "fast"]
)
@pytest.mark.parametrize("delay", [0, 250])
def test_a_cycle_takes_what_the_formula_says(baud, request_bytes, size, delay):
    wire = Wire(delay)
    answers = wire.answers(GOALS + request_bytes, baud)
    assert sum(len(data) for _, data in answers) == size - 23
    delays = (9 if request_bytes is PLAIN else 1) * delay * 2e-6
    assert answers[-1][0] == pytest.approx((59 + size) * 10 / baud + delays, abs=1e-9)
