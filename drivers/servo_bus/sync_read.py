"""The read of every tick: all servos in one exchange, and one more for those that fail.

If the whole answer is intact and no servo reports an error, one comparison and one unpacking return
all values. Otherwise the answers are taken one by one, so that a faulty servo affects only itself:
servos whose answers were lost with its own are read once more without it.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import inf
from types import MappingProxyType
from typing import Any, NamedTuple

from gazerig.drivers.servo_bus.family import Family, Status, Window, from_sign_magnitude
from gazerig.drivers.servo_bus.poll_list import PollList, silent_servos
from gazerig.drivers.servo_bus.transaction import Transactions

MOST_GROUPS, MOST_SHIFT = 64, 7
"""Largest numbers of prepared reads, and of additional bytes of a read after a lost answer."""

CALM_S = 1.0
"""Time after a lost answer beyond which no answer is late any more."""

SIGNED = ("position", "velocity", "effort")
COLUMNS = (*SIGNED, "voltage", "temperature")
"""Fields with a sign, and all fields that are measured."""


class ServoReply(NamedTuple):
    """One servo's answer in register units, and when it arrived.

    error: error bits of the packet and of the fault's register
    values: values by field; none if it is refused
    """

    at_s: float
    error: int
    values: Mapping[str, int] = MappingProxyType({})


class GroupRead:
    """A prepared read of some servos.

    Args:
        family: Family of the servos.
        ids: Their ids.
        window: Registers to read.
        is_fast: Whether one packet contains all answers.

    request: packet to send
    reply_length: number of bytes of an answer without errors
    columns: slices of ``COLUMNS`` in the values of such an answer, None if the read does not cover
        them
    """

    def __init__(
        self, family: Family, ids: Sequence[int], window: Window, is_fast: bool = False
    ) -> None:
        codec = family.codec
        self.ids, self.window, self.length = tuple(ids), window, window.length
        self.request = family.request(ids, window.address, self.length, is_fast)
        self.parse: Callable[[bytes], list[Status]] = codec.parse_statuses
        if is_fast:
            self.parse = partial(codec.parse_fast, ids=self.ids, length=self.length)
        self._unpack_one = struct.Struct(window.layout).unpack
        frame = codec.answer_frame(ids, self.length, is_fast)
        self._parts, self._is_intact = struct.Struct(frame.parts).unpack, frame.is_intact
        # Headers, ids, errors and the status are known: they are compared together, as one number
        # under a mask. Only the other values are unpacked.
        order, codes, fields = window.layout[0], window.layout[1:], window.fields
        has_status = fields[-1] == "status"
        if has_status:
            codes, fields = codes[:-1] + "x", fields[:-1]
        whole = "".join(f"{len(head)}x{codes}{frame.check}" for head in frame.heads)
        self.reply_length = struct.calcsize(order + whole)
        self._unpack = struct.Struct(order + whole).unpack
        stride = len(fields) + 1
        columns = {name: slice(i, None, stride) for i, name in enumerate(fields)}
        self.columns: tuple[Any, ...] = tuple(columns.get(name) for name in COLUMNS)
        self._checks = slice(stride - 1, None, stride)
        tail = bytes(self.length - has_status) + b"\xff" * has_status
        tail += bytes(struct.calcsize(order + frame.check))
        mask = b"".join(b"\xff" * len(head) + tail for head in frame.heads)
        known = b"".join(head + bytes(len(tail)) for head in frame.heads)
        self._mask = int.from_bytes(mask, "little")
        self._known = int.from_bytes(known, "little")

    def parse_whole(self, raw: bytes) -> tuple[int, ...] | None:
        """Return the values of an intact answer without errors, None if it is not one."""
        if len(raw) != self.reply_length:
            return None
        if int.from_bytes(raw, "little") & self._mask != self._known:
            return None
        values: tuple[int, ...] = self._unpack(raw)
        return values if self._is_intact(self._parts(raw), values[self._checks]) else None

    def reply(self, status: Status, at_s: float) -> ServoReply:
        """Return one servo's values from its answer."""
        if len(status.params) != self.length:
            return ServoReply(at_s, status.error)
        values = dict(zip(self.window.fields, self._unpack_one(status.params), strict=True))
        for name, sign in zip(SIGNED, self.window.signs, strict=False):
            values[name] = from_sign_magnitude(values[name], sign)
        return ServoReply(at_s, status.error | values.pop("status", 0), values)


