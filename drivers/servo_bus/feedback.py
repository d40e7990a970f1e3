"""Feedback columns of all servos of a bus, updated by each exchange.

A weak checksum (a sum of one byte) sometimes misses damage in two places. So a position that no
joint can have reached since the last one is rejected (``gazerig.drivers.bus.plausibility``), and on
a disturbed line every answer must be confirmed by a second one.
"""

from collections.abc import Collection, Mapping, Sequence
from operator import mul
from typing import TypeVar

from gazerig.drivers.bus.plausibility import Plausibility
from gazerig.drivers.servo_bus.family import Family
from gazerig.drivers.servo_bus.read_plan import Expected, GroupRead
from gazerig.drivers.servo_bus.sync_read import ServoReply
from gazerig.drivers.types import Feedback, ServoConfig


def nearest_turn(steps: int, low: int, high: int, turn: int) -> int:
    """Return the position with whole turns added so that it is nearest to the range low..high.

    The encoder measures the position within one turn. A joint whose range is near the encoder's
    zero can be on the other side of it, at 4090 instead of -6, and a servo that counts turns may
    have counted some while torque was off. The joint gets the position nearest to its range. The
    servo itself would move in the other direction, which must be prevented.
    """
    if low <= steps <= high:
        return steps
    above = low + (steps - low) % turn
    below = above - turn
    if above <= high or above - high < low - below:
        return above
    if above - high > low - below:
        return below
    # Both are equally far: the servo's own count decides if it is one of them.
    return below if steps < low else above


ALIKE_C, ALIKE_TENTH_V = 3, 10
"""Largest difference of temperature and voltage between two consecutive answers."""

EQUAL_C, EQUAL_TENTH_V = 1, 1
"""Largest difference at which both count as equal; above it neither value is used."""

MOST_CELSIUS = 125
"""Highest valid temperature."""

_SIGNED = ("position", "velocity", "effort")

Value = TypeVar("Value")


