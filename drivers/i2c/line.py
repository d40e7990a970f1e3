"""Exchanges on one I2C bus: bounded waits, every transfer confirmed, counts.

I2C has no checksums: an answer that causes an action is read twice.

All servo ports carry bytes, and these bytes carry I2C in the format of NXP's SC18IM700: to a bridge
on a serial line, to an emulated one on a pseudo-terminal, and to gazerig.drivers.i2c.port, which
executes them on the kernel's buses. A transfer is S, the address with its direction bit, a count,
for a write that number of bytes, and P. R, a register and P read a register of the bridge; register
0A contains the result of the last transfer. Source: NXP, SC18IM700 data sheet, rev. 2 (10 August
2007).
"""

from collections import Counter
from collections.abc import Sequence

from gazerig.drivers.bus.timing import TIMING
from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BITS_PER_BYTE, BusPort

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


class I2cLine:
    """A port with an I2C bus; every method may raise BusLost.

    tx_bytes, rx_bytes: counts since creation
    errors: counts by kind
    lateness: counter of answers after their time-outs
    failure: error of the last exchange, "" for none
    """

    def __init__(
        self, port: BusPort, baud: int, reply_timeout_s: float = TIMING.reply_timeout_s
    ) -> None:
        self.port = port
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()
        self.lateness = HostLateness()
        self.failure = ""
        self._byte_s = BITS_PER_BYTE / baud
        self._reply_timeout_s = reply_timeout_s
        self._late = False
        self._owed_bytes = 0

    def send(self, packet: bytes) -> None:
        """Send transfers that only write, without reading their status."""
        self.port.write(packet)
        self.tx_bytes += len(packet)

    def ask(self, transfers: Sequence[tuple[bytes, int]]) -> list[bytes] | None:
        """Send transfers and return the bytes that each of them reads; None if one failed.

        Args:
            transfers: Transfers, each with the number of bytes that it reads.
        """
        port = self.port
        if self._late or self._owed_bytes:
            # Owed are whole answers; a late one of a failed transfer is its status alone.
            dropped = port.drain()
            if 0 < dropped <= self._owed_bytes:
                self.lateness.record_late_answer(port.now_s())
            if not self._late and not dropped:
                self._owed_bytes = 0
        packet = b"".join([transfer + READ_STATUS for transfer, _ in transfers])
        wanted = sum(length + 1 for _, length in transfers)
        wire_s = (len(packet) + wanted) * self._byte_s
        deadline_s = port.now_s() + wire_s + self._reply_timeout_s
        answer, _ = port.exchange(packet, wanted, deadline_s)
        self.tx_bytes += len(packet)
        self.rx_bytes += len(answer)
        found, statuses, at = list[bytes](), list[int](), 0
        if len(answer) == wanted:
            for _, length in transfers:
                found.append(answer[at : at + length])
                statuses.append(answer[at + length])
                at += length + 1
            failures = [FAILURES.get(one, "damaged") for one in statuses if one != OK]
        else:
            # A failed transfer returns only its status.
            failures = [FAILURES.get(one, "incomplete") for one in answer if one != OK]
            failures.append("incomplete" if answer else "timeout")
        self.failure = failures[0] if failures else ""
        self._late = self.failure in ("timeout", "incomplete", "damaged")
        if self._late:
            self._owed_bytes += wanted - len(answer)
            self.lateness.record_wait(deadline_s, port.now_s())
        if self.failure:
            self.errors[self.failure] += 1
            return None
        return found

    def write_confirmed(self, *packets: bytes) -> bool:
        """Send transfers that only write; return whether all were acknowledged."""
        return self.ask([(packet, 0) for packet in packets]) is not None
