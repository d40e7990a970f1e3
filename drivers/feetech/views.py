"""Which registers one group read covers, byte by byte.

What a control loop needs every tick lies side by side in 56..70; torque and the armed
limits lie before it, so now and then the reading begins at 40 and tells them too.

An answer that comes too late must not be taken for one asked for since. So after trouble
readings have other lengths for a while, each its own: an answer of another length is
not the one waited for.
"""

import struct
from typing import NamedTuple

from gazerig.drivers.feetech.memory_table import REGISTERS
from gazerig.drivers.servo_bus.window_schedule import Turns


class Sample(NamedTuple):
    """One servo's answer in register units, signs decoded.

    error: bits of gazerig.drivers.feetech.memory_table.STATUS_ERRORS, of the answer and of Status
    (65)
    torque, acceleration, limit: registers 40, 41 and 48; None where the reading did not
        cover them
    """

    error: int
    position: int
    velocity: int
    load: int
    voltage: int
    temperature: int
    moving: int
    current: int
    torque: int | None = None
    acceleration: int | None = None
    limit: int | None = None


class View:
    """Bytes read from every servo: ``length`` from ``address`` on, up to Present Current (69).

    Args:
        address: 56 or below; from 40 or below torque and armed limits are told too.
    """

    END = 71
    _SENSED, _SENSED_AT = "HHHBBxBB2xH", 56
    _ARMED, _ARMED_AT = "BB6xH6x", 40

    def __init__(self, address: int) -> None:
        self.address, self.length = address, self.END - address
        self.armed = address <= self._ARMED_AT
        pad = (self._ARMED_AT if self.armed else self._SENSED_AT) - address
        layout = f"<{pad}x" + (self._ARMED if self.armed else "") + self._SENSED
        self.layout, self.numbers = layout[1:], 11 if self.armed else 8
        self._layout = struct.Struct(layout)

    def sample(self, error: int, data: bytes) -> Sample:
        """Take one servo's bytes apart."""
        *armed, position, velocity, load, volts, warm, status, moving, current = (
            self._layout.unpack(data)
        )
        # Sign and magnitude, written out: this runs for every number of every tick.
        return Sample(
            error | status,
            -(position & 0x7FFF) if position & 0x8000 else position,
            -(velocity & 0x7FFF) if velocity & 0x8000 else velocity,
            -(load & 0x3FF) if load & 0x400 else load & 0x3FF,
            volts,
            warm,
            moving,
            -(current & 0x7FFF) if current & 0x8000 else current,
            *armed,
        )


SENSED = View(REGISTERS["present_position"].address)
LONGER = View(SENSED.address - 1)
"""The same in another length: a line that says its last answer again is not taken at its word."""

ARMED = View(REGISTERS["torque_enable"].address)

_SPARE = tuple(View(SENSED.address - more) for more in range(2, 7))
_SECOND = tuple(View(SENSED.address - more) for more in range(7, 11))
"""For readings that confirm others: an answer must not pass for its own proof."""

_ALONE = tuple(View(ARMED.address - more) for more in range(1, 11))
"""For servos asked alone: never as long as a reading of the group, and never twice the same."""


def together_turns(torque_every: int) -> Turns[View]:
    """Return the views of the group's reading; every so many tell the torque as well."""
    usual = [ARMED, *(SENSED, LONGER) * torque_every][:torque_every]
    if torque_every == 1:
        usual.append(View(ARMED.address - 1))
    return Turns(usual, _SPARE)


def alone_turns() -> Turns[View]:
    """Return the views for servos that are asked alone."""
    return Turns(_ALONE, _ALONE)


def again_turns() -> Turns[View]:
    """Return the views of readings that confirm others."""
    return Turns(_SECOND, _SECOND)
