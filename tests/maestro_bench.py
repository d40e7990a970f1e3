"""Hobby servos on an emulated Maestro with our driver."""

from typing import Any

from gazerig.drivers.maestro.board import MaestroBus, MaestroParams
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import build_board
from gazerig.testing.bus_bench import rows

CENTRE = 6000
SPEED = 12_000.0
LOW, HIGH = 4400, 7600

SETUPS = (
    ServoConfig(0, "hobby", LOW, HIGH, SPEED, "eyes", rest_steps=6100),
    ServoConfig(1, "hobby", LOW, HIGH, SPEED, "lid"),
    ServoConfig(5, "hobby", LOW, HIGH, SPEED, "brow", rest_steps=9000),
)

IDS = tuple(setup.id for setup in SETUPS)
TICK_S = 0.01


class Bench:
    """A board, a port to it, and a bus; time passes where somebody waits."""

    def __init__(self, setups=SETUPS, channels=12, chosen=(), **params):
        self.now_s = 0.0
        self.sent: list[Any] = []
        self.board = build_board(channels, lambda: self.now_s, crc=params.get("crc", False))
        for case, value in chosen:
            self.board.choose(case, value)
        self.port = InProcessPort(self.board, self.sent.append, "emulated board", self._sleep_until)
        self.bus = MaestroBus(self.port, setups, MaestroParams(**{"channels": channels, **params}))

    def _sleep_until(self, at_s):
        self.now_s = max(self.now_s, at_s)

    def raw(self, text):
        """Speak to the board past the driver."""
        replies = self.board.exchange(bytes.fromhex(text))
        return b"".join(piece.data for reply in replies for piece in reply.pieces)

    def pulses(self, ids=IDS):
        return [int.from_bytes(self.raw(f"90 {channel:02X}"), "little") for channel in ids]

    def order(self, *goals):
        """Send channels past the driver."""
        for channel, goal in zip(IDS, goals, strict=True):
            self.raw(f"84 {channel:02X} {goal & 127:02X} {goal >> 7:02X}")

    def run(self, seconds, goals=None):
        """Tick every 10 ms; give all readings."""
        seen = []
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            seen.append(rows(self.bus.read(self.now_s)))
            if goals is not None:
                self.bus.write(goals)
        return seen

    def packets(self):
        """Return what was sent since the last call."""
        sent, self.sent[:] = list(self.sent), []
        return sent


def places(readings):
    return [None if r is None else r.position_steps for r in readings]
