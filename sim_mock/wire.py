"""Timing of the line between the host and an emulated device. Pure arithmetic.

With wire time a byte takes 10 bits at the client's baud rate in either direction, every status
leaves after its servo's return delay (a fast reply only after the first servo's), and the order of
bytes is kept. A Maestro, with a wire for each direction, receives while it sends, but also sends
one answer after another. A servo's bytes are delivered together. Without wire time all bytes
arrive immediately, except for delays by faults. An instruction takes effect when its bytes are put
on the line, not after its last bit.

Source of the formula: ROBOTIS e-Manual (8N1; return delay of the X series); the same frame
of 10 bits in Feetech's and Pololu's manuals. The turnaround of the electronics, reported as
20..50 us for Dynamixel servos, is omitted.
"""

from collections import deque

from gazerig.sim_mock.device import Device

BITS_PER_BYTE = 10


class ServoLine:
    """The line of one device: a chain of servos, or a board.

    Args:
        wire_time: whether bytes take time on the line and return delays apply.
    """

    def __init__(self, device: Device, wire_time: bool = False) -> None:
        self.device = device
        self.wire_time = wire_time
        self._late: deque[tuple[float, bytes]] = deque()
        self._host_free_s = self._line_free_s = 0.0

    @property
    def is_busy(self) -> bool:
        """Return whether bytes are in transit."""
        return bool(self._late)

    def next_due_s(self) -> float | None:
        """Return the arrival time of the next bytes, None if none are in transit."""
        return self._late[0][0] if self._late else None

    def forget(self) -> None:
        """Drop bytes in transit."""
        self._late.clear()
        self._host_free_s = self._line_free_s = 0.0

    def take_arrived(self) -> bytes:
        """Return the bytes that have arrived since the last call."""
        now_s = self.device.now_s()
        out: list[bytes] = []
        while self._late and self._late[0][0] <= now_s:
            out.append(self._late.popleft()[1])
        return b"".join(out)

    def send(self, data: bytes, baud: int) -> bytes:
        """Send the host's bytes now; return the bytes that arrive immediately."""
        faults = self.device.faults
        if faults.has_any:
            data = faults.add_noise(data)
        pieces = self.device.exchange(data, baud)
        if faults.has_any:
            pieces = faults.disturb(pieces, data)
        elif not (self.wire_time or self._late):
            return b"".join([piece[1] for piece in pieces])
        now_s = self.device.now_s()
        byte_s = BITS_PER_BYTE / baud if self.wire_time else 0.0
        start_s = max(now_s, self._host_free_s)
        self._host_free_s = start_s + len(data) * byte_s
        at_s = max(self._line_free_s, now_s)
        for _, answer, end, delay_s, late_s in pieces:
            at_s = max(at_s, start_s + end * byte_s) + late_s + len(answer) * byte_s
            if self.wire_time:
                at_s += delay_s
            self._late.append((at_s, answer))
        self._line_free_s = at_s
        return self.take_arrived()
