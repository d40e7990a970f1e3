"""Fast sync reads: one packet for all servos, in which every servo's block has a CRC of its own.

Each block ends with the CRC over all bytes since the header. Where the whole answer is right, one
unpacking gives all values; otherwise what can be proved right is taken out block by block, so that
a bad servo costs only itself.
"""

import struct
from collections.abc import Sequence

from fastcrc.crc16 import umts

from gazerig.drivers.dynamixel.protocol import BROADCAST, CHECK, HEADER, STATUS, sync_read
from gazerig.drivers.servo_bus.read_windows import ReadWindow, Sample
from gazerig.drivers.servo_bus.sync_packets import PartialReply, WholeAnswer


class FastSyncRead:
    """A fast sync read; a ``GroupRead``."""

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
        """Count the bytes still to come."""
        at = raw.find(self._head)
        if at < 0:
            # An answer of another length is one of before, and stands in front of ours.
            at = _past_packet(raw)
        return max(0, at + self.reply_length - len(raw))

    def pieces(self, raw: bytes) -> PartialReply:
        """Return the blocks whose CRC is right.

        Every block's CRC continues from the CRC before it as it was sent, so a damaged
        block does not spoil the proof of the next. Of several damaged in a row the first
        is to blame: a lost byte moves all that follows, a spoilt CRC spoils the next proof.
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
    """Return whether all CRCs of an answer are right, each made on from the one before.

    The last CRC alone proves too little: it is made of the bytes as they were on the line, so it is
    right even where two servos with one id spoilt each other's block.
    """
    return tuple(map(umts, parts, (0, *checks))) == checks


_OTHERS = HEADER + bytes((BROADCAST,))


def _past_packet(raw: bytes) -> int:
    """Return where a packet of all that stands in front ends, 0 where none does."""
    if not raw.startswith(_OTHERS) or len(raw) < len(_OTHERS) + 2:
        return 0
    length = int.from_bytes(raw[5:7], "little")
    return 7 + length if length <= _LONGEST else 0


_LONGEST = 2048
"""Length of a fast answer of more servos than there can be: noise."""
