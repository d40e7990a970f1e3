"""Feedback columns of all servos of a bus, updated by each exchange.

The checksum of an answer misses some damage, so a position that no joint can have reached since the
last one is rejected (``gazerig.drivers.bus.plausibility``).
"""

from collections.abc import Mapping, Sequence
from operator import mul
from typing import Any

from gazerig.drivers.bus.plausibility import Plausibility
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.sync_read import GroupRead, ServoReply
from gazerig.drivers.types import Feedback, ServoConfig

MOST_CELSIUS = 125
"""Highest valid temperature."""


class FeedbackColumns:
    """Columns of the current exchange; values that are read in rotation are kept.

    places: plausibility check of positions
    now: all columns at present
    """

    def __init__(self, family: Family, setups: Sequence[ServoConfig]) -> None:
        models = [family.models[setup.model] for setup in setups]
        self._velocity_unit = family.velocity_unit_steps_s
        self._velocity_units = (self._velocity_unit,) * len(setups)
        self._load_units = tuple(model.load_unit for model in models)
        self._signs = [1 << sign for sign in family.window.signs]
        self.places = Plausibility([model.no_load_steps_s for model in models])
        self._none = self.now = Feedback.create_missing(len(setups))
        self._tenth_volts: tuple[int, ...] = ()

    def begin(self) -> None:
        """Start an exchange in which no servo has answered yet."""
        now = self.now
        self.now = self._none._replace(
            temperature_c=now.temperature_c,
            voltage_v=now.voltage_v,
            torque=now.torque,
            fault=now.fault,
        )

    def apply_whole(self, group: GroupRead, raw: bytes, at_s: float) -> bool:
        """Apply an answer of all servos that contains only measurements and no errors.

        Args:
            group: Read that it answers.
            raw: The received bytes.
            at_s: Time of their arrival, seconds.

        Returns:
            Whether it was applied; if not, it must be taken servo by servo.
        """
        values = group.parse_whole(raw)
        if values is None or at_s < self.places.disturbed_until_s:
            return False
        now = self.now
        at_position, at_velocity, at_effort, at_voltage, at_temperature = group.columns
        position, velocity, effort = values[at_position], values[at_velocity], values[at_effort]
        if self._signs:
            of_position, of_velocity, of_effort = self._signs
            if max(position) >= of_position:
                position = _to_signed(position, of_position)
            if max(velocity) >= of_velocity:
                velocity = _to_signed(velocity, of_velocity)
            if max(effort) >= of_effort:
                effort = _to_signed(effort, of_effort)
        times_s = (at_s,) * len(position)
        if not self.places.are_plausible(position, times_s):
            return False
        warm, volts = now.temperature_c, now.voltage_v
        if at_temperature is not None and (celsius := values[at_temperature]) != warm:
            if max(celsius) > MOST_CELSIUS:
                return False
            warm = celsius
        if at_voltage is not None and (tenths := values[at_voltage]) != self._tenth_volts:
            self._tenth_volts, volts = tenths, tuple([0.1 * one for one in tenths])
        load = tuple(map(mul, effort, self._load_units))
        if max(load) > 1.0 or min(load) < -1.0:
            load = tuple([max(-1.0, min(1.0, share)) for share in load])
        # Faster than a call of the class, whose __new__ is a Python function.
        self.now = tuple.__new__(
            Feedback,
            (
                position, tuple(map(mul, velocity, self._velocity_units)), load,
                times_s, warm, volts, now.torque, now.fault,
                self._none.measured, self._none.rearmed, (),
            ),
        )  # fmt: skip
        return True

    def apply_reply(self, slot: int, reply: ServoReply) -> bool:
        """Apply one servo's answer; return False if its position is not plausible."""
        values = reply.values
        if not self.places.is_plausible(slot, values["position"], reply.at_s):
            return False
        self.set(
            slot,
            position_steps=values["position"],
            velocity_steps_s=values["velocity"] * self._velocity_unit,
            load=max(-1.0, min(1.0, values["effort"] * self._load_units[slot])),
            at_s=reply.at_s,
        )
        if "voltage" in values:
            self._set_climate(slot, values["voltage"], values["temperature"])
        return True

    def apply_polled(self, slot: int, values: Mapping[str, int]) -> None:
        """Apply registers of one servo, by name, that are read at intervals."""
        if "torque_enable" in values:
            self.set(slot, torque=values["torque_enable"] == 1)
        if "present_temperature" in values:
            self._set_climate(slot, values["present_input_voltage"], values["present_temperature"])

    def set(self, slot: int, **values: Any) -> None:
        """Set a servo's values by column; one with the time of an answer is no longer missing."""
        columns: dict[str, tuple[Any, ...]] = {
            name: _replace_value(getattr(self.now, name), slot, value)
            for name, value in values.items()
            if getattr(self.now, name)[slot] != value
        }
        if "at_s" in values:
            columns["missing"] = tuple([other for other in self.now.missing if other != slot])
        if columns:
            self.now = self.now._replace(**columns)

    def expect_torque(self, on: bool) -> None:
        """Record that torque has been switched for all servos."""
        self.now = self.now._replace(torque=(on,) * len(self.now.torque))

    def _set_climate(self, slot: int, voltage: int, temperature: int) -> None:
        self._tenth_volts = ()
        self.set(slot, voltage_v=0.1 * voltage)
        if temperature <= MOST_CELSIUS:
            self.set(slot, temperature_c=temperature)

    def hold(self, slot: int, position: int, at_s: float, torque: bool) -> None:
        """Set the position of a servo that was just set up and does not move."""
        self.places.record(slot, position, at_s)
        still = {"velocity_steps_s": 0.0, "load": 0.0}
        self.set(slot, torque=torque, position_steps=position, at_s=at_s, **still)


def _replace_value(column: tuple[Any, ...], slot: int, value: Any) -> tuple[Any, ...]:
    return (*column[:slot], value, *column[slot + 1 :])


def _to_signed(column: Sequence[int], sign: int) -> tuple[int, ...]:
    """Return signed values of a column whose sign bit has the value ``sign``."""
    return tuple([value if value < sign else sign - value for value in column])
