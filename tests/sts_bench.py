"""An emulated STS bus on a clock that is set by hand, and packets made apart from it."""

from gazerig.sim_mock.feetech.chain import build_feetech

PING, READ, WRITE, REG_WRITE, ACTION, RESTORE, REBOOT = 1, 2, 3, 4, 5, 6, 8
RESET_TURNS, CALIBRATE, SYNC_READ, SYNC_WRITE = 10, 11, 0x82, 0x83
ALL = 0xFE


def instruction(servo_id, code, *params):
    """Build an instruction; parameters are bytes or numbers."""
    given = b"".join(p if isinstance(p, bytes) else bytes((p,)) for p in params)
    body = bytes((servo_id, len(given) + 2, code)) + given
    return b"\xff\xff" + body + bytes((255 - sum(body) % 256,))


def packets(data):
    """Take statuses apart: (id, error, parameters) each; every byte must belong to one."""
    out = []
    while data:
        assert data[:2] == b"\xff\xff"
        end = 4 + data[3]
        assert sum(data[2:end]) % 256 == 255
        out.append((data[2], data[4], data[5 : end - 1]))
        data = data[end:]
    return out


def plain(raw, bit):
    """Read sign and magnitude."""
    return -(raw - (1 << bit)) if raw >= 1 << bit else raw


class Bench:
    """A chain and its clock."""

    def __init__(self, *specs, **options):
        self.now_s = 0.0
        self.chain = build_feetech(specs or [(1, "sts3215", 2048.0)], lambda: self.now_s, **options)

    def ask(self, servo_id, code, *params, baud=None):
        """Send an instruction; gives the statuses."""
        return packets(self.chain.receive(instruction(servo_id, code, *params), baud))

    def write(self, servo_id, address, value, size=1):
        """Write a register; gives the error byte."""
        [(answered, error, data)] = self.ask(
            servo_id, WRITE, address, value.to_bytes(size, "little")
        )
        assert (answered, data) == (servo_id, b"")
        return error

    def read(self, servo_id, address, size=1, sign=None):
        """Read a register."""
        [(answered, _, data)] = self.ask(servo_id, READ, address, size)
        assert (answered, len(data)) == (servo_id, size)
        raw = int.from_bytes(data, "little")
        return raw if sign is None else plain(raw, sign)

    def position(self, servo_id=1):
        return self.read(servo_id, 56, 2, 15)

    def error(self, servo_id=1):
        """Return the error byte of a ping."""
        [(_, error, _)] = self.ask(servo_id, PING)
        return error

    def wait(self, seconds, steps=1):
        """Let time pass, in so many looks."""
        begin = self.now_s
        for k in range(1, steps + 1):
            self.now_s = begin + seconds * k / steps
            self.chain.positions_steps()

    def engage(self, servo_id=1, goal=None):
        """Switch the torque on with a goal, the present place where None."""
        self.write(servo_id, 42, self.position(servo_id) if goal is None else goal, 2)
        self.write(servo_id, 40, 1)
