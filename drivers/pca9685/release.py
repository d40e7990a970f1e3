"""Stopping the pulses of PCA9685 boards, for whoever lets go in an emergency."""

from collections.abc import Sequence

from gazerig.drivers.errors import PortError
from gazerig.drivers.hobby_board.release import switch_off
from gazerig.drivers.pca9685.board import Pca9685Board
from gazerig.drivers.pca9685.params import Pca9685Params
from gazerig.drivers.serial.port import BusPort


def stop_pulses(port: BusPort, params: Pca9685Params, channels: Sequence[int]) -> tuple[int, ...]:
    """Open a port and stop the pulses; return the channels that did not confirm it.

    Args:
        port: closed, or open already; it is left open.
        params: how to reach the boards.
        channels: those of the rig; others are left as they are, unless theirs do not stop.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port went away.
    """
    if not port.setBaudRate(params.baud):
        raise PortError(f"{port.port_name} cannot run at {params.baud} bit/s")
    released = switch_off(Pca9685Board(port, params), channels)
    return (*released.holding, *released.mute)
