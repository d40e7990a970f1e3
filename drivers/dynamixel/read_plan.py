"""Registers of Dynamixel servos that a read covers, byte by byte.

Current, velocity and position have adjacent addresses. Everything else that a control loop needs
(torque, latched errors, temperature, voltage) is elsewhere. Servos with an indirect block can map
it next to the three:

    146 | 64 70 126..135 | 144 145 | 120..124
    temperature | torque, hardware error, current, velocity, position | voltage | live bytes

Reads of 13 bytes from the first or 14 from the second return temperature and voltage alternately.
"""

import struct
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

from gazerig.drivers.dynamixel.control_table import (
    FAST_READ_SINCE,
    MODELS,
    IndirectBlock,
    indirect_blocks,
)
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.dynamixel.sync_packets import FastSyncRead
from gazerig.drivers.servo_bus.read_plan import AddressMap, ReadPlan
from gazerig.drivers.servo_bus.read_windows import ReadWindow, WindowSchedule

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig

SENSED = ("effort", "velocity", "position")
ARMED = ("torque", "status")

INDIRECT_MAP = (146, 64, 70, *range(126, 136), 144, 145, *range(120, 125))
"""Source address of every byte of the indirect block."""

DIRECT = ReadWindow(126, 10, "hii", SENSED)
LONGER = ReadWindow(126, 11, "hiix", SENSED)
"""The same with another length, so that a line that repeats its last answer is not believed."""

_DIRECT_SPARE = (
    ReadWindow(124, 12, "2xhii", SENSED),
    ReadWindow(123, 13, "3xhii", SENSED),
    ReadWindow(122, 14, "4xhii", SENSED),
    ReadWindow(120, 16, "6xhii", SENSED),
    ReadWindow(120, 20, "6xhii4x", SENSED),
)

_WARM = (*SENSED, "voltage", "temperature")
_ALONE = (
    ReadWindow(120, 24, "6xhii8x", SENSED),
    ReadWindow(120, 26, "6xhii8xH", _WARM[:-1]),
    ReadWindow(120, 27, "6xhii8xHB", _WARM),
    ReadWindow(116, 28, "10xhii8x", SENSED),
    ReadWindow(116, 30, "10xhii8xH", _WARM[:-1]),
    ReadWindow(116, 31, "10xhii8xHB", _WARM),
    ReadWindow(112, 32, "14xhii8x", SENSED),
    ReadWindow(112, 34, "14xhii8xH", _WARM[:-1]),
    ReadWindow(112, 35, "14xhii8xHB", _WARM),
    ReadWindow(108, 36, "18xhii8x", SENSED),
    ReadWindow(108, 38, "18xhii8xH", _WARM[:-1]),
)
"""For servos read alone: never as long as a group read, and never twice the same."""


def read_plan(
    setups: "Sequence[ServoConfig]", params: DynamixelParams, firmware: Mapping[int, int] | None
) -> ReadPlan:
    """Return the read plan for servos with this firmware; None: not known yet."""
    alone = WindowSchedule(_ALONE, _ALONE)
    block = _common_block(setups, firmware) if params.indirect_block else None
    fast = params.fast_sync_read and _all_fast(setups, firmware)
    packets = FastSyncRead if fast else None
    if block is None:
        return ReadPlan(direct_windows(), alone, alone, packets, covered=False)
    data = struct.pack(f"<{len(INDIRECT_MAP)}H", *INDIRECT_MAP)
    layout = AddressMap(block.address_base, data)
    return ReadPlan(indirect_windows(block), alone, alone, packets, block=layout)


def _all_fast(setups: "Sequence[ServoConfig]", firmware: Mapping[int, int] | None) -> bool:
    """Return whether all servos support fast sync read."""
    if not firmware:
        return False
    return all(firmware[s.id] >= FAST_READ_SINCE[MODELS[s.model].family] for s in setups)


def _common_block(
    setups: "Sequence[ServoConfig]", firmware: Mapping[int, int] | None
) -> IndirectBlock | None:
    """Return the indirect block that all servos have at the same address, None if there is none."""
    if not firmware:
        return None
    blocks = [indirect_blocks(MODELS[s.model], firmware[s.id])[0] for s in setups]
    same = len({(block.address_base, block.data_base) for block in blocks}) == 1
    return blocks[0] if same else None


def direct_windows() -> WindowSchedule:
    """Return the windows of servos whose registers are read directly."""
    return WindowSchedule((DIRECT, LONGER), _DIRECT_SPARE)


def indirect_windows(block: IndirectBlock) -> WindowSchedule:
    """Return the windows of servos with ``INDIRECT_MAP`` in this block."""
    base, armed = block.data_base, (*ARMED, *SENSED)
    both = ("temperature", *armed, "voltage")
    first = ReadWindow(base, 13, "BBBhii", both[:-1])
    second = ReadWindow(base + 1, 14, "BBhiiH", both[1:])
    spare = (ReadWindow(base, 15 + more, f"BBBhiiH{more}x", both) for more in range(6))
    return WindowSchedule((first, second), spare)
