"""Which registers one group read covers, byte by byte.

Directly readable are current, velocity and position, which lie side by side. Everything
else a control loop should know (is the torque on, has an error latched, how warm, how
much voltage) lies apart; servos with an indirect block can lay it beside the three:

    146 | 64 70 126..135 | 144 145 | 120..124
    temperature | torque, hardware error, current, velocity, position | voltage | live bytes

Reading 13 bytes from the first or 14 from the second gives temperature and voltage in turn.

An answer that comes too late must not be taken for one asked for since. So after trouble
readings have other lengths for a while, each its own: an answer of another length is
not the one waited for.
"""

import struct
from typing import NamedTuple

from gazerig.drivers.dynamixel.control_table import IndirectBlock
from gazerig.drivers.servo_bus.window_schedule import Turns

SENSED = ("current", "velocity", "position")
ARMED = ("torque", "hardware_error")

INDIRECT_MAP = (146, 64, 70, *range(126, 136), 144, 145, *range(120, 125))
"""Address behind every byte of the indirect block."""


class Sample(NamedTuple):
    """One servo's answer in register units; None where the reading did not cover it.

    blank: every byte is zero, as in an indirect block whose addresses are lost
    """

    error: int
    current: int
    velocity: int
    position: int
    torque: int | None = None
    hardware_error: int | None = None
    temperature: int | None = None
    voltage: int | None = None
    blank: bool = False


class View(NamedTuple):
    """Bytes read from every servo: where they are, and what they mean.

    layout: struct codes of all ``length`` bytes; fields: names of the numbers in them
    """

    address: int
    length: int
    layout: str
    fields: tuple[str, ...] = SENSED

    def sample(self, error: int, data: bytes) -> Sample:
        """Take one servo's bytes apart."""
        values = dict(zip(self.fields, struct.unpack("<" + self.layout, data), strict=True))
        return Sample(error, **values, blank="torque" in values and not any(data))


DIRECT = View(126, 10, "hii")
LONGER = View(126, 11, "hiix")
"""The same in another length: a line that says its last answer again is not taken at its word."""

_DIRECT_SPARE = (
    View(124, 12, "2xhii"),
    View(123, 13, "3xhii"),
    View(122, 14, "4xhii"),
    View(120, 16, "6xhii"),
    View(120, 20, "6xhii4x"),
)

_WARM = (*SENSED, "voltage", "temperature")
_ALONE = (
    View(120, 24, "6xhii8x"),
    View(120, 26, "6xhii8xH", _WARM[:-1]),
    View(120, 27, "6xhii8xHB", _WARM),
    View(116, 28, "10xhii8x"),
    View(116, 30, "10xhii8xH", _WARM[:-1]),
    View(116, 31, "10xhii8xHB", _WARM),
    View(112, 32, "14xhii8x"),
    View(112, 34, "14xhii8xH", _WARM[:-1]),
    View(112, 35, "14xhii8xHB", _WARM),
    View(108, 36, "18xhii8x"),
    View(108, 38, "18xhii8xH", _WARM[:-1]),
)
"""For servos asked alone: never as long as a reading of the group, and never twice the same."""


def alone_turns() -> Turns[View]:
    """Return the views for servos that are asked alone."""
    return Turns(_ALONE, _ALONE)


def direct_turns() -> Turns[View]:
    """Return the views of servos whose registers are read where they are."""
    return Turns((DIRECT, LONGER), _DIRECT_SPARE)


def indirect_turns(block: IndirectBlock) -> Turns[View]:
    """Return the views of servos with ``INDIRECT_MAP`` in this block."""
    base, armed = block.data_base, (*ARMED, *SENSED)
    both = ("temperature", *armed, "voltage")
    usual = (View(base, 13, "BBBhii", both[:-1]), View(base + 1, 14, "BBhiiH", both[1:]))
    spare = (View(base, 15 + more, f"BBBhiiH{more}x", both) for more in range(6))
    return Turns(usual, spare)
