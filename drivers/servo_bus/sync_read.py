"""The read of every tick: all servos in one exchange, and retries for those that fail.

A silent or garbling servo affects only itself: servos whose answers were lost with its own are
immediately read again without it.
"""

from collections.abc import Sequence
from math import inf
from typing import NamedTuple

from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.poll_list import PollList, silent_servos
from gazerig.drivers.servo_bus.read_plan import (
    GroupRead,
    PartialReply,
    ReadPlan,
    ReadWindow,
    Sample,
    WholeAnswer,
    WindowSchedule,
)
from gazerig.drivers.servo_bus.transaction import Transactions

MOST_GROUPS = 64
"""Largest number of prepared exchanges."""

MOST_UNREAD = 4096
"""Largest number of bytes that are kept to see whether they are a late answer."""

OWED_S = 0.5
"""Time after its time-out during which an answer may still arrive."""


class ServoReply(NamedTuple):
    """One servo's answer and when it arrived."""

    sample: Sample
    at_s: float


class SyncReader:
    """Reader of all servos of a poll list.

    Args:
        line: Exchanges on the bus.
        polled: Servos to read; failures are recorded in it.
        plan: Plan of their reads.

    unanswered_s: time of the last read that a servo did not answer
    stray_s: time of the last read with stray bytes instead of an answer
    """

    def __init__(self, line: Transactions, polled: PollList, plan: ReadPlan) -> None:
        self._line = line
        self.poll_list = polled
        self._together, self._alone, self._second = (
            plan.group_windows,
            plan.single_windows,
            plan.confirming_windows,
        )
        self._packets = plan.create_group_read
        self._unread = b""
        self._until_s = inf
        self._sync_read = line.family.sync_read
        self.unanswered_s = self.stray_s = -inf
        self._unanswered_s: dict[int, float] = {}
        self._groups: dict[tuple[tuple[int, ...], int, int], GroupRead] = {}
        self._prepared_ids: tuple[int, ...] = ()
        self._prepared: dict[int, GroupRead] = {}

    def next_group(self, now_s: float) -> GroupRead | None:
        """Return the due read of all servos; None if they are not all read in one exchange."""
        polled, turns = self.poll_list, self._together
        if turns.is_troubled:
            turns.end_trouble(now_s)
        if polled.is_troubled or not self._sync_read:
            return None
        window = turns.next_window()
        # Looked up by identity: hashing ids and windows every tick takes as long as reading the
        # answer.
        if polled.group is self._prepared_ids and (ready := self._prepared.get(id(window))):
            return ready
        return self._group(polled.group, window)

    def verified_replies(
        self, group: GroupRead, raw: bytes, at_s: float, now_s: float
    ) -> dict[int, ServoReply]:
        """Return the verified parts of an answer to a read of all servos.

        A servo that is absent from the result gave no good answer, not even in a second read. Call
        this before anything else is sent.

        Raises:
            BusLost: the port is lost.
        """
        self._until_s = self._line.whole_s + self._line.most_s
        replies: dict[int, ServoReply] = {}
        self._store_replies(group, raw, at_s, replies, now_s, self._together)
        return replies

    def is_reply_pending(self, servo_id: int, now_s: float) -> bool:
        """Return whether a servo has recently left a request unanswered.

        The present answer may belong to that request, as a packet identifies neither its time nor
        its request, and neither length nor silence decides it.
        """
        return now_s - self._unanswered_s.get(servo_id, -inf) <= OWED_S

    def reread(self, ids: Sequence[int]) -> dict[int, ServoReply]:
        """Read some servos once more, in one exchange; return those with a good answer.

        Raises:
            BusLost: the port is lost.
        """
        replies: dict[int, ServoReply] = {}
        window = self._second.next_window()
        for asked in self._line.family.request_groups(ids):
            group = self._group(asked, window)
            raw, at_s = self._line.exchange(group.request, group.reply_length)
            raw = self._line.wait_for_rest(raw, group.bytes_missing, self._line.deadline_s)
            samples = group.verified_parts(raw).samples
            if len(samples) < len(group.ids) and not self._line.quiet:
                self._line.drain(self._line.timeout.seconds)
            replies |= {servo_id: ServoReply(sample, at_s) for servo_id, sample in samples.items()}
        return replies

    def read_troubled(self, now_s: float) -> dict[int, ServoReply]:
        """Read the group and one servo that is out of it; return those with a good answer.

        Raises:
            BusLost: the port is lost.
        """
        replies: dict[int, ServoReply] = {}
        together, due = self.poll_list.group, self.poll_list.next_due(now_s)
        self._until_s = inf
        if together:
            window = self._together.next_window()
            for asked in self._line.family.request_groups(together):
                if self._line.port.now_s() < self._until_s:
                    self._read(asked, replies, now_s, self._together, window)
        if due is not None and self._line.port.now_s() < self._until_s:
            self._read((due,), replies, now_s, self._alone, self._alone.next_window())
        return replies

    def _read(
        self,
        ids: tuple[int, ...],
        replies: dict[int, ServoReply],
        now_s: float,
        turns: WindowSchedule,
        window: ReadWindow,
    ) -> None:
        group = self._group(ids, window)
        # A servo that was silent before gets no reserve.
        reserve = turns is self._together
        raw, at_s = self._line.exchange(group.request, group.reply_length, reserve)
        # The whole read has one time limit, the longest one of its first exchange.
        self._until_s = min(self._until_s, self._line.whole_s + self._line.most_s)
        self._store_replies(group, raw, at_s, replies, now_s, turns)

    def _group(self, ids: tuple[int, ...], window: ReadWindow) -> GroupRead:
        """Return the prepared exchange for some servos."""
        if ids is not self._prepared_ids:
            self._prepared_ids, self._prepared = ids, {}
        group = self._prepared.get(id(window))
        if group is None:
            key = ids, window.address, window.length
            group = self._groups.get(key)
            if group is None:
                if len(self._groups) >= MOST_GROUPS:
                    self._groups.clear()
                if self._packets is not None:
                    group = self._packets(ids, window)
                else:
                    group = SyncRead(self._line.family, ids, window)
                self._groups[key] = group
            self._prepared[id(window)] = group
        return group

    def _store_replies(
        self,
        group: GroupRead,
        raw: bytes,
        at_s: float,
        replies: dict[int, ServoReply],
        now_s: float,
        turns: WindowSchedule,
    ) -> None:
        """Store the verified parts of an answer; read servos again that lost theirs to another."""
        while True:
            raw = self._line.wait_for_rest(raw, group.bytes_missing, self._line.deadline_s)
            samples, damaged, unproved, stray = group.verified_parts(raw)
            if stray:
                self.stray_s = now_s
            for servo_id, sample in samples.items():
                replies[servo_id] = ServoReply(sample, at_s)
            if len(samples) == len(group.ids):
                return
            self.unanswered_s = now_s
            for servo_id in group.ids:
                if servo_id not in samples:
                    self._unanswered_s[servo_id] = now_s
            silent = silent_servos(group.ids, samples.keys() | damaged | unproved)
            before, self._unread = self._unread, b""
            late = not samples and self._line.record_late(raw, before)
            if not samples and not late and self._packets is not None:
                # The blocks of one late answer may arrive in the windows of several requests.
                self._unread = (before + raw)[-MOST_UNREAD:]
            # Later bytes must not be mistaken for the next answer.
            line, polled = self._line, self.poll_list
            for servo_id in damaged:
                line.errors["corrupt"] += 1
                polled.record_damaged(servo_id, now_s)
            for servo_id in silent:
                line.errors["timeout"] += 1
                polled.record_silent(servo_id, now_s)
            turns.record_trouble(now_s)
            if not line.quiet and line.drain(line.timeout.seconds):
                line.timeout.record_late_answer()
            done = replies.keys() | damaged | frozenset(silent)
            left = tuple(servo_id for servo_id in group.ids if servo_id not in done)
            if not left or self._line.port.now_s() >= self._until_s:
                return
            group = self._group(left, turns.next_window())
            raw, at_s = self._line.exchange(group.request, group.reply_length)


