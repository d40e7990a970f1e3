"""The one read of every tick: all servos in one exchange, and what to do about those who fail.

A servo that keeps silent or garbles costs only itself: those whose answers were lost with
its own are asked again at once without it.
"""

from collections.abc import Collection, Sequence
from math import inf
from typing import NamedTuple

from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.poll_list import PollList, silent_servos
from gazerig.drivers.servo_bus.read_plan import ReadPlan
from gazerig.drivers.servo_bus.read_windows import ReadWindow, Sample, WindowSchedule
from gazerig.drivers.servo_bus.sync_packets import GroupRead, PartialReply, WholeAnswer
from gazerig.drivers.servo_bus.transaction import Transactions

MOST_GROUPS = 64
"""So many prepared exchanges are kept."""

OWED_S = 0.5
"""An answer may still come so long after waiting for it has ended."""


class ServoReply(NamedTuple):
    """One servo's answer and when it arrived."""

    sample: Sample
    at_s: float


class SyncReader:
    """Reads all servos of a poll list.

    Args:
        line: the bus.
        polled: the servos that are read; gets those that failed.
        plan: how they are read.

    unanswered_s: when a servo left a question unanswered last, the time of reading
    stray_s: when bytes that are of no right answer came instead of one last, the same
    """

    def __init__(self, line: Transactions, polled: PollList, plan: ReadPlan) -> None:
        self._line = line
        self.poll_list = polled
        self._together, self._alone, self._second = plan.together, plan.alone, plan.second
        self._packets, self._header = plan.packets, line.family.codec.HEADER
        self._until_s = inf
        self._sync_read = line.family.sync_read
        self.unanswered_s = self.stray_s = -inf
        self._unanswered_s: dict[int, float] = {}
        self._groups: dict[tuple[tuple[int, ...], int, int], GroupRead] = {}
        self._prepared_ids: tuple[int, ...] = ()
        self._prepared: dict[int, GroupRead] = {}

    def next_group(self, now_s: float) -> GroupRead | None:
        """Return the read of all servos that is due; None if not all are asked in one."""
        polled, turns = self.poll_list, self._together
        if turns.troubled:
            turns.calm(now_s)
        if polled.troubled or not self._sync_read:
            return None
        window = turns.next()
        # By identity: hashing ids and windows in every tick costs as much as reading the answer.
        if polled.group is self._prepared_ids and (ready := self._prepared.get(id(window))):
            return ready
        return self._group(polled.group, window)

    def salvage(
        self, group: GroupRead, raw: bytes, at_s: float, now_s: float
    ) -> dict[int, ServoReply]:
        """Return what can be proved right of an answer to a read of all servos.

        Who is not in it gave no good answer, not even when asked once more. To be called before
        anything else is sent.

        Raises:
            BusLost: the port is gone.
        """
        self._until_s = self._line.whole_s + self._line.most_s
        replies: dict[int, ServoReply] = {}
        self._save(group, raw, at_s, replies, now_s, self._together)
        return replies

    def answer_owed(self, servo_id: int, now_s: float) -> bool:
        """Return whether a servo has left a question unanswered of late.

        The answer that comes now may be to that one where a packet says nothing of when or to
        what question it was given, and neither length nor silence tells.
        """
        return now_s - self._unanswered_s.get(servo_id, -inf) <= OWED_S

    def again(self, ids: Sequence[int]) -> dict[int, ServoReply]:
        """Ask some servos once more, in one exchange; who is not in the answer gave no good one.

        Raises:
            BusLost: the port is gone.
        """
        replies: dict[int, ServoReply] = {}
        window = self._second.next()
        for asked in self._line.family.asked_together(ids):
            group = self._group(asked, window)
            raw, at_s = self._line.exchange(group.request, group.reply_length)
            raw = self._line.complete(raw, group.missing, self._line.deadline_s)
            samples = group.pieces(raw).samples
            if len(samples) < len(group.ids) and not self._line.quiet:
                self._line.drain(self._line.timeout.seconds)
            replies |= {servo_id: ServoReply(sample, at_s) for servo_id, sample in samples.items()}
        return replies

    def read_troubled(self, now_s: float) -> dict[int, ServoReply]:
        """Read the group, and one of those who are out of it; who is missing gave no good answer.

        Raises:
            BusLost: the port is gone.
        """
        replies: dict[int, ServoReply] = {}
        together, due = self.poll_list.group, self.poll_list.due(now_s)
        self._until_s = inf
        if together:
            window = self._together.next()
            for asked in self._line.family.asked_together(together):
                if self._line.port.now_s() < self._until_s:
                    self._read(asked, replies, now_s, self._together, window)
        if due is not None and self._line.port.now_s() < self._until_s:
            self._read((due,), replies, now_s, self._alone, self._alone.next())
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
        # Who has been silent already is not worth the reserve.
        reserve = turns is self._together
        raw, at_s = self._line.exchange(group.request, group.reply_length, reserve)
        # The whole read has one time limit, that of its first exchange at its most patient.
        self._until_s = min(self._until_s, self._line.whole_s + self._line.most_s)
        self._save(group, raw, at_s, replies, now_s, turns)

    def _group(self, ids: tuple[int, ...], window: ReadWindow) -> GroupRead:
        """Return the prepared exchange for some servos."""
        if ids is not self._prepared_ids:
            self._prepared_ids, self._prepared = ids, {}
        group = self._prepared.get(id(window))
        if group is None:
            group = self._prepared[id(window)] = self._prepare(ids, window)
        return group

    def _prepare(self, ids: tuple[int, ...], window: ReadWindow) -> GroupRead:
        """Return the exchange for some servos, made once."""
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
        return group

    def _save(
        self,
        group: GroupRead,
        raw: bytes,
        at_s: float,
        replies: dict[int, ServoReply],
        now_s: float,
        turns: WindowSchedule,
    ) -> None:
        """Save what is right of an answer; ask again those who lost theirs through another."""
        while True:
            raw = self._line.complete(raw, group.missing, self._line.deadline_s)
            samples, damaged, unproved, stray = group.pieces(raw)
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
            if not samples and not damaged and self._header in raw:
                self._line.lateness.late_answer(now_s)  # that of an earlier question
            self._blame(damaged, silent, now_s, turns)
            done = replies.keys() | damaged | frozenset(silent)
            left = tuple(servo_id for servo_id in group.ids if servo_id not in done)
            if not left or self._line.port.now_s() >= self._until_s:
                return
            group = self._group(left, turns.next())
            raw, at_s = self._line.exchange(group.request, group.reply_length)

    def _blame(
        self, damaged: Collection[int], silent: Collection[int], now_s: float, turns: WindowSchedule
    ) -> None:
        """Record who failed; what still comes must not be taken for the next answer."""
        line, polled = self._line, self.poll_list
        if damaged:
            line.lateness.forget()  # noise looks late, too
        for servo_id in damaged:
            line.errors["corrupt"] += 1
            polled.damaged(servo_id, now_s)
        for servo_id in silent:
            line.errors["timeout"] += 1
            polled.silent(servo_id, now_s)
        turns.trouble(now_s)
        if not line.quiet and line.drain(line.timeout.seconds):
            line.timeout.missed()


