"""Exchanges on one I2C bus: bounded waits, every transfer confirmed, counts.

I2C has no checksums: an answer that causes an action is read twice.
"""

from collections import Counter
from collections.abc import Sequence

from gazerig.drivers.bus.timing import TIMING
from gazerig.drivers.i2c.bridge import OUTCOMES, READ_STATUS
from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BITS_PER_BYTE, BusPort


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
        """Send transfers and return the bytes that each of them read; None if one failed.

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
        lengths = [length for _, length in transfers]
        wanted = sum(lengths) + len(lengths)
        wire_s = (len(packet) + wanted) * self._byte_s
        deadline_s = port.now_s() + wire_s + self._reply_timeout_s
        answer, _ = port.exchange(packet, wanted, deadline_s)
        self.tx_bytes += len(packet)
        self.rx_bytes += len(answer)
        self.failure = self._answer_error(answer, lengths)
        self._late = self.failure in ("timeout", "incomplete", "damaged")
        if self._late:
            self._owed_bytes += wanted - len(answer)
            self.lateness.record_wait(deadline_s, port.now_s())
        if self.failure:
            self.errors[self.failure] += 1
            return None
        found, at = [], 0
        for length in lengths:
            found.append(answer[at : at + length])
            at += length + 1
        return found

    @staticmethod
    def _answer_error(answer: bytes, lengths: Sequence[int]) -> str:
        """Return the error in an answer, "" for none."""
        if not answer:
            return "timeout"
        if len(answer) < sum(lengths) + len(lengths):
            # A failed transfer returns only its status.
            failed = [OUTCOMES.get(byte, "incomplete") for byte in answer]
            return next((reason for reason in failed if reason), "incomplete")
        at = -1
        for length in lengths:
            at += length + 1
            reason = OUTCOMES.get(answer[at], "damaged")
            if reason:
                return reason
        return ""

    def write_confirmed(self, *packets: bytes) -> bool:
        """Send transfers that only write; return whether all were acknowledged."""
        return self.ask([(packet, 0) for packet in packets]) is not None
