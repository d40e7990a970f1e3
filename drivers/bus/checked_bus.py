"""Checked servo bus of another package; each error becomes one line that names the bus."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from itertools import chain
from math import isfinite
from typing import Any, TypeVar

from gazerig.drivers.errors import BusLost, DriverError, PluginError
from gazerig.drivers.event_log import EventLog, RateLimitedLog
from gazerig.drivers.plugins import describe_error
from gazerig.drivers.process.bounded_call import BoundedCall, CallResult
from gazerig.drivers.types import BusHealth, Feedback, ServoBus, ServoConfig

T = TypeVar("T")

_COLUMNS = 10  # of Feedback, all but the indices of the missing
_NUMBERS = 4  # the first of them are numbers that must be finite

_USUAL_S, _BLOCKED_S = 2.0, 0.2
"""Longest wait for a call, real seconds; the second value applies while an earlier call has not
returned.
"""
_LONGEST_S: Mapping[str, float] = {"open": 60.0, "enable_torque": 20.0, "disable_torque": 10.0}
"""Calls that may take longer."""


class CheckedBus:
    """Implements ``ServoBus`` over the bus of a package.

    A servo whose position, speed, load or time is not finite counts as missing. A result that is
    not the feedback of all servos ends the run with torque off, as a lost port does. So does a call
    that does not return; the guardian or the servos' watchdog then switches torque off.

    Args:
        bus: The package's bus.
        label: Name of the bus in messages.
        setups: Its servos.
        now_s: Returns monotonic seconds, to find reads that take longer than a tick.
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
        self._call, self._blocked = BoundedCall(label, _USUAL_S), False
        self._log = EventLog()
        self._seldom = RateLimitedLog(self._log)
        self._last_s: float | None = None

    def open(self) -> None:
        """Open the bus.

        Raises:
            SetupError: raised by the bus itself.
            PluginError: the bus raises any other error.
        """
        outcome = self._call_in_order(self._bus.open, "open")
        if outcome is None:
            raise PluginError(f"{self._label} has not opened within {_LONGEST_S['open']:g} s")
        if isinstance(outcome.error, DriverError):
            raise outcome.error
        if (error := outcome.error) is not None:
            raise PluginError(f"{self._label} cannot be opened: {outcome.error_text}") from error

    def read(self, now_s: float) -> Feedback:
        """Read all servos.

        Raises:
            BusLost: the port is gone, or the package fails.
        """
        began_s = self._now_s() if self._now_s is not None else 0.0
        feedback = self._checked_call(lambda: self._bus.read(now_s), "read")
        if self._now_s is not None:
            # A slow read leaves no time for the rest of the tick.
            took_s = self._now_s() - began_s
            period_s = now_s - self._last_s if self._last_s is not None else None
            self._last_s = now_s
            if period_s is not None and took_s > 0.9 * period_s:
                text = f"{self._label}: a read took {took_s * 1e3:.0f} ms, as long as a tick"
                self._seldom.add(f"{text}: lower loop.rate_hz", now_s, "slow")
        if not isinstance(feedback, Feedback):
            raise BusLost(
                f"{self._label}: read returned a {type(feedback).__name__}, wanted Feedback"
            )
        try:
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
            names = ", ".join(self._setups[i].label() for i in sorted(wrong))
            text = f"{self._label}: no finite position, speed, load or time of {names}: taken as missing"
            self._seldom.add(text, now_s, "not finite")
            empty = Feedback.create_missing(self._count)
            columns = [
                tuple([none[i] if i in wrong else column[i] for i in range(self._count)])
                for column, none in zip(feedback[:_COLUMNS], empty[:_COLUMNS], strict=True)
            ]
            return Feedback._make((*columns, tuple(sorted(missing | wrong))))
        except (TypeError, ValueError) as error:
            raise BusLost(
                f"{self._label}: read returned no feedback: {describe_error(error)}"
            ) from error

    def enable_torque(self) -> tuple[int, ...]:
        """Switch torque on at the present positions.

        Raises:
            BusLost: the package fails or does not return a goal for every servo.
        """
        goals: Any = self._checked_call(self._bus.enable_torque, "enable_torque")
        if isinstance(goals, Sequence) and len(goals) == self._count:
            pairs = list(zip(goals, self._setups, strict=True))
            if all(isinstance(g, int) and s.min_steps <= g <= s.max_steps for g, s in pairs):
                return tuple(goals)
        with suppress(BusLost):
            self.disable_torque()
        raise BusLost(
            f"{self._label}: enable_torque returned no goal within limits for every servo"
        )

    def write(self, goals_steps: Sequence[int]) -> None:
        """Send one goal to every servo; goals are always clipped here.

        Raises:
            ValueError: a goal is not a number, or their number is wrong.
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
        self._checked_call(lambda: self._bus.write(clipped), "write")

    def faults(self) -> tuple[str, ...]:
        """Return the latched servo faults, one line each."""
        return self._checked_call(lambda: tuple(map(str, self._bus.faults())), "faults")

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call."""
        events = self._checked_call(lambda: tuple(map(str, self._bus.events())), "events")
        return (*self._log.drain(), *events)

    def retune(self, setups: Sequence[ServoConfig]) -> None:
        """Store setups for the next time torque is switched on.

        Raises:
            ValueError: the servos are not the same.
        """
        same = [(s.id, s.model) for s in setups] == [(s.id, s.model) for s in self._setups]
        if not same:
            raise ValueError("ids and models must not change: create another bus for other servos")
        outcome = self._call_in_order(lambda: self._bus.retune(setups), "retune")
        if outcome is not None and outcome.error is not None:
            raise outcome.error

    def disable_torque(self) -> None:
        """Switch torque off on every servo.

        Raises:
            BusLost: the port is gone, or the package fails.
        """
        self._checked_call(self._bus.disable_torque, "disable_torque", "cut the servo power")

    def health(self) -> BusHealth:
        """Return byte and error counts."""
        health: Any = self._checked_call(self._bus.health, "health")
        return health if isinstance(health, BusHealth) else BusHealth(0, 0, {})

    def close(self) -> None:
        """Close the port; safe to call twice."""
        outcome = self._call_in_order(self._bus.close, "close")
        if outcome is None:
            self._log.add(f"{self._label} does not close: it is abandoned")
        elif outcome.error is not None:
            self._log.add(f"{self._label} failed while it was closed ({outcome.error_text})")
        self._call.close()
        self._call, self._blocked = BoundedCall(self._label, _USUAL_S), False

    def _checked_call(self, call: Callable[[], T], name: str, remedy: str = "") -> T:
        outcome = self._call_in_order(call, name)
        hint = f": {remedy}" if remedy else ""
        if outcome is None:
            raise BusLost(f"{self._label}: {name} does not return{hint}")
        if isinstance(outcome.error, DriverError):
            raise outcome.error
        if (error := outcome.error) is not None:
            raise BusLost(f"{self._label}: {name} failed ({outcome.error_text}){hint}") from error
        value: T = outcome.value
        return value

    def _call_in_order(self, call: Callable[[], object], name: str) -> CallResult | None:
        """Make a call after all earlier ones; return None if any of them does not return."""
        longest_s = _BLOCKED_S if self._blocked else _LONGEST_S.get(name, _USUAL_S)
        outcome = self._call.call_in_order(call, longest_s)
        self._blocked = outcome is None
        return outcome
