"""What is known of all servos of a bus, column by column, from one exchange to the next."""

from collections.abc import Sequence
from typing import TypeVar

from gazerig.drivers.plausibility import Plausibility
from gazerig.drivers.types import Feedback, ServoSetup

Value = TypeVar("Value")


class FeedbackColumns:
    """Columns of the exchange that is being taken; state that is read in turn is kept.

    A family's own class fills them in from register units.

    Args:
        fastest_steps_s: speed of each servo's motor without load.

    places: which positions can be true
    """

    def __init__(self, fastest_steps_s: Sequence[float]) -> None:
        self.places = Plausibility(fastest_steps_s)
        self._none = none = Feedback.of_none(len(fastest_steps_s))
        self._torque, self._fault = none.torque, none.fault
        self._temperature, self._voltage = none.temperature_c, none.voltage_v
        self._rearmed: set[int] = set()
        self.begin()

    def begin(self) -> None:
        """Start an exchange in which no servo has answered yet."""
        none = self._none
        self._position, self._velocity = none.position_steps, none.velocity_steps_s
        self._load, self._at_s = none.load, none.at_s
        self._missing = none.missing
        self._rearmed.clear()

    def _take_all(
        self,
        position: tuple[float, ...],
        velocity: tuple[float, ...],
        load: tuple[float, ...],
        at_s: float,
    ) -> None:
        """Take an exchange that all servos have answered."""
        self._position, self._velocity, self._load = position, velocity, load
        self._at_s, self._missing = (at_s,) * len(position), ()
        if self._rearmed:
            self._rearmed.clear()

    def _take_one(
        self, slot: int, position: float, velocity: float, load: float, at_s: float
    ) -> None:
        """Take one servo's answer."""
        self._position = with_value(self._position, slot, position)
        self._velocity = with_value(self._velocity, slot, velocity)
        self._load = with_value(self._load, slot, load)
        self._at_s = with_value(self._at_s, slot, at_s)
        self._missing = tuple([other for other in self._missing if other != slot])

    def feedback(self) -> Feedback:
        """Return all columns as they are now."""
        none, rearmed = self._none, self._rearmed
        return Feedback(
            self._position,
            self._velocity,
            self._load,
            self._at_s,
            self._temperature,
            self._voltage,
            self._torque,
            self._fault,
            none.measured,
            tuple([i in rearmed for i in range(len(self._at_s))]) if rearmed else none.rearmed,
            self._missing,
        )

    def set_limits(self, setups: Sequence[ServoSetup]) -> None:
        """Take other ranges for the same servos; most families' positions do not need them."""

    # --- one servo

    def position(self, slot: int) -> float | None:
        """Return where a servo is, None where it has not answered in this exchange."""
        return None if slot in self._missing else self._position[slot]

    def mark_rearmed(self, slot: int) -> None:
        """Mark a servo's answer: plans begin where it is."""
        self._rearmed.add(slot)

    def name_fault(self, slot: int, fault: str) -> None:
        """Record what a servo suffers from, "" for nothing."""
        self._fault = with_value(self._fault, slot, fault)

    def set_torque(self, slot: int, on: bool) -> None:
        """Record whether a servo's torque is on."""
        self._torque = with_value(self._torque, slot, on)

    def expect_torque(self, on: bool) -> None:
        """Record that the torque has been switched for all."""
        self._torque = (on,) * len(self._torque)

    def hold(self, slot: int, position: int, at_s: float, torque: bool) -> None:
        """Take the place of a servo that was just set up again and stands still."""
        self.set_torque(slot, torque)
        self.places.place(slot, position, at_s)
        self._take_one(slot, position, 0.0, 0.0, at_s)


def with_value(column: tuple[Value, ...], slot: int, value: Value) -> tuple[Value, ...]:
    """Return a column in which one servo has another value."""
    return (*column[:slot], value, *column[slot + 1 :])
