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

from fastcrc.crc16 import umts

from gazerig.drivers.dynamixel.control_table import (
    FAST_READ_SINCE,
    MODELS,
    IndirectBlock,
    indirect_blocks,
)
from gazerig.drivers.dynamixel.protocol import BROADCAST, CHECK, HEADER, STATUS, sync_read
from gazerig.drivers.servo_bus.read_plan import (
    AddressMap,
    PartialReply,
    ReadPlan,
    ReadWindow,
    Sample,
    WholeAnswer,
    WindowSchedule,
)

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig


class FastSyncRead:
    """A fast sync read; implements ``GroupRead``.

    Each block ends with the CRC over all bytes since the header. If the whole answer is intact, one
    unpacking returns all values. Otherwise the verified blocks are extracted one by one, so that a
    faulty servo affects only itself.
    """

    def __init__(self, ids: Sequence[int], window: ReadWindow) -> None:
        self.ids, self.window = tuple(ids), window
        self._block = window.length + 4
        self.request = sync_read(ids, window.address, window.length, fast=True)
        size = self._block * len(ids)
        self._head = struct.pack("<4sBHB", HEADER, BROADCAST, size + 1, STATUS)
        # A block begins with its error byte.
        heads = [bytes((0, servo_id)) for servo_id in ids]
        # From each CRC, or the header, up to the next CRC.
        first = len(self._head) + self._block - 2
        parts = f"{first}s" + f"{self._block}s" * (len(ids) - 1) + "2x"
        answer = WholeAnswer(self._head, heads, window, CHECK, parts, _all_intact)
        self.parse_whole, self.columns = answer.values, answer.columns
        self.reply_length, self.covers_torque = answer.length, "torque" in window.fields

    def bytes_missing(self, raw: bytes) -> int:
        """Return how many bytes have not arrived yet."""
        at = raw.find(self._head)
        if at < 0:
            # An answer of another length is an earlier one, in front of the expected one.
            at = 0
            if raw.startswith(_OTHERS) and len(raw) >= len(_OTHERS) + 2:
                length = int.from_bytes(raw[5:7], "little")
                at = 7 + length if length <= _LONGEST else 0
        return max(0, at + self.reply_length - len(raw))

    def verified_parts(self, raw: bytes) -> PartialReply:
        """Return the blocks with a correct CRC.

        Every block's CRC continues from the previous CRC as sent, so a damaged block does not
        invalidate the next one. Of several consecutive damaged blocks the first is the cause: a
        lost byte shifts all that follow, and a damaged CRC invalidates the next block.
        """
        samples: dict[int, Sample] = {}
        damaged, unproved, elsewhere = set[int](), set[int](), set[int]()
        at = raw.find(self._head)
        if at < 0:
            return PartialReply(samples, frozenset())
        crc = umts(self._head)
        at += len(self._head)
        well = True
        for i, servo_id in enumerate(self.ids):
            block = raw[at : at + self._block]
            if len(block) < self._block:
                unproved.update(() if well else self.ids[i:])
                break
            sent = int.from_bytes(block[-2:], "little")
            proved = umts(block[:-2], crc) == sent
            if proved and block[1] == servo_id:
                samples[servo_id] = self.window.sample(block[0], block[2:-2])
                well = True
            else:
                if proved:
                    elsewhere.add(block[1])
                (damaged if well else unproved).add(servo_id)
                well = False
            crc = umts(block[-2:], sent)
            at += self._block
        for servo_id in elsewhere & samples.keys():
            del samples[servo_id]
            damaged.add(servo_id)
        return PartialReply(samples, frozenset(damaged), frozenset(unproved))


def _all_intact(parts: tuple[bytes, ...], checks: tuple[int, ...]) -> bool:
    """Return whether all CRCs of an answer are correct, each continued from the previous one.

    The last CRC alone is not enough: it is computed from the bytes on the line, so it is correct
    even if two servos with one id corrupted each other's block.
    """
    return tuple(map(umts, parts, (0, *checks))) == checks


_OTHERS = HEADER + bytes((BROADCAST,))


_LONGEST = 2048
"""Longest possible fast answer; a larger length is noise."""


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


def read_plan(setups: "Sequence[ServoConfig]", firmware: Mapping[int, int] | None) -> ReadPlan:
    """Return the read plan for servos with this firmware; None: not known yet."""
    alone = WindowSchedule(_ALONE, _ALONE)
    known = [(MODELS[s.model], firmware[s.id]) for s in setups] if firmware else []
    fast = bool(known) and all(version >= FAST_READ_SINCE[m.family] for m, version in known)
    packets = FastSyncRead if fast else None
    blocks = [indirect_blocks(model, version)[0] for model, version in known]
    # All servos must have the indirect block at the same address.
    same = len({(one.address_base, one.data_base) for one in blocks}) == 1
    if not same:
        return ReadPlan(direct_windows(), alone, alone, packets, covers_torque=False)
    block = blocks[0]
    data = struct.pack(f"<{len(INDIRECT_MAP)}H", *INDIRECT_MAP)
    layout = AddressMap(block.address_base, data)
    return ReadPlan(indirect_windows(block), alone, alone, packets, indirect_block=layout)


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
