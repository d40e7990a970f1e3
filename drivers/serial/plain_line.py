"""Exchanges with a device whose answers have neither address nor checksum.

Waits are bounded. A late answer looks like any other, so after a missing one the line is drained
before the next request.
"""

from collections import Counter

from gazerig.drivers.process.host_lateness import HostLateness
from gazerig.drivers.serial.port import BITS_PER_BYTE, BusPort


class PlainLine:
    """A port with one device; every method may raise BusLost.

    tx_bytes, rx_bytes: counts since creation
    errors: counts by kind
    lateness: counter of answers after their time-outs
    """

    def __init__(self, port: BusPort, baud: int, reply_timeout_s: float) -> None:
        self.port = port
        self.tx_bytes = self.rx_bytes = 0
        self.errors: Counter[str] = Counter()
        self.lateness = HostLateness()
        self._byte_s = BITS_PER_BYTE / baud
        self._reply_timeout_s = reply_timeout_s
        self._is_late = False
        self._owed_bytes = 0

    def send(self, packet: bytes) -> None:
        """Send commands that are not answered."""
        self.port.write(packet)
        self.tx_bytes += len(packet)

    def exchange(self, packet: bytes, length: int) -> bytes:
        """Send requests and return their answers, fewer bytes if they do not come in time."""
        port = self.port
        if self._is_late or self._owed_bytes:
            # After a silence answers to earlier requests may come first.
            dropped = port.drain()
            if 0 < dropped <= self._owed_bytes:
                self.lateness.record_late_answer(port.now_s())
            if not self._is_late and not dropped:
                self._owed_bytes = 0
        wire_s = (len(packet) + length) * self._byte_s
        deadline_s = port.now_s() + wire_s + self._reply_timeout_s
        port.clearPort()
        port.write(packet)
        answer = port.read_until(length, deadline_s)
        self.tx_bytes += len(packet)
        self.rx_bytes += len(answer)
        self._is_late = len(answer) < length
        self._owed_bytes += length - len(answer)
        if self._is_late:
            self.lateness.record_wait(deadline_s, port.now_s())
        return answer

    def record_missing(self, answer: bytes) -> None:
        """Count an answer of which bytes are missing."""
        self.errors["incomplete" if answer else "timeout"] += 1

    def record_damage(self) -> None:
        """Count an answer whose bytes were changed, lost or added."""
        self.errors["damaged"] += 1
        self._is_late = True
