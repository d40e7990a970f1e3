"""Fast sync reads: one packet for all servos, with a CRC after every servo's block.

Each block ends with the CRC over all bytes since the header. If the whole answer is intact, one
unpacking returns all values. Otherwise the verified blocks are extracted one by one, so that a
faulty servo affects only itself.
"""

import struct
from collections.abc import Sequence

from fastcrc.crc16 import umts

from gazerig.drivers.dynamixel.protocol import BROADCAST, CHECK, HEADER, STATUS, sync_read
from gazerig.drivers.servo_bus.read_windows import ReadWindow, Sample
from gazerig.drivers.servo_bus.sync_packets import PartialReply, WholeAnswer


class FastSyncRead:
    """A fast sync read; implements ``GroupRead``."""

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
        self.whole, self.columns = answer.values, answer.columns
        self.reply_length, self.covers_torque = answer.length, "torque" in window.fields

    def missing(self, raw: bytes) -> int:
        """Return how many bytes have not arrived yet."""
        at = raw.find(self._head)
        if at < 0:
            # An answer of another length is an earlier one, in front of the expected one.
            at = _past_packet(raw)
        return max(0, at + self.reply_length - len(raw))

    def pieces(self, raw: bytes) -> PartialReply:
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


def _past_packet(raw: bytes) -> int:
    """Return the end of a broadcast packet at the beginning, 0 if there is none."""
    if not raw.startswith(_OTHERS) or len(raw) < len(_OTHERS) + 2:
        return 0
    length = int.from_bytes(raw[5:7], "little")
    return 7 + length if length <= _LONGEST else 0


_LONGEST = 2048
"""Longest possible fast answer; a larger length is noise."""
