"""Stopping a Maestro's pulses: two files, as whoever lets go in an emergency needs no more."""

from collections.abc import Sequence
from typing import NamedTuple

from drivers.errors import PortError
from drivers.maestro.line import Line
from drivers.maestro.params import MaestroParams
from drivers.serial_port import BusPort

TRIES = 3


class Released(NamedTuple):
    """Channels that still give pulses, and those of which nothing was heard."""

    holding: tuple[int, ...]
    mute: tuple[int, ...]


def switch_off(line: Line, channels: Sequence[int]) -> Released:
    """Stop the pulses, and see that they are gone.

    Raises:
        drivers.errors.BusLost: the port is gone.
    """
    left = tuple(channels)
    heard: set[int] = set()
    for _ in range(TRIES):
        # Each by its own command: one that is damaged on the way takes no other with it.
        line.send(b"".join(line.speech.target(channel, 0) for channel in left))
        found = line.pulses(left)
        if found is not None:
            heard.update(left)
            left = tuple(channel for channel, pulse in zip(left, found, strict=True) if pulse)
        if not left:
            break
    holding = tuple(channel for channel in left if channel in heard)
    return Released(holding, tuple(channel for channel in left if channel not in heard))


def stop_pulses(port: BusPort, params: MaestroParams, channels: Sequence[int]) -> tuple[int, ...]:
    """Open a port and stop the pulses; return the channels that did not confirm it.

    Args:
        port: closed, or open already; it is left open.
        params: how to speak with the board.
        channels: those of the rig; others of the board are left as they are.

    Raises:
        drivers.errors.PortError: the port cannot be opened.
        drivers.errors.BusLost: the port went away.
    """
    if not port.setBaudRate(params.baud):
        raise PortError(f"{port.port_name} cannot run at {params.baud} bit/s")
    released = switch_off(Line(port, params), channels)
    return (*released.holding, *released.mute)
