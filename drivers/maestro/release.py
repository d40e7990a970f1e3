"""Stopping a Maestro's pulses: a few files, as whoever lets go in an emergency needs no more."""

from collections.abc import Sequence

from gazerig.drivers.errors import PortError
from gazerig.drivers.hobby_board.release import switch_off
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.serial.port import BusPort


def stop_pulses(port: BusPort, params: MaestroParams, channels: Sequence[int]) -> tuple[int, ...]:
    """Open a port and stop the pulses; return the channels that did not confirm it.

    Args:
        port: closed, or open already; it is left open.
        params: how to speak with the board.
        channels: those of the rig; others of the board are left as they are.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port went away.
    """
    if not port.setBaudRate(params.baud):
        raise PortError(f"{port.port_name} cannot run at {params.baud} bit/s")
    released = switch_off(MaestroLink(port, params), channels)
    return (*released.holding, *released.mute)
