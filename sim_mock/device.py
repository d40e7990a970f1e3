"""Interface between a line and the emulated device at its end: bytes in, timed answers out."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from gazerig.sim_mock.faults.active import ActiveFaults
from gazerig.sim_mock.replies import Piece


class DeviceReply(NamedTuple):
    """Answer to one instruction; ``end``: position in the sent bytes after its last byte."""

    end: int
    pieces: list[Piece]


class DeviceFaults(Protocol):
    """Faults of one device and its line.

    wire: faults of the line
    """

    wire: ActiveFaults

    def is_on(self, kind: str) -> bool:
        """Return whether echo or unplug is active."""
        ...

    def command(self, text: str) -> str:
        """Run a command such as ``lose 3 count 2``; return a description of the effect.

        Raises:
            ValueError: the command is invalid; the message names the wrong word and valid ones.
        """
        ...


class Device(Protocol):
    """Device side of a serial protocol; it opens nothing, and its clock is an argument."""

    now_s: Callable[[], float]

    @property
    def check_baud(self) -> bool:
        """Return whether the device answers only clients at its baud rate."""
        ...

    @property
    def faults(self) -> DeviceFaults:
        """Return the faults of the device and its line."""
        ...

    def understands_baud(self, client_baud: int) -> bool:
        """Return whether the device understands a client at this baud rate."""
        ...

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[DeviceReply]:
        """Process received bytes and return the answer to each instruction in them."""
        ...

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions now, in the order of its servos."""
        ...
