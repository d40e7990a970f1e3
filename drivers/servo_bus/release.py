"""Switching the torque of servos off on a raw port, without the rest of the driver."""

from collections.abc import Sequence

from gazerig.drivers.errors import PortError
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.torque import switch_off
from gazerig.drivers.servo_bus.transaction import Line

LEAST_S, MOST_S = 0.005, 0.02
"""Patience for an answer beyond its time on the wire."""


def disable_torque(port: BusPort, family: Family, baud: int, ids: Sequence[int]) -> tuple[int, ...]:
    """Open a port and switch the torque off; return the ids that did not confirm it.

    Args:
        port: closed, or open already; it is left open.
        family: make of the servos.
        baud: bit/s.
        ids: of the servos.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port went away.
    """
    if not port.setBaudRate(baud):
        raise PortError(f"{port.port_name} cannot run at {baud} bit/s")
    released = switch_off(Line(port, family, LEAST_S, MOST_S, baud), ids)
    return (*released.holding, *released.mute)
