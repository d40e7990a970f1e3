"""Several servo buses as one: joints of one rig on several ports, of several kinds."""

from collections import Counter
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from itertools import chain
from typing import NamedTuple

from gazerig.drivers.bus.goal_limits import clip_goals
from gazerig.drivers.errors import BusLost, DriverError
from gazerig.drivers.plugins import describe_error
from gazerig.drivers.types import BusHealth, Feedback, ServoBus, ServoConfig


class BusShare(NamedTuple):
    """One of the buses, with its name in messages.

    servo_indices: index of each of its servos in the whole rig
    """

    name: str
    bus: ServoBus
    servo_indices: tuple[int, ...]


class MultiBus:
    """Buses that are opened, read, written and released together; implements ServoBus.

    While one port is lost, the servos of the others are read and moved as usual. A bus that gives
    up ends the run for all buses.

    Args:
        shares: Together they contain every index from 0 on exactly once.
        setups: All servos of the rig, to whose limits goals are clipped.
    """

    def __init__(self, shares: Sequence[BusShare], setups: Sequence[ServoConfig]) -> None:
        self._shares = tuple(shares)
        self._buses = tuple(share.bus for share in shares)
        self._lowest = [setup.min_steps for setup in setups]
        self._highest = [setup.max_steps for setup in setups]
        given = [place for share in shares for place in share.servo_indices]
        # Position of each of the rig's servos among those of the buses, one after the other.
        self._order = sorted(range(len(given)), key=given.__getitem__)

    def open(self) -> None:
        """Open every bus; if one cannot be opened, close those opened before it."""
        with ExitStack() as opened:
            for bus in self._buses:
                bus.open()
                opened.callback(bus.close)
            opened.pop_all()

    def read(self, now_s: float) -> Feedback:
        """Read all servos of all buses."""
        feedbacks, lost = list[Feedback](), list[BusLost]()
        for share in self._shares:
            try:
                feedbacks.append(share.bus.read(now_s))
            except BusLost as error:  # the others are still read, so that they may reconnect
                lost.append(error)
        if lost:
            raise lost[0]
        columns = [tuple(chain.from_iterable(parts)) for parts in zip(*feedbacks, strict=True)]
        ordered = [tuple([column[i] for i in self._order]) for column in columns[:-1]]
        missing = [
            share.servo_indices[i]
            for share, feedback in zip(self._shares, feedbacks, strict=True)
            for i in feedback.missing
        ]
        return Feedback._make((*ordered, tuple(sorted(missing))))

    def enable_torque(self) -> tuple[int, ...]:
        """Switch torque on, bus by bus, and return the goals; if one refuses, release all again."""
        try:
            goals = [goal for bus in self._buses for goal in bus.enable_torque()]
        except BaseException:
            with suppress(BusLost):
                self.disable_torque()
            raise
        return tuple([goals[i] for i in self._order])

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo; goals are clipped to the limits."""
        goals = clip_goals(goals_steps, self._lowest, self._highest)
        for _, bus, indices in self._shares:
            bus.write([goals[place] for place in indices])

    def faults(self) -> tuple[str, ...]:
        """Return the present servo faults, one line each."""
        return tuple(fault for bus in self._buses for fault in bus.faults())

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        return tuple(event for bus in self._buses for event in bus.events())

    def disable_torque(self) -> None:
        """Switch torque off on every bus, even if another bus fails.

        Raises:
            BusLost: ports are lost; the message names each.
        """
        lost = []
        for name, bus, _ in self._shares:
            try:
                bus.disable_torque()
            except DriverError as error:
                lost.append(str(error))
            except Exception as error:
                failed = f"torque-off failed ({describe_error(error)}): cut the servo power"
                lost.append(f"{name}: {failed}")
        if lost:
            raise BusLost("; ".join(lost))

    def health(self) -> BusHealth:
        """Return the sums of byte and error counts."""
        sent, received, errors = zip(*(bus.health() for bus in self._buses), strict=True)
        return BusHealth(sum(sent), sum(received), sum(map(Counter, errors), Counter[str]()))

    def close(self) -> None:
        """Close every port, even if another bus fails."""
        with ExitStack() as stack:
            for bus in reversed(self._buses):
                stack.callback(bus.close)
