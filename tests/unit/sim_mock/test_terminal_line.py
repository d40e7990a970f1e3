"""One device on a pseudo-terminal, on a clock that is set by hand."""

import os
import select

import pytest

from gazerig.sim_mock.devices import FeetechLine
from gazerig.sim_mock.pty.line import BusSettings, TerminalLine
from gazerig.sim_mock.smart_servo.physics import ServoSpec

PING, PONG = bytes.fromhex("FFFF010201FB"), bytes.fromhex("FFFF010200FC")
STS = FeetechLine((ServoSpec(1, "sts3215"),))


class Bench:
    """A line, its messages, and a client that has its terminal open."""

    def __init__(self, device=STS, **settings):
        self.now_s = 5.0
        self.line = TerminalLine(BusSettings(device, **settings), self.clock)
        self.fd = os.open(self.line.terminal.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)

    def clock(self):
        self.now_s += 1e-7  # else the last moment before an answer is due would never pass
        return self.now_s

    def send(self, data):
        os.write(self.fd, data)
        self.serve()

    def serve(self):
        ready, _, _ = select.select(self.line.watched_files(), (), (), 0.0)
        self.line.serve(ready)

    def heard(self):
        try:
            return os.read(self.fd, 4096)
        except BlockingIOError:
            return b""

    def close(self):
        os.close(self.fd)
        self.line.close()


@pytest.fixture
def bench():
    made = []

    def make(*args, **settings):
        made.append(Bench(*args, **settings))
        return made[-1]

    yield make
    for one in made:
        one.close()


def test_a_torn_packet_is_waited_for(bench):
    """A scheduler may leave the host's process alone half-way through its packet."""
    one = bench()
    one.send(PING[:3])
    one.now_s += 0.04
    one.send(PING[3:])
    assert one.heard() == PONG
    one.send(PING[:3])
    one.now_s += 0.06
    one.send(PING[3:])
    assert one.heard() == b""


def test_a_late_answer_comes_when_it_is_due(bench):
    one = bench()
    one.line.obey("delay 1 30")
    one.send(PING)
    assert one.line.wait_s() == pytest.approx(0.03, abs=2e-4)
    one.now_s += 0.02
    one.serve()
    assert one.heard() == b""
    one.now_s += 0.01
    one.serve()
    assert one.heard() == PONG