class SyncRead:
    """A sync read with one status per servo; a plain read for families without sync read.

    See ``GroupRead``.
    """

    def __init__(self, family: Family, ids: Sequence[int], window: ReadWindow) -> None:
        codec = self._codec = family.codec
        self.ids, self.window = tuple(ids), window
        self._size = window.length + codec.STATUS_OVERHEAD
        self.request = family.request(ids, window.address, window.length)
        heads = [codec.status_head(i, window.length) + b"\x00" for i in ids]
        before, after = codec.CHECKED
        part = f"{before}x{self._size - before - after}s{after}x"
        answer = WholeAnswer(b"", heads, window, codec.CHECK, part * len(ids), codec.all_intact)
        self.parse_whole, self.columns = answer.values, answer.columns
        self.reply_length, self.covers_torque = answer.length, "torque" in window.fields

    def bytes_missing(self, raw: bytes) -> int:
        """Return how many bytes have not arrived yet."""
        codec, count, length = self._codec, len(self.ids), self.window.length
        missing = codec.bytes_missing(raw, count, length)
        if missing:
            return missing
        # Repeated statuses, echoes and statuses of other servos are not expected ones.
        found = codec.parse_statuses(raw)
        fits = {s.id for s in found if len(s.params) == length or s.error & codec.REFUSAL}
        there = len(fits.intersection(self.ids))
        return codec.bytes_missing(raw, len(found) + count - there, length)

    def verified_parts(self, raw: bytes) -> PartialReply:
        """Return the verified parts.

        Servos answer in the order of the request. If an answer is missing, one in the position of
        another servo's is not verified: that servo may have lost its id, and the correct answer its
        header.
        """
        samples: dict[int, Sample] = {}
        damaged, twofold, in_place = set[int](), set[int](), set[int]()
        begin = len(self.request) if raw.startswith(self.request) else 0  # an echo
        stray = len(raw)
        for status in self._codec.parse_statuses(raw):
            stray -= status.intact * (len(status.params) + self._codec.STATUS_OVERHEAD)
            if status.id not in self.ids:
                continue
            place = begin + self.ids.index(status.id) * self._size
            if status.intact and abs(status.offset - place) < self._size // 2:
                in_place.add(status.id)
            if not status.intact:
                damaged.add(status.id)
            elif len(status.params) == self.window.length:
                sample = self.window.sample(status.error, status.params)
                # Two equal answers are an echo; two different ones cannot both be this servo's.
                if samples.setdefault(status.id, sample) != sample:
                    twofold.add(status.id)
            elif not status.params and status.error & self._codec.REFUSAL:
                samples[status.id] = Sample(status.error)
            else:
                # A valid answer of another length: it is late, or the servo misread the request.
                damaged.add(status.id)
        missing = len(samples) < len(self.ids)
        unproved = samples.keys() - in_place if missing else set[int]()
        for servo_id in twofold | unproved:
            del samples[servo_id]
        damaged = (damaged | twofold) - samples.keys()
        return PartialReply(
            samples, frozenset(damaged), frozenset(unproved - damaged), missing and stray > 0
        )