class SyncReader:
    """Reader of all servos of a poll list; reads raise BusLost if the port is lost.

    An answer contains neither its registers nor the time of its request. So after a lost answer the
    reads begin at another register for a while: a late answer has another length.

    Args:
        line: Exchanges on the bus.
        polled: Servos to read; failures are recorded in it.
        is_fast: Whether all servos have a fast sync read.
    """

    def __init__(self, line: Transactions, polled: PollList, is_fast: bool) -> None:
        self._line, self._family = line, line.family
        self.poll_list = polled
        self._is_fast = is_fast
        self._groups: dict[tuple[tuple[int, ...], int], GroupRead] = {}
        self._shift, self._calm_at_s = 0, -inf

    def group(self, now_s: float) -> GroupRead | None:
        """Return the read of all servos that answer; None if it is not one exchange."""
        if self._shift and now_s >= self._calm_at_s:
            self._shift = 0
        ids = self.poll_list.group
        if not ids or not self._family.sync_read:
            return None
        return self._groups.get((ids, self._shift)) or self._prepare(ids)

    def read_each(self, now_s: float) -> dict[int, ServoReply]:
        """Read servos that have no sync read one by one; return those with a good answer."""
        replies: dict[int, ServoReply] = {}
        until_s = self._line.port.now_s() + 2.0 * self._line.most_s
        for servo_id in self.poll_list.group:
            if self._line.port.now_s() >= until_s:
                break
            group = self._prepare((servo_id,))
            raw, at_s = self._line.exchange(group.request, group.reply_length)
            replies |= self.sort_out(group, raw, at_s, now_s)
        return replies

    def sort_out(
        self, group: GroupRead, raw: bytes, at_s: float, now_s: float
    ) -> dict[int, ServoReply]:
        """Return the good answers among received bytes; servos without one are read once more.

        Call this before anything else is sent.
        """
        replies = self._sort(group, raw, at_s, now_s)
        left = tuple(i for i in self.poll_list.group if i in group.ids and i not in replies)
        if left:
            more = self.read_again(left, now_s)
            replies |= more
            if len(more) < len(left):
                self._line.drain()
        return replies

    def read_again(self, ids: tuple[int, ...], now_s: float) -> dict[int, ServoReply]:
        """Read some servos, and record their answers."""
        group = self._prepare(ids)
        raw, at_s = self._line.exchange(group.request, group.reply_length)
        return self._sort(group, raw, at_s, now_s)

    def _prepare(self, ids: tuple[int, ...]) -> GroupRead:
        key = ids, self._shift
        if key not in self._groups:
            if len(self._groups) >= MOST_GROUPS:
                self._groups.clear()
            first, layout = self._family.window.address, self._family.window.layout
            window = self._family.window._replace(
                address=first - self._shift, layout=f"{layout[0]}{self._shift}x{layout[1:]}"
            )
            self._groups[key] = GroupRead(self._family, ids, window, self._is_fast)
        return self._groups[key]

    def _sort(
        self, group: GroupRead, raw: bytes, at_s: float, now_s: float
    ) -> dict[int, ServoReply]:
        """Return the good answers to a read, and record the servos without one.

        Of several damaged answers the first is the cause: it may have spoilt those that follow.
        """
        line, polled = self._line, self.poll_list
        good, damaged = line.collect(group.request, raw, group.ids, group.length, group.parse)
        for servo_id in good:
            polled.record_answer(servo_id)
        spoiler = next((i for i in group.ids if i in damaged), None)
        if spoiler is not None:
            line.errors["corrupt"] += 1
            polled.record_failure(spoiler, now_s, damaged=True)
        for servo_id in silent_servos(group.ids, {*good, *damaged}):
            line.errors["timeout"] += 1
            polled.record_failure(servo_id, now_s)
            self._shift = self._shift % MOST_SHIFT + 1
            self._calm_at_s = now_s + CALM_S
        return {i: group.reply(status, at_s) for i, status in good.items()}
