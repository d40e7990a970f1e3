"""Detection of a Maestro at a port; nothing is moved intentionally.

One state changes: a board clears its error register when it is read, so the result contains it. A
board treats unknown commands as errors, and on an error it sends its channels home. So the other
setting of check bytes is tried only if it is silent, and only the channels that every board has are
read.
"""

from dataclasses import replace
from typing import NamedTuple

from gazerig.drivers.errors import PortError
from gazerig.drivers.hobby_board.release import TRIES
from gazerig.drivers.maestro.commands import ERRORS, MICRO, name_errors
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.serial.port import BusPort

USB_CHANNELS = {"1ffb:0089": 6, "1ffb:008a": 12, "1ffb:008b": 18, "1ffb:008c": 24}
"""Channels by USB vendor and product id."""


class DetectedMaestro(NamedTuple):
    """A board that answers.

    expects_crc: whether it expects a check byte after every command
    errors: errors of its error register, which is now cleared
    is_script_running: whether its own script runs, None if unknown
    pulses: pulse widths of the first channels, quarter microseconds; 0: no pulses
    """

    expects_crc: bool
    errors: tuple[str, ...]
    is_script_running: bool | None
    pulses: tuple[int, ...]


def probe(port: BusPort, params: MaestroParams) -> DetectedMaestro | None:
    """Return the Maestro at a port, None if no Maestro answers; the port stays open.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    if not port.setBaudRate(params.baud):
        raise PortError(f"{port.port_name} cannot run at {params.baud} bit/s: choose 115200")
    for crc in (params.crc, not params.crc):
        line = MaestroLink(port, replace(params, crc=crc))
        port.drain()
        register = line.read_errors()
        if register is None or register >> len(ERRORS) or not line.expects_crc():
            continue
        script = line.is_script_running()
        for _ in range(TRIES):  # a busy host may have been late, not the board
            pulses = line.read_pulses(range(MICRO))
            if pulses is not None:
                return DetectedMaestro(crc, name_errors(register), script, pulses)
        return None
    return None