class SyncRead:
    """A sync read, one status a servo; of one servo a plain read where there is no other.

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
        self.whole, self.columns = answer.values, answer.columns
        self.reply_length, self.covers_torque = answer.length, "torque" in window.fields

    def missing(self, raw: bytes) -> int:
        """Count the bytes still to come."""
        codec, count, length = self._codec, len(self.ids), self.window.length
        missing = codec.bytes_missing(raw, count, length)
        if missing:
            return missing
        # Repeated statuses, echoes, and others' than asked for, are not those waited for.
        found = codec.statuses(raw)
        fits = {s.id for s in found if len(s.params) == length or s.error & codec.REFUSAL}
        there = len(fits.intersection(self.ids))
        return codec.bytes_missing(raw, len(found) + count - there, length)

    def pieces(self, raw: bytes) -> PartialReply:
        """Return what can be proved right.

        Servos answer in the order asked. Where an answer is missing, one in the place of another
        servo's proves nothing: that servo may have lost its id, and the right answer its header.
        """
        samples: dict[int, Sample] = {}
        damaged, twofold, in_place = set[int](), set[int](), set[int]()
        begin = len(self.request) if raw.startswith(self.request) else 0  # an echo
        stray = len(raw)
        for status in self._codec.statuses(raw):
            stray -= status.intact * (len(status.params) + self._codec.STATUS_OVERHEAD)
            if status.id not in self.ids:
                continue
            place = begin + self.ids.index(status.id) * self._size
            if status.intact and abs(status.at - place) < self._size // 2:
                in_place.add(status.id)
            if not status.intact:
                damaged.add(status.id)
            elif len(status.params) == self.window.length:
                sample = self.window.sample(status.error, status.params)
                # Twice the same is an echo; two that differ cannot both be this servo's.
                if samples.setdefault(status.id, sample) != sample:
                    twofold.add(status.id)
            elif not status.params and status.error & self._codec.REFUSAL:
                samples[status.id] = Sample(status.error)
            else:
                # An answer, but not what was asked for: late, or the servo is out of its mind.
                damaged.add(status.id)
        missing = len(samples) < len(self.ids)
        unproved = samples.keys() - in_place if missing else set[int]()
        for servo_id in twofold | unproved:
            del samples[servo_id]
        damaged = (damaged | twofold) - samples.keys()
        return PartialReply(
            samples, frozenset(damaged), frozenset(unproved - damaged), missing and stray > 0
        )
