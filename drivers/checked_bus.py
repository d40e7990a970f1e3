"""A servo bus of another package: what it returns is checked, what it raises is one named line."""

from collections.abc import Callable, Sequence
from itertools import chain
from math import isfinite
from typing import Any, TypeVar

from gazerig.drivers.errors import BusLost, DriverError
from gazerig.drivers.event_log import EventLog, RateLimitedLog, servo_label
from gazerig.drivers.plugins import PluginError, failure
from gazerig.drivers.types import BusHealth, Feedback, ServoBus, ServoConfig

T = TypeVar("T")

_COLUMNS = 10  # of Feedback, all but the indices of the missing
_NUMBERS = 4  # of them the first are numbers that must be finite


class CheckedBus:
    """Implements ``ServoBus`` over the bus of a package.

    A servo whose position, speed, load or time is not finite counts as missing. What is no
    feedback of all servos ends the run, with torque off, as a lost port does.

    Args:
        bus: of the package.
        label: the bus as messages name it.
        setups: its servos.
        now_s: monotonic seconds, to find reads that take longer than a tick.
    """

    def __init__(
        self,
        bus: ServoBus,
        label: str,
        setups: Sequence[ServoConfig],
        now_s: Callable[[], float] | None = None,
    ) -> None:
        self._bus, self._label, self._setups = bus, label, tuple(setups)
        self._count, self._now_s = len(self._setups), now_s
        self._log = EventLog()
        self._seldom = RateLimitedLog(self._log)
        self._last_s: float | None = None

    def open(self) -> None:
        """Open the bus.

        Raises:
            SetupError: it says itself why it cannot.
            PluginError: it fails.
        """
        try:
            self._bus.open()
        except DriverError:
            raise
        except Exception as error:
            raise PluginError(f"{self._label} cannot be opened: {failure(error)}") from error

    def read(self, now_s: float) -> Feedback:
        """Read all servos.

        Raises:
            BusLost: the port is gone, or the package fails.
        """
        began_s = self._now_s() if self._now_s is not None else 0.0
        feedback = self._tried(lambda: self._bus.read(now_s), "read")
        if self._now_s is not None:
            self._time(self._now_s() - began_s, now_s)
        if not isinstance(feedback, Feedback):
            raise BusLost(
                f"{self._label}: read returned a {type(feedback).__name__}, wanted Feedback"
            )
        try:
            return self._sound(feedback, now_s)
        except (TypeError, ValueError) as error:
            raise BusLost(f"{self._label}: read returned no feedback: {failure(error)}") from error

    def _time(self, took_s: float, now_s: float) -> None:
        """Report a read that left no time for the rest of the tick."""
        period_s = now_s - self._last_s if self._last_s is not None else None
        self._last_s = now_s
        if period_s is not None and took_s > 0.9 * period_s:
            text = f"{self._label}: a read took {took_s * 1e3:.0f} ms, as long as a tick"
            self._seldom.add(f"{text}: lower loop.rate_hz", now_s, "slow")

    def _sound(self, feedback: Feedback, now_s: float) -> Feedback:
        for name, column in zip(Feedback._fields[:_COLUMNS], feedback[:_COLUMNS], strict=True):
            if len(column) != self._count:
                raise ValueError(f"{len(column)} values of {name} for {self._count} servos")
        numbers: tuple[Any, ...] = feedback[:_NUMBERS]
        if not feedback.missing and all(map(isfinite, chain.from_iterable(numbers))):
            return feedback
        missing = set(feedback.missing)
        if not missing <= set(range(self._count)):
            raise ValueError(f"missing {sorted(missing)} of {self._count} servos")
        wrong = {
            i
            for i in range(self._count)
            if i not in missing and not all([isfinite(column[i]) for column in numbers])
        }
        if not wrong:
            return feedback
        names = ", ".join(servo_label(self._setups[i]) for i in sorted(wrong))
        text = (
            f"{self._label}: no finite position, speed, load or time of {names}: taken as missing"
        )
        self._seldom.add(text, now_s, "not finite")
        empty = Feedback.of_none(self._count)
        columns = [
            tuple([none[i] if i in wrong else column[i] for i in range(self._count)])
            for column, none in zip(feedback[:_COLUMNS], empty[:_COLUMNS], strict=True)
        ]
        return Feedback._make((*columns, tuple(sorted(missing | wrong))))

    def enable_torque(self) -> tuple[int, ...]:
        """Switch torque on where the servos are.

        Raises:
            BusLost: the package fails, or returns no goal for every servo.
        """
        goals: Any = self._tried(self._bus.enable_torque, "enable_torque")
        if isinstance(goals, Sequence) and len(goals) == self._count:
            pairs = list(zip(goals, self._setups, strict=True))
            if all(isinstance(g, int) and s.min_steps <= g <= s.max_steps for g, s in pairs):
                return tuple(goals)
        self._release_quietly()
        raise BusLost(
            f"{self._label}: enable_torque returned no goal within limits for every servo"
        )

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo; goals are clipped here, whatever the package does.

        Raises:
            ValueError: a goal is not a number, or there are not as many as servos.
            BusLost: the package fails.
        """
        if len(goals_steps) != self._count:
            raise ValueError(f"{len(goals_steps)} goals for {self._count} servos")
        if any([goal != goal for goal in goals_steps]):
            raise ValueError("a goal is not a number: every goal must be a whole number of steps")
        clipped = [
            round(min(max(goal, setup.min_steps), setup.max_steps))
            for goal, setup in zip(goals_steps, self._setups, strict=True)
        ]
        self._tried(lambda: self._bus.write(clipped), "write")

    def faults(self) -> tuple[str, ...]:
        """Name every latched servo fault found so far."""
        return tuple(map(str, self._tried(self._bus.faults, "faults")))

    def events(self) -> tuple[str, ...]:
        """Return what happened since the last call."""
        return (*self._log.drain(), *map(str, self._tried(self._bus.events, "events")))

    def retune(self, setups: Sequence[ServoConfig]) -> None:
        """Set the servos up so when the torque comes on the next time.

        Raises:
            ValueError: these are other servos.
        """
        same = [(s.id, s.model) for s in setups] == [(s.id, s.model) for s in self._setups]
        if not same:
            raise ValueError("other servos need another bus: ids and models must stay")
        self._bus.retune(setups)

    def disable_torque(self) -> None:
        """Torque off on every servo.

        Raises:
            BusLost: the port is gone, or the package fails.
        """
        self._tried(self._bus.disable_torque, "disable_torque", "cut the servo power")

    def health(self) -> BusHealth:
        """Return byte and error counts."""
        health: Any = self._tried(self._bus.health, "health")
        return health if isinstance(health, BusHealth) else BusHealth(0, 0, {})

    def close(self) -> None:
        """Close the port; safe to call twice."""
        try:
            self._bus.close()
        except Exception as error:
            self._log.add(f"{self._label} failed as it was closed ({failure(error)})")

    def _tried(self, call: Callable[[], T], name: str, remedy: str = "") -> T:
        try:
            return call()
        except DriverError:
            raise
        except Exception as error:
            hint = f": {remedy}" if remedy else ""
            raise BusLost(f"{self._label}: {name} failed ({failure(error)}){hint}") from error

    def _release_quietly(self) -> None:
        try:
            self.disable_torque()
        except BusLost:
            return
