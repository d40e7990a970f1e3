"""An emulated Maestro on a clock of its own, a port to it, and our driver."""

from typing import Any

from gazerig.drivers.hobby_board.bus import HobbyBoardBus
from gazerig.drivers.maestro.board import MaestroBoard, MaestroParams
from gazerig.drivers.serial.port import TIMING
from gazerig.drivers.types import ServoConfig
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.maestro.board import PROTOCOL as PROTOCOL_BIT
from gazerig.sim_mock.maestro.board import build_board

PROTOCOL = 1 << PROTOCOL_BIT
TICK_S = 0.01
SETUPS = (
    ServoConfig(0, "hobby", 4400, 7600, 12_000.0, "eyes", rest_steps=6100),
    ServoConfig(1, "hobby", 4400, 7600, 12_000.0, "lid"),
    ServoConfig(5, "hobby", 4400, 7600, 12_000.0, "brow", rest_steps=9000),
)
IDS = tuple(setup.id for setup in SETUPS)


def number(code, channel, value):
    return bytes((code, channel, value & 0x7F, value >> 7))


def target(channel, steps):
    return number(0x84, channel, steps)


def speed(channel, limit):
    return number(0x87, channel, limit)


def acceleration(channel, limit):
    return number(0x89, channel, limit)


class World:
    """A board, a port to it, and a bus; time passes during waits."""

    def __init__(self, channels=12, setups=SETUPS, timing=TIMING, crc=False, **options):
        self.now_s = 0.0
        self.sent: list[Any] = []
        self.board = build_board(channels, lambda: self.now_s, crc, **options)
        self.port = InProcessPort(self.board, self.sent.append, "emulated board", self._sleep_until)
        board = MaestroBoard(self.port, MaestroParams(crc, channels), timing)
        self.bus = HobbyBoardBus(board, setups)

    def _sleep_until(self, at_s):
        self.now_s = max(self.now_s, at_s)

    def after(self, seconds):
        self.now_s += seconds
        return self

    def do(self, text):
        return self.board.faults.command(text)

    # --- past the driver

    def ask(self, data):
        """Send bytes, or text in hex; return the answers."""
        data = bytes.fromhex(data) if isinstance(data, str) else data
        return b"".join(piece.data for piece in self.board.exchange(data))

    def position(self, channel=0):
        return int.from_bytes(self.ask(bytes((0x90, channel))), "little")

    def positions(self, channels=None):
        return [self.position(c) for c in channels or range(len(self.board.channels))]

    def errors(self):
        return int.from_bytes(self.ask("A1"), "little")

    # --- with the driver

    def held(self, *steps):
        """Let the board hold the servos at these pulses, and then the bus."""
        self.bus.open()
        self.ask(b"".join(map(target, IDS, steps)))
        assert self.bus.enable_torque() == steps
        self.run(0.1)
        self.bus.events()
        return self

    def run(self, seconds, goals=None):
        """Tick every 10 ms; return the feedback of all ticks."""
        seen = []
        for _ in range(round(seconds / TICK_S)):
            self.now_s += TICK_S
            seen.append(self.bus.read(self.now_s))
            if goals is not None:
                self.bus.write(goals)
        return seen

    def packets(self):
        """Return what was sent since the last call."""
        sent, self.sent[:] = list(self.sent), []
        return sent
