"""Interface between a line and the emulated device at its end: bytes in, timed answers out."""

from collections.abc import Callable
from typing import Protocol

from gazerig.sim_mock.faults.line import LineFaults
from gazerig.sim_mock.replies import Piece


class Device(Protocol):
    """Device side of a serial protocol; it opens nothing, and its clock is an argument."""

    now_s: Callable[[], float]

    @property
    def faults(self) -> LineFaults:
        """Return the faults of the device and its line."""
        ...

    def exchange(self, data: bytes, client_baud: int | None = None) -> list[Piece]:
        """Process received bytes and return the answers to the instructions in them."""
        ...

    def positions_steps(self) -> tuple[float, ...]:
        """Return the true positions now, in the order of its servos."""
        ...
