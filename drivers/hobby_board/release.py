"""Release of hobby servos; imports no more than the guardian needs in an emergency."""

from collections.abc import Sequence
from typing import Protocol

from gazerig.drivers.bus.release_result import ReleaseResult
from gazerig.drivers.errors import PortError
from gazerig.drivers.serial.port import BusPort

TRIES = 3
"""Number of attempts of operations that must not fail."""


class Stoppable(Protocol):
    """The part of a board that a release needs."""

    def stop(self, channels: Sequence[int], last_try: bool = False) -> None:
        """Stop the pulses of channels; on the last try also by stronger means."""

    def read_pulses(self, channels: Sequence[int]) -> tuple[int, ...] | None:
        """Return the confirmed present pulses of channels; None after a failure."""


def switch_off(board: Stoppable, channels: Sequence[int]) -> ReleaseResult:
    """Stop the pulses and verify that they have stopped.

    Raises:
        BusLost: the port is lost.
    """
    left, heard = tuple(channels), False
    for attempt in range(TRIES):
        board.stop(left, attempt == TRIES - 1)
        found = board.read_pulses(left)
        if found is not None:
            heard = True
            left = tuple(channel for channel, pulse in zip(left, found, strict=True) if pulse)
        if not left:
            break
    return ReleaseResult(left, ()) if heard else ReleaseResult((), left)


def stop_pulses(
    port: BusPort, baud: int, board: Stoppable, channels: Sequence[int]
) -> tuple[int, ...]:
    """Open a board's port and stop the pulses; return the channels that did not confirm it.

    Args:
        port: Closed or open port; it stays open.
        baud: Baud rate, bit/s.
        board: Board on this port.
        channels: Channels of the rig; others are not changed, unless these do not stop.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    if not port.setBaudRate(baud):
        raise PortError(f"{port.port_name} cannot run at {baud} bit/s: choose 115200")
    released = switch_off(board, channels)
    return (*released.holding_ids, *released.unconfirmed_ids)