class FeedbackColumns:
    """Columns of the current exchange; values that are read in rotation are kept.

    places: plausibility check of positions
    now: all columns at present
    """

    def __init__(self, family: Family, setups: Sequence[ServoConfig]) -> None:
        models = [family.models[setup.model] for setup in setups]
        self._family = family
        self._ids = tuple(setup.id for setup in setups)
        self._velocity_unit = family.velocity_unit_steps_s
        self._velocity_units = (self._velocity_unit,) * len(setups)
        self._load_units = tuple(model.load_unit for model in models)
        self._turn = family.steps_per_turn if family.single_turn else 0
        self._signs = [1 << family.sign_bits[name] for name in _SIGNED if family.sign_bits]
        self._engaged, self._limp = False, frozenset[int]()
        self.places = Plausibility([model.no_load_steps_s for model in models])
        self._none = self.now = Feedback.create_missing(len(setups))
        self._tenth_volts: tuple[int, ...] = ()
        self.set_limits(setups)

    def begin(self) -> None:
        """Start an exchange in which no servo has answered yet."""
        now = self.now
        self.now = self._none._replace(
            temperature_c=now.temperature_c,
            voltage_v=now.voltage_v,
            torque=now.torque,
            fault=now.fault,
        )

    def _apply_one(
        self, slot: int, position: float, velocity: float, load: float, at_s: float
    ) -> None:
        """Apply one servo's feedback."""
        now = self.now
        self.now = now._replace(
            position_steps=replace_value(now.position_steps, slot, position),
            velocity_steps_s=replace_value(now.velocity_steps_s, slot, velocity),
            load=replace_value(now.load, slot, load),
            at_s=replace_value(now.at_s, slot, at_s),
            missing=tuple([other for other in now.missing if other != slot]),
        )

    def set_limits(self, setups: Sequence[ServoConfig]) -> None:
        """Set changed ranges and limits of the same servos."""
        self._ranges = [(setup.min_steps, setup.max_steps) for setup in setups]
        # Within half a turn of every range, no other turn is nearer.
        self._near_low = max((high for _, high in self._ranges), default=0) - self._turn // 2 + 1
        self._near_high = min((low for low, _ in self._ranges), default=0) + self._turn // 2 - 1
        armed = [self._family.armed_values(setup) for setup in setups]
        self._limits = {name: [one[name] for one in armed] for name in armed[0]} if armed else {}
        self._expect()

    def _expect(self) -> None:
        """Set the expected answers of healthy servos: torque as switched, limits as armed."""
        self._torque = tuple(
            [self._engaged and slot not in self._limp for slot in range(len(self._ids))]
        )
        armed = self._limits if self._engaged else {}
        self._expected: Expected = {"torque": tuple(map(int, self._torque)), **armed}

    # --- an answer of all servos

    def apply_whole(self, group: GroupRead, raw: bytes, at_s: float) -> bool:
        """Apply an answer of all servos that contains only measurements and no errors.

        Args:
            group: Read that it answers.
            raw: Bytes of the answer.
            at_s: Time of its arrival, seconds.

        Returns:
            Whether it was applied; if not, it must be checked servo by servo.
        """
        values = group.parse_whole(raw, self._expected)
        if values is None:
            return False
        now = self.now
        at_position, at_velocity, at_effort, at_temperature, at_voltage = group.columns
        position, velocity, effort = values[at_position], values[at_velocity], values[at_effort]
        if self._signs:
            of_position, of_velocity, of_effort = self._signs
            if max(position) >= of_position:
                position = _to_signed(position, of_position)
            if max(velocity) >= of_velocity:
                velocity = _to_signed(velocity, of_velocity)
            if max(effort) >= of_effort:
                effort = _to_signed(effort, of_effort)
        # Without torque a zero may come from an indirect block without addresses.
        if not self._engaged and 0 in position and group.covers_torque:
            return False
        if self._turn and (min(position) < self._near_low or max(position) > self._near_high):
            position = tuple(
                [
                    nearest_turn(p, low, high, self._turn)
                    for p, (low, high) in zip(position, self._ranges, strict=True)
                ]
            )
        warm, volts = now.temperature_c, now.voltage_v
        if at_temperature is not None and (celsius := values[at_temperature]) != warm:
            if max(celsius) > MOST_CELSIUS:
                return False
            warm = celsius
        if not self.places.are_plausible(position, at_s):
            return False
        if at_voltage is not None and (tenths := values[at_voltage]) != self._tenth_volts:
            self._tenth_volts, volts = tenths, tuple([0.1 * one for one in tenths])
        load = tuple(map(mul, effort, self._load_units))
        if max(load) > 1.0 or min(load) < -1.0:
            load = tuple([max(-1.0, min(1.0, share)) for share in load])
        torque = self._torque if group.covers_torque else now.torque
        # Faster than a call of the class, whose __new__ is a Python function.
        self.now = tuple.__new__(
            Feedback,
            (
                position, tuple(map(mul, velocity, self._velocity_units)), load,
                (at_s,) * len(position), warm, volts, torque, now.fault,
                self._none.measured, self._none.rearmed, (),
            ),
        )  # fmt: skip
        return True

    # --- answers servo by servo

    def are_all_plausible(self, replies: Mapping[int, ServoReply]) -> bool:
        """Return whether all servos have answered plausibly in one exchange."""
        if len(replies) < len(self._ids):
            return False
        answers = [replies[i] for i in self._ids]
        at_s = answers[0].at_s
        if self.places.is_disturbed(at_s) or any(one.at_s != at_s for one in answers):
            return False
        return self.places.are_plausible(
            [self._nearest_turn(slot, one.sample.position) for slot, one in enumerate(answers)],
            at_s,
        )

    def is_plausible(self, slot: int, reply: ServoReply) -> bool:
        """Return whether one servo's answer is plausible; call it once for every answer."""
        return self.places.is_plausible(
            slot, self._nearest_turn(slot, reply.sample.position), reply.at_s
        )

    def confirm(self, slot: int, first: ServoReply, second: ServoReply) -> ServoReply | None:
        """Return the values that two consecutive answers agree on, None if they differ."""
        one, other = first.sample, second.sample
        warmer = abs((one.temperature or 0) - (other.temperature or 0))
        stronger = abs((one.voltage or 0) - (other.voltage or 0))
        alike = (
            warmer <= ALIKE_C
            and stronger <= ALIKE_TENTH_V
            and self.places.agree(
                slot,
                other.position - one.position,
                second.at_s - first.at_s,
                [one.velocity * self._velocity_unit, other.velocity * self._velocity_unit],
            )
        )
        if not alike:
            return None
        # The mean of both; of values without another check, the smaller.
        return first._replace(
            sample=one._replace(
                error=one.error & other.error,
                status=(one.status or 0) & (other.status or 0),
                position=(one.position + other.position) // 2,
                velocity=min(one.velocity, other.velocity, key=abs),
                effort=min(one.effort, other.effort, key=abs),
                temperature=one.temperature if warmer <= EQUAL_C else None,
                voltage=one.voltage if stronger <= EQUAL_TENTH_V else None,
            )
        )

    def apply_reply(self, slot: int, reply: ServoReply) -> None:
        """Apply one servo's accepted answer."""
        sample = reply.sample
        if sample.torque is not None:
            self.set_torque(slot, sample.torque == 1)
        if not sample.is_blank:
            warm = sample.temperature
            if warm is not None and warm <= MOST_CELSIUS:
                self._set_temperature(slot, warm)
            if sample.voltage is not None:
                self._set_voltage(slot, sample.voltage)
        load = max(-1.0, min(1.0, sample.effort * self._load_units[slot]))
        position = self._nearest_turn(slot, sample.position)
        self._apply_one(slot, position, sample.velocity * self._velocity_unit, load, reply.at_s)

    def _nearest_turn(self, slot: int, position: int) -> int:
        """Return a position with whole turns added if turns are ambiguous."""
        return nearest_turn(position, *self._ranges[slot], self._turn) if self._turn else position

    # --- one servo

    def position(self, slot: int) -> float | None:
        """Return a servo's position, None if it has not answered in this exchange."""
        return None if slot in self.now.missing else self.now.position_steps[slot]

    def mark_rearmed(self, slot: int) -> None:
        """Mark a servo's answer: plans must begin at its position."""
        self.now = self.now._replace(rearmed=replace_value(self.now.rearmed, slot, True))

    def record_fault(self, slot: int, fault: str) -> None:
        """Record a servo's fault, "" for none."""
        self.now = self.now._replace(fault=replace_value(self.now.fault, slot, fault))

    def set_torque(self, slot: int, on: bool) -> None:
        """Record whether a servo's torque is on."""
        self.now = self.now._replace(torque=replace_value(self.now.torque, slot, on))

    def expect_torque(self, on: bool) -> None:
        """Record that torque has been switched for all servos."""
        self._engaged, self._limp = on, frozenset()
        self._expect()
        self.now = self.now._replace(torque=self._torque)

    def expect_limp(self, slots: Collection[int]) -> None:
        """Record which servos have no torque while the others have it."""
        self._limp = frozenset(slots)
        self._expect()
        self.now = self.now._replace(torque=self._torque)

    def set_climate(self, slot: int, tenth_volts: int, temperature_c: int) -> None:
        """Record a servo's voltage and temperature."""
        self._set_voltage(slot, tenth_volts)
        self._set_temperature(slot, temperature_c)

    def _set_voltage(self, slot: int, tenth_volts: int) -> None:
        self._tenth_volts = ()
        volts = replace_value(self.now.voltage_v, slot, 0.1 * tenth_volts)
        self.now = self.now._replace(voltage_v=volts)

    def _set_temperature(self, slot: int, celsius: float) -> None:
        warm = replace_value(self.now.temperature_c, slot, celsius)
        self.now = self.now._replace(temperature_c=warm)

    def hold(self, slot: int, position: int, at_s: float, torque: bool) -> None:
        """Set the position of a servo that was just recovered and does not move."""
        near = self._nearest_turn(slot, position)
        self.set_torque(slot, torque)
        self.places.record(slot, near, at_s)
        self._apply_one(slot, near, 0.0, 0.0, at_s)


def replace_value(column: tuple[Value, ...], slot: int, value: Value) -> tuple[Value, ...]:
    """Return a column with a new value for one servo."""
    return (*column[:slot], value, *column[slot + 1 :])


def _to_signed(column: tuple[int, ...], sign: int) -> tuple[int, ...]:
    """Return signed values of a column whose sign bit has the value ``sign``."""
    return tuple([value if value < sign else sign - value for value in column])
