"""Exchanges on one I2C bus: bounded waits, every transfer confirmed, counts.

I2C has no checksums: an answer that causes an action is read twice.

All servo ports carry bytes, and these bytes carry I2C in the format of NXP's SC18IM700: to a bridge
on a serial line, to an emulated one on a pseudo-terminal, and to gazerig.drivers.i2c.port, which
executes them on the kernel's buses. A transfer is S, the address with its direction bit, a count,
for a write that number of bytes, and P. R, a register and P read a register of the bridge; register
0A contains the result of the last transfer. Source: NXP, SC18IM700 data sheet, rev. 2 (10 August
2007).
"""

from collections.abc import Sequence

from gazerig.drivers.bus.timing import TIMING
from gazerig.drivers.serial.plain_line import PlainLine
from gazerig.drivers.serial.port import BusPort

START, STOP, READ_REGISTER = ord("S"), ord("P"), ord("R")
STATUS_REGISTER = 0x0A
READ_STATUS = bytes((READ_REGISTER, STATUS_REGISTER, STOP))
OK, NO_ACKNOWLEDGE, TIMED_OUT = 0xF0, 0xF1, 0xF8
NOT_ACKNOWLEDGED, BUS_STUCK = "not acknowledged", "bus stuck"
FAILURES = {
    **dict.fromkeys((NO_ACKNOWLEDGE, 0xF2, 0xF3), NOT_ACKNOWLEDGED),
    TIMED_OUT: BUS_STUCK,
}
"""Status byte -> error."""


def write(address: int, register: int, data: bytes) -> bytes:
    """Build a write of some registers."""
    return bytes((START, address << 1, len(data) + 1, register)) + data + bytes((STOP,))


def read(address: int, register: int, length: int) -> bytes:
    """Build a read of some registers."""
    return bytes((START, address << 1, 1, register, START, address << 1 | 1, length, STOP))


class I2cLine(PlainLine):
    """A port with an I2C bus; every method may raise BusLost.

    failure: error of the last exchange, "" for none
    """

    def __init__(
        self, port: BusPort, baud: int, reply_timeout_s: float = TIMING.reply_timeout_s
    ) -> None:
        super().__init__(port, baud, reply_timeout_s)
        self.failure = ""

    def ask(self, transfers: Sequence[tuple[bytes, int]]) -> list[bytes] | None:
        """Send transfers and return the bytes that each of them reads; None if one failed.

        Args:
            transfers: Transfers, each with the number of bytes that it reads.
        """
        packet = b"".join([transfer + READ_STATUS for transfer, _ in transfers])
        wanted = sum(length + 1 for _, length in transfers)
        answer = self.exchange(packet, wanted)
        found, statuses, at = list[bytes](), list[int](), 0
        for _, length in transfers if len(answer) == wanted else ():
            found.append(answer[at : at + length])
            statuses.append(answer[at + length])
            at += length + 1
        # A failed transfer returns only its status.
        failures = [FAILURES[one] for one in statuses or answer if one in FAILURES]
        self.failure = ""
        if failures:
            self.failure = failures[0]
            self.errors[self.failure] += 1
            self._is_late, self._owed_bytes = False, 0
        elif len(answer) < wanted:
            self.failure = "incomplete" if answer else "timeout"
            self.record_missing(answer)
        elif any(one != OK for one in statuses):
            self.failure = "damaged"
            self.record_damage()
        return None if self.failure else found

    def write_confirmed(self, *packets: bytes) -> bool:
        """Send transfers that only write; return whether all were acknowledged."""
        return self.ask([(packet, 0) for packet in packets]) is not None
