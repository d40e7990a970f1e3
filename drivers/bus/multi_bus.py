"""Several servo buses as one: joints of one rig on several ports, of several kinds."""

from collections import Counter
from collections.abc import Collection, Sequence
from contextlib import ExitStack, suppress
from itertools import chain
from math import inf, isfinite
from operator import itemgetter
from typing import Any, NamedTuple

from gazerig.drivers.errors import BusLost, DriverError
from gazerig.drivers.event_log import EventLog, RateLimitedLog
from gazerig.drivers.plugins import describe_error
from gazerig.drivers.types import BusHealth, Feedback, LimpableBus, ServoBus, ServoConfig

IN_A_ROW = 3
"""Consecutive reads without any answer after which a bus is read less often."""

AGAIN_S = 0.2
"""Time between reads of a bus of which no servo answers. Each costs its whole time-out, usually 20
ms, and the servos of the other buses wait for their goals meanwhile."""


class BusShare(NamedTuple):
    """One of the buses: its name and its servos.

    servo_indices: index of each of its servos in the whole rig
    label: name of another package's bus in messages, "" for ours
    setups: servos of another package's bus, whose goals are clipped and whose readings are checked
    """

    name: str
    bus: ServoBus
    servo_indices: tuple[int, ...]
    label: str = ""
    setups: tuple[ServoConfig, ...] = ()


class _PollTimer:
    """Schedule of the reads of a bus: every tick, but rarely while no servo on it answers."""

    def __init__(self) -> None:
        self._in_vain, self._due_s = 0, -inf

    def is_due(self, now_s: float) -> bool:
        """Return whether it must be read now."""
        return now_s >= self._due_s

    def update(self, feedback: Feedback, now_s: float) -> None:
        """Record the feedback of a read."""
        if len(feedback.missing) < len(feedback.at_s):
            self._in_vain = 0
            return
        self._in_vain += 1
        if self._in_vain >= IN_A_ROW:
            self._due_s = now_s + AGAIN_S


