"""Which registers one group read covers, byte by byte.

What a control loop needs every tick lies side by side in 56..70; torque and the armed
limits lie before it, so now and then the reading begins at 40 and tells them too.

An answer that comes too late must not be taken for one asked for since. So after trouble
readings have other lengths for a while, each its own: an answer of another length is
not the one waited for.
"""

import struct
from collections.abc import Sequence
from typing import NamedTuple

from drivers.feetech.table import REGISTERS

CALM_S = 0.25
"""So long after the last trouble no answer is late any more."""


class Sample(NamedTuple):
    """One servo's answer in register units, signs decoded.

    error: bits of drivers.feetech.table.STATUS_ERRORS, of the answer and of Status (65)
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
ARMED = View(REGISTERS["torque_enable"].address)

_SPARE = tuple(View(SENSED.address - more) for more in range(1, 6))
_ALONE = tuple(View(ARMED.address - more) for more in range(1, 11))
"""For servos asked alone: never as long as a reading of the group, and never twice the same."""


class Turns:
    """Says which view is read next: the usual ones in turn, after trouble others for a while."""

    def __init__(self, usual: Sequence[View], spare: Sequence[View]) -> None:
        self._usual, self._spare = tuple(usual), tuple(spare)
        self._at, self._spares = -1, -1
        self._calm_at_s = 0.0
        self.troubled = False

    def next(self) -> View:
        """Give the view of the next reading."""
        if self.troubled:
            return self._spare[self._spares]
        self._at = (self._at + 1) % len(self._usual)
        return self._usual[self._at]

    def trouble(self, now_s: float) -> None:
        """Note that an answer stayed out: the next reading has another length."""
        self.troubled = True
        self._spares = (self._spares + 1) % len(self._spare)
        self._calm_at_s = now_s + CALM_S

    def calm(self, now_s: float) -> None:
        """Note the time; the usual views come back when nothing can be late any more."""
        if now_s >= self._calm_at_s:
            self.troubled = False


def together_turns(torque_every: int) -> Turns:
    """Give the views of the group's reading; every so many tell the torque as well."""
    return Turns((ARMED, *(SENSED,) * (torque_every - 1)), _SPARE)


def alone_turns() -> Turns:
    """Give the views for servos that are asked alone."""
    return Turns(_ALONE, _ALONE)
