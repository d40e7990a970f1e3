"""The read of every tick: all servos in one exchange, and one more for those that fail.

If the whole answer is intact and no servo reports an error, one comparison and one unpacking return
all values. Otherwise the answers are taken one by one, so that a faulty servo affects only itself:
servos whose answers were lost with its own are read once more without it.
"""

import struct
from collections.abc import Callable, Collection, Sequence
from functools import partial
from math import inf
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
    voltage, temperature: None if the read does not cover them
    is_refused: whether it contains no values
    """

    at_s: float
    error: int
    position: int = 0
    velocity: int = 0
    effort: int = 0
    voltage: int | None = None
    temperature: int | None = None
    is_refused: bool = False


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
        self.request: bytes
        if is_fast:
            self.request = codec.sync_read(ids, window.address, self.length, True)
        else:
            self.request = family.request(ids, window.address, self.length)
        self.parse: Callable[[bytes], list[Status]] = (
            partial(codec.parse_fast, ids=self.ids, length=self.length)
            if is_fast
            else codec.parse_statuses
        )
        self._unpack_one = struct.Struct(window.layout).unpack
        frame = codec.answer_frame(ids, self.length, is_fast)
        # Headers, ids, errors and the status are known: they are compared together, as one number
        # under a mask. Only the other values are unpacked.
        order, codes, fields = window.layout[0], window.layout[1:], window.fields
        has_status = fields[-1] == "status"
        if has_status:
            codes, fields = codes[:-1] + "x", fields[:-1]
        row = f"{len(frame.heads[0])}x{codes}{frame.check}"
        whole = struct.Struct(f"{order}{len(frame.front)}x{row * len(ids)}")
        self.reply_length, self._unpack = whole.size, whole.unpack
        self._parts, self._is_intact = struct.Struct(frame.parts).unpack, frame.is_intact
        stride = len(fields) + 1
        columns = {name: slice(i, None, stride) for i, name in enumerate(fields)}
        self.columns: tuple[Any, ...] = tuple(columns.get(name) for name in COLUMNS)
        self._checks = slice(stride - 1, None, stride)
        check_size = struct.calcsize(order + frame.check)
        tail = bytes(self.length - has_status) + b"\xff" * has_status + bytes(check_size)
        mask = b"\xff" * len(frame.front)
        mask += b"".join(b"\xff" * len(head) + tail for head in frame.heads)
        known = frame.front + b"".join(head + bytes(len(tail)) for head in frame.heads)
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
            return ServoReply(at_s, status.error, is_refused=True)
        values = dict(zip(self.window.fields, self._unpack_one(status.params), strict=True))
        for name, sign in zip(SIGNED, self.window.signs, strict=False):
            values[name] = from_sign_magnitude(values[name], sign)
        return ServoReply(at_s, status.error | values.pop("status", 0), **values)


class SyncReader:
    """Reader of all servos of a poll list.

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
        return self._prepare(ids) if ids and self._family.sync_read else None

    def read_each(self, now_s: float) -> dict[int, ServoReply]:
        """Read servos that have no sync read one by one; return those with a good answer.

        Raises:
            BusLost: the port is lost.
        """
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

        Raises:
            BusLost: the port is lost.
        """
        line = self._line
        replies, damaged = self._collect(group, raw, at_s)
        spoiler = self._record(group.ids, replies, damaged, now_s)
        left = tuple(i for i in self.poll_list.group if i in group.ids and i not in replies)
        # A servo that damages its answer would spoil those of others again.
        left = tuple(i for i in left if i != spoiler) or left
        if left:
            more = self._read(left, now_s)
            replies |= more
            if len(more) < len(left):
                line.drain()
        return replies

    def read_silent(self, now_s: float) -> None:
        """Read a servo that is out of the group, if one is due; it returns if it answers.

        Its values are not used: after a long silence an answer may be an old one.

        Raises:
            BusLost: the port is lost.
        """
        servo_id = self.poll_list.next_due(now_s)
        if servo_id is None:
            return
        self._read((servo_id,), now_s)

    def _prepare(self, ids: tuple[int, ...]) -> GroupRead:
        group = self._groups.get((ids, self._shift))
        if group is None:
            if len(self._groups) >= MOST_GROUPS:
                self._groups.clear()
            first, layout = self._family.window.address, self._family.window.layout
            window = self._family.window._replace(
                address=first - self._shift, layout=f"{layout[0]}{self._shift}x{layout[1:]}"
            )
            group = GroupRead(self._family, ids, window, self._is_fast)
            self._groups[ids, self._shift] = group
        return group

    def _read(self, ids: tuple[int, ...], now_s: float) -> dict[int, ServoReply]:
        """Read some servos, and record their answers."""
        group = self._prepare(ids)
        raw, at_s = self._line.exchange(group.request, group.reply_length)
        replies, damaged = self._collect(group, raw, at_s)
        self._record(ids, replies, damaged, now_s)
        return replies

    def _collect(
        self, group: GroupRead, raw: bytes, at_s: float
    ) -> tuple[dict[int, ServoReply], set[int]]:
        """Return the good answers to a read, and the servos whose answers are damaged."""
        good, damaged = self._line.collect(
            group.request, raw, group.ids, group.length, self._line.deadline_s, group.parse
        )
        return {i: group.reply(status, at_s) for i, status in good.items()}, damaged

    def _record(
        self,
        ids: Sequence[int],
        replies: Collection[int],
        damaged: Collection[int],
        now_s: float,
    ) -> int | None:
        """Record which servos answered, or failed; return the one that damaged its answer.

        Of several damaged answers the first is the cause: it may have spoilt those that follow.
        """
        errors = self._line.errors
        for servo_id in replies:
            self.poll_list.record_answer(servo_id)
        spoiler = next((i for i in ids if i in damaged), None)
        if spoiler is not None:
            errors["corrupt"] += 1
            self.poll_list.record_damaged(spoiler, now_s)
        for servo_id in silent_servos(ids, {*replies, *damaged}):
            errors["timeout"] += 1
            self.poll_list.record_silent(servo_id, now_s)
            self._shift = self._shift % MOST_SHIFT + 1
            self._calm_at_s = now_s + CALM_S
        return spoiler