class MultiBus:
    """Buses that are opened, read, written and released together; implements ServoBus.

    Events and faults of one bus do not affect the others: while one port is lost, the servos of the
    others are read and moved as usual. A bus that gives up ends the run for all buses, as a head
    must not continue to move when part of it no longer responds.

    Args:
        shares: Together they contain every index from 0 on exactly once.

    Raises:
        ValueError: an index is absent or occurs twice.
    """

    def __init__(self, shares: Sequence[BusShare]) -> None:
        self._shares = list(shares)
        self._log = EventLog()
        self._seldom = RateLimitedLog(self._log)
        self._timers = [_PollTimer() for _ in self._shares]
        places = sorted(place for share in shares for place in share.servo_indices)
        if places != list(range(len(places))):
            raise ValueError(
                f"buses cover the indices {places}: each index from 0 on must occur once"
            )
        self._count = len(places)
        given = [place for share in shares for place in share.servo_indices]
        order = sorted(range(len(given)), key=given.__getitem__)
        # None if the buses' servos are already in the order of the rig.
        self._pick: Any = itemgetter(*order) if order != sorted(order) else None
        self._nothing = [Feedback.create_missing(len(share.servo_indices)) for share in shares]

    def open(self) -> None:
        """Open every bus; if one cannot be opened, close those opened before it.

        Raises:
            PortError: a port cannot be opened.
            ServoMissing: servos are absent or of another model.
        """
        self._timers = [_PollTimer() for _ in self._shares]
        opened: list[BusShare] = []
        try:
            for share in self._shares:
                share.bus.open()
                opened.append(share)
        except BaseException:
            for share in opened:
                share.bus.close()
            raise

    def read(self, now_s: float) -> Feedback:
        """Read all servos of all buses.

        A bus without any answer is read only five times a second until a servo answers, so that the
        servos of the other buses do not wait for it.

        Raises:
            BusLost: no servo of a bus has answered for longer than its ``give_up_s``, or a bus
                returned no feedback.
        """
        feedbacks = list(self._nothing)
        lost: list[BusLost] = []
        for i, (share, timer) in enumerate(zip(self._shares, self._timers, strict=True)):
            if not timer.is_due(now_s):
                continue
            try:
                feedbacks[i] = share.bus.read(now_s)
                if share.label:
                    feedbacks[i] = self._require_finite(feedbacks[i], share, now_s)
            except BusLost as error:  # the others are still read, so that they may reconnect
                lost.append(error)
                continue
            timer.update(feedbacks[i], now_s)
        if lost:
            raise lost[0]
        columns = [tuple(chain.from_iterable(parts)) for parts in zip(*feedbacks, strict=True)]
        missing = list[int]()
        if columns.pop():
            for share, feedback in zip(self._shares, feedbacks, strict=True):
                missing += [share.servo_indices[i] for i in feedback.missing]
        ordered = columns if self._pick is None else map(self._pick, columns)
        return Feedback._make((*ordered, tuple(sorted(missing))))

    def enable_torque(self) -> tuple[int, ...]:
        """Switch torque on, bus by bus; if one refuses, release all again.

        Returns:
            The goals that are now active, in steps.

        Raises:
            DriverError: raised by the bus at fault.
        """
        goals = [0] * self._count
        try:
            for share in self._shares:
                places = share.servo_indices
                for place, goal in zip(places, share.bus.enable_torque(), strict=True):
                    goals[place] = goal
        except BaseException:
            with suppress(BusLost):
                self.disable_torque()
            raise
        return tuple(goals)

    def set_limp(self, servos: Collection[int]) -> None:
        """Switch torque off on these servos; all others that were limp get it again."""
        for share in self._shares:
            if isinstance(share.bus, LimpableBus):
                here = enumerate(share.servo_indices)
                share.bus.set_limp([k for k, place in here if place in servos])

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo; goals are clipped to the limits.

        Raises:
            ValueError: a goal is not a number, or their number is wrong.
        """
        if len(goals_steps) != self._count:
            raise ValueError(f"{len(goals_steps)} goals for {self._count} servos")
        for goal in goals_steps:
            if goal != goal:  # checked before any bus sends its goals
                raise ValueError(
                    "a goal is not a number: every goal must be a whole number of steps"
                )
        for share in self._shares:
            goals = [goals_steps[place] for place in share.servo_indices]
            if share.label:
                goals = [
                    round(min(max(goal, setup.min_steps), setup.max_steps))
                    for goal, setup in zip(goals, share.setups, strict=True)
                ]
            share.bus.write(goals)

    def faults(self) -> tuple[str, ...]:
        """Return the latched servo faults, one line each."""
        return tuple(fault for share in self._shares for fault in share.bus.faults())

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        events = [event for share in self._shares for event in share.bus.events()]
        return (*self._log.drain(), *events)

    def retune(self, setups: Sequence[ServoConfig]) -> None:
        """Store setups for the next time torque is switched on.

        Raises:
            ValueError: the servos are not the same.
        """
        if len(setups) != self._count:
            raise ValueError("ids and models must not change: create another bus for other servos")
        for i, share in enumerate(self._shares):
            own = tuple([setups[place] for place in share.servo_indices])
            share.bus.retune(own)
            self._shares[i] = share._replace(setups=own)

    def disable_torque(self) -> None:
        """Switch torque off on every bus, even if another bus fails.

        Raises:
            BusLost: ports are lost; the message names each.
        """
        lost = []
        for share in self._shares:
            try:
                share.bus.disable_torque()
            except DriverError as error:
                lost.append(str(error))
            except Exception as error:
                failed = f"torque-off failed ({describe_error(error)}): cut the servo power"
                lost.append(f"{share.label or share.name}: {failed}")
        if lost:
            raise BusLost("; ".join(lost))

    def health(self) -> BusHealth:
        """Return the sums of byte and error counts."""
        each = [share.bus.health() for share in self._shares]
        errors: Counter[str] = Counter()
        for health in each:
            errors.update(health.errors)
        return BusHealth(sum(h.tx_bytes for h in each), sum(h.rx_bytes for h in each), errors)

    def close(self) -> None:
        """Close every port, even if another bus fails."""
        with ExitStack() as stack:
            for share in reversed(self._shares):
                stack.callback(share.bus.close)

    def _require_finite(self, feedback: Feedback, share: BusShare, now_s: float) -> Feedback:
        """Return the feedback of another package's bus; servos without finite values are missing.

        Raises:
            BusLost: it is not the feedback of the bus's servos.
        """
        count = len(share.servo_indices)
        if not isinstance(feedback, Feedback) or {*map(len, feedback[:-1])} != {count}:
            raise BusLost(f"{share.label}: read returned no feedback of {count} servos")
        numbers = feedback[:4]
        if all(map(isfinite, chain.from_iterable(numbers))):
            return feedback
        wrong = {
            i
            for i in range(count)
            if i not in feedback.missing and not all([isfinite(column[i]) for column in numbers])
        }
        if not wrong:
            return feedback
        names = ", ".join(share.setups[i].label() for i in sorted(wrong))
        text = f"{share.label}: no finite position, speed, load or time of {names}"
        self._seldom.add(f"{text}: taken as missing", now_s, share.name)
        columns = [
            tuple([none[i] if i in wrong else column[i] for i in range(count)])
            for column, none in zip(feedback[:-1], Feedback.create_missing(count)[:-1], strict=True)
        ]
        return Feedback._make((*columns, tuple(sorted(wrong.union(feedback.missing)))))
