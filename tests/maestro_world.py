"""An emulated Maestro on a clock of its own, and the bytes of its commands."""

from gazerig.sim_mock.maestro.board import build_board
from gazerig.sim_mock.maestro.commands import ERRORS

PROTOCOL = 1 << ERRORS.index("protocol")


def words(*numbers):
    return b"".join(bytes((n & 0x7F, n >> 7)) for n in numbers)


def target(channel, steps):
    return bytes((0x84, channel)) + words(steps)


def speed(channel, limit):
    return bytes((0x87, channel)) + words(limit)


def acceleration(channel, limit):
    return bytes((0x89, channel)) + words(limit)


class World:
    """A board and its clock."""

    def __init__(self, channels=12, **options):
        self.now_s = 0.0
        self.board = build_board(channels, lambda: self.now_s, **options)

    def ask(self, data, baud=None):
        return self.board.receive(bytes.fromhex(data) if isinstance(data, str) else data, baud)

    def after(self, seconds):
        self.now_s += seconds
        return self

    def position(self, channel=0):
        return int.from_bytes(self.ask(bytes((0x90, channel))), "little")

    def positions(self):
        return [self.position(c) for c in range(len(self.board.body.channels))]

    def errors(self):
        return int.from_bytes(self.ask("A1"), "little")

    def do(self, text):
        return self.board.faults.command(text)
