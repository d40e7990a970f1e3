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

from gazerig.sim_mock.device import Device, DeviceReply

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
        out = list[bytes]()
        while self._late and self._late[0][0] <= now_s:
            out.append(self._late.popleft()[1])
        return b"".join(out)

    def send(self, data: bytes, baud: int, now_s: float | None = None) -> bytes:
        """Send the host's bytes now, or at ``now_s``; return the bytes that arrive immediately."""
        wire = self.device.faults.wire
        if wire.has_any:
            data = wire.add_noise(data, self.device.now_s())
        replies = self.device.exchange(data, baud)
        if wire.has_any:
            noise_s = self.device.now_s()
            replies = [
                DeviceReply(
                    r.end, [p._replace(data=wire.add_noise(p.data, noise_s)) for p in r.pieces]
                )
                for r in replies
            ]
        if self.wire_time:
            self._queue_on_line(
                data, replies, baud, self.device.now_s() if now_s is None else now_s
            )
        elif wire.has_any or self._late:
            # The only delays are those of faults.
            sent_s = self.device.now_s()
            due_s = max(sent_s, self._late[-1][0] if self._late else sent_s)
            for reply in replies:
                for piece in reply.pieces:
                    due_s += piece.late_s
                    self._late.append((due_s, piece.data))
        else:
            return b"".join([piece[1] for reply in replies for piece in reply[1]])
        return self.take_arrived()

    def _queue_on_line(
        self, data: bytes, replies: list[DeviceReply], baud: int, now_s: float
    ) -> None:
        """Queue answers with their time on the line."""
        byte_s = BITS_PER_BYTE / baud
        start_s = max(now_s, self._host_free_s)
        self._host_free_s = start_s + len(data) * byte_s
        at_s = max(self._line_free_s, now_s)
        for reply in replies:
            at_s = max(at_s, start_s + reply.end * byte_s)
            for piece in reply.pieces:
                at_s += piece.delay_s + piece.late_s + len(piece.data) * byte_s
                self._late.append((at_s, piece.data))
        self._line_free_s = at_s
