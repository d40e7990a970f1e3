"""Switching the torque of Dynamixel servos off on a raw port, without the rest of the driver."""

from collections.abc import Sequence

from drivers.errors import PortError
from drivers.serial.port import BusPort
from drivers.servo_bus.line import Line
from drivers.servo_bus.torque import switch_off

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
    released = switch_off(Line(port, LEAST_S, MOST_S, baud), ids)
    return (*released.holding, *released.mute)
