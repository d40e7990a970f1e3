"""A serial port without a wire: the SDK's PortHandler over an emulated chain in this process.

Time is the chain's: an answer that does not come costs none. It has no baud rate of its
own, loses nothing and delays nothing.
"""

from collections.abc import Callable

from dynamixel_sdk import PortHandler

from sim_mock.servo_chain import ServoChain

BITS_PER_BYTE = 10


class InProcessPort(PortHandler):  # type: ignore[misc]  # the SDK has no types
    """The host's end of an emulated chain.

    Args:
        chain: the servos; their clock is the port's clock.
        tap: gets every byte string the host sends.
    """

    def __init__(
        self,
        chain: ServoChain,
        tap: Callable[[bytes], None] | None = None,
        name: str = "emulated servos",
    ) -> None:
        super().__init__(name)
        self.chain = chain
        self.now_s = chain.now_s
        self._tap = tap
        self._waiting = b""

    # --- what a driver's control loop uses

    def write(self, data: bytes) -> None:
        """Send bytes; what the servos answer waits to be read."""
        if self._tap is not None:
            self._tap(data)
        self._waiting += self.chain.receive(data)

    def read_until(self, length: int, deadline_s: float) -> bytes:
        """Give up to ``length`` bytes; fewer where no more will come."""
        taken, self._waiting = self._waiting[:length], self._waiting[length:]
        return taken

    def drain(self) -> int:
        """Throw away what waits; gives the number of bytes."""
        dropped = len(self._waiting)
        self._waiting = b""
        return dropped

    # --- what the SDK uses

    def setupPort(self, cflag_baud: int) -> bool:
        """Open at a baud rate."""
        self.is_open = True
        self.tx_time_per_byte = 1000.0 * BITS_PER_BYTE / self.baudrate
        self._waiting = b""
        return True

    def closePort(self) -> None:
        """Close; safe to call twice."""
        self.is_open = False

    def clearPort(self) -> None:
        """Throw away what waits."""
        self.drain()

    def getBytesAvailable(self) -> int:
        """Count the bytes that wait."""
        return len(self._waiting)

    def readPort(self, length: int) -> bytes:
        """Give up to ``length`` bytes."""
        return self.read_until(length, self.now_s())

    def writePort(self, packet: bytes | list[int]) -> int:
        """Send bytes; gives their number."""
        data = bytes(packet)
        self.write(data)
        return len(data)

    def getCurrentTime(self) -> float:
        """Give the chain's time in milliseconds."""
        return self.now_s() * 1000.0

    def isPacketTimeout(self) -> bool:
        """Tell that waiting longer is of no use: every answer is already here."""
        return True
