"""Detection of a Maestro at a port; nothing is moved intentionally.

One state changes: a board clears its error register when it is read, so the result contains it. A
board treats unknown commands as errors, and on an error it sends its channels home. So the other
setting of check bytes is tried only if it is silent, and channels that may not exist are read only
on request and if no channel outputs pulses.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import NamedTuple

from gazerig.drivers.errors import PortError
from gazerig.drivers.maestro.commands import ERRORS, MICRO, PROTOCOL_ERROR, name_errors
from gazerig.drivers.maestro.line import MaestroLink
from gazerig.drivers.maestro.params import MaestroParams
from gazerig.drivers.serial.port import BusPort

USB_CHANNELS = {"1ffb:0089": 6, "1ffb:008a": 12, "1ffb:008b": 18, "1ffb:008c": 24}
"""Channels by USB vendor and product id."""

TRIES = 3


class DetectedMaestro(NamedTuple):
    """A board that answers.

    expects_crc: whether it expects a check byte after every command
    errors: errors of its error register, which is now cleared
    is_script_running: whether its own script runs, None if unknown
    pulses: pulse widths by channel, quarter microseconds; 0: no pulses
    channels: number of channels, None if not counted
    """

    expects_crc: bool
    errors: tuple[str, ...]
    is_script_running: bool | None
    pulses: tuple[int, ...]
    channels: int | None


def probe(port: BusPort, params: MaestroParams, count: bool = False) -> DetectedMaestro | None:
    """Return the Maestro at a port, None if no Maestro answers; the port stays open.

    count: find the number of channels by reading channels that may not exist, after which a board
        sends its channels home; never done while a channel outputs pulses. On USB the product id
        identifies it: ``USB_CHANNELS``.

    Raises:
        PortError: the port cannot be opened.
        BusLost: the port is lost.
    """
    if not port.setBaudRate(params.baud):
        raise PortError(f"{port.port_name} cannot run at {params.baud} bit/s: choose 115200")
    for crc in (params.crc, not params.crc):
        line = MaestroLink(port, replace(params, crc=crc))
        port.drain()
        register = line.wait_for_answer()
        if register is not None and not register >> len(ERRORS) and line.expects_crc():
            return _read_state(line, params, register, count)
    return None


def _read_state(
    line: MaestroLink, params: MaestroParams, register: int, count: bool
) -> DetectedMaestro | None:
    """Read the remaining state of a board that answers."""
    status = line.ask(line.codec.script_status(), 1)
    pulses = _retry(partial(line.read_pulses, range(min(MICRO, params.channels))))
    if pulses is None:
        return None
    channels = _count_channels(line) if count and not any(pulses) else None
    if channels is not None and channels > MICRO:
        pulses = line.read_pulses(range(channels)) or pulses
    script = None if status is None else status == b"\0"
    return DetectedMaestro(line.codec.crc, name_errors(register), script, pulses, channels)


def _retry(ask: Callable[[], tuple[int, ...] | None]) -> tuple[int, ...] | None:
    """Repeat a read without an answer: a busy host may have been late, not the board."""
    return next((answer for answer in (ask() for _ in range(TRIES)) if answer is not None), None)


def _count_channels(line: MaestroLink) -> int:
    """Return the number of channels: read the first one of each larger board until one fails."""
    for channels in sorted(USB_CHANNELS.values())[:-1]:
        question = line.codec.position(channels) + line.codec.errors()
        found = line.ask_words(question, 2)
        if found is None or found[1] >> PROTOCOL_ERROR & 1:
            # The rejected command set an error bit, which is cleared here.
            line.wait_for_answer()
            return channels
    return max(USB_CHANNELS.values())
