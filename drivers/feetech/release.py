"""Switching the torque of Feetech STS servos off on a raw port, without the rest of the driver."""

from collections.abc import Sequence

from drivers.errors import PortError
from drivers.feetech.line import FeetechLine
from drivers.feetech.torque import switch_off
from drivers.serial.port import BusPort

LEAST_S, MOST_S = 0.005, 0.02
"""Patience for an answer beyond its time on the wire."""


def disable_torque(port: BusPort, baud: int, ids: Sequence[int]) -> tuple[int, ...]:
    """Open a port and switch the torque off; return the ids that did not confirm it.

    Args:
        port: closed, or open already; it is left open.
        baud: bit/s.
        ids: of the servos.

    Raises:
        drivers.errors.PortError: the port cannot be opened.
        drivers.errors.BusLost: the port went away.
    """
    if not port.setBaudRate(baud):
        raise PortError(f"{port.port_name} cannot run at {baud} bit/s")
    released = switch_off(FeetechLine(port, LEAST_S, MOST_S, baud), ids)
    return (*released.holding, *released.mute)
