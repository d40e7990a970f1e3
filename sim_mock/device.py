"""Interface between a line and the device emulated at its end: bytes in, timed answers out."""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from gazerig.sim_mock.faults.active import ActiveFaults
from gazerig.sim_mock.replies import Piece


class DeviceReply(NamedTuple):
    """Answer to one instruction; ``end``: position in the sent bytes behind its last byte."""

    end: int
    pieces: list[Piece]


class DeviceFaults(Protocol):
    """The faults of one device and its line.

    wire: those of the line
    """

    wire: ActiveFaults

    def on(self, kind: str) -> bool:
        """True if echo, babble, unplug, deny or block is on now."""
        ...

    def command(self, text: str) -> str:
        """Carry out a line such as ``lose 3 count 2``; return what was done.

        Raises:
            ValueError: names the word that is wrong and what would be right.
        """
        ...


class Device(Protocol):
    """The device side of a serial protocol; it opens nothing, and its clock is an argument."""

    now_s: Callable[[], float]

    @property
    def check_baud(self) -> bool:
        """True if only a client at its baud rate is heard."""
        ...

    @property
    def faults(self) -> DeviceFaults:
        """Return the faults of the device and its line."""
        ...

    def at_baud(self, client_baud: int) -> bool:
        """True if a client at this baud rate is understood."""
        ...

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[DeviceReply]:
        """Process received bytes and return the answer to each instruction in them."""
        ...

    def choose(self, case: str, value: str) -> None:
        """Choose the device's behaviour where documents and devices differ.

        Raises:
            ValueError: there is no such case or value.
        """
        ...

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions now, in the order of its servos."""
        ...
