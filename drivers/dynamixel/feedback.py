"""From register units to what the rest of the machine is given, with what was last known."""

from collections.abc import Sequence
from math import copysign

from gazerig.drivers.dynamixel.control_table import MODELS, VELOCITY_UNIT_STEPS_S
from gazerig.drivers.dynamixel.protocol import ALERT
from gazerig.drivers.dynamixel.read_windows import Sample
from gazerig.drivers.plausibility import Plausibility
from gazerig.drivers.servo_bus.sync_read import Heard, Whole
from gazerig.drivers.types import ServoReading, ServoSetup

_new = tuple.__new__


class Readings:
    """Makes readings; keeps torque, fault, temperature and voltage from one to the next.

    places: which positions can be true
    """

    def __init__(self, setups: Sequence[ServoSetup]) -> None:
        models = [MODELS[setup.model] for setup in setups]
        self._units_ma = tuple(model.current_unit_ma for model in models)
        # Models without a current sensor report load in 0.1 %.
        self._units_load = tuple(
            model.current_unit_ma / (1000.0 * model.stall_current_a)
            if model.current_unit_ma
            else 0.001
            for model in models
        )
        count = len(models)
        self.places = Plausibility([model.no_load_steps_s for model in models])
        self._torque: list[bool] = [False] * count
        self._fault: list[str] = [""] * count
        self._warm: Sequence[float | None] = [None] * count
        self._volts: Sequence[float | None] = [None] * count
        self._engaged = False
        self._armed: tuple[int, ...] = (0,) * count

    def set_limits(self, setups: Sequence[ServoSetup]) -> None:
        """Take other limits for the same servos: positions do not depend on them."""

    def expect_torque(self, on: bool) -> None:
        """Note that the torque has been switched for all."""
        self._engaged = on
        self._armed = (int(on),) * len(self._torque)
        self._torque = [on] * len(self._torque)

    def name_fault(self, slot: int, fault: str) -> None:
        """Note what a servo suffers from, "" for nothing."""
        self._fault[slot] = fault

    def torque(self, slot: int, on: int) -> None:
        """Note a servo's torque."""
        self._torque[slot] = bool(on)

    def climate(self, slot: int, tenth_volts: int, temperature_c: int) -> None:
        """Note a servo's voltage and temperature."""
        self._volts = [*self._volts[:slot], 0.1 * tenth_volts, *self._volts[slot + 1 :]]
        self._warm = [*self._warm[:slot], float(temperature_c), *self._warm[slot + 1 :]]

    def whole(self, answer: Whole[Sample]) -> list[ServoReading | None] | None:
        """Take an answer in which nothing is amiss; None where anything must be looked at."""
        values, at, at_s = answer.values, answer.group.columns, answer.at_s
        positions = values[at.position]
        if any(values[at.error]):
            return None
        if at.torque is not None and at.hardware_error is not None:
            if values[at.torque] != self._armed or any(values[at.hardware_error]):
                return None
            # Without torque a zero may be that of an indirect block without addresses.
            if not self._engaged and 0 in positions:
                return None
            self._torque = [self._engaged] * len(positions)
        if not self.places.whole(positions, at_s):
            return None
        if at.temperature is not None:
            self._warm = values[at.temperature]
        if at.voltage is not None:
            self._volts = [0.1 * tenths for tenths in values[at.voltage]]
        unit = VELOCITY_UNIT_STEPS_S
        # One tuple a servo and no call: this runs every tick.
        return [
            _new(
                ServoReading,
                (
                    p,
                    v * unit,
                    c * ma,
                    at_s,
                    False,
                    on,
                    fault,
                    share if -1.0 <= (share := c * load) <= 1.0 else copysign(1.0, share),
                    t,
                    u,
                    False,
                    True,
                ),
            )
            for p, v, c, ma, load, on, fault, t, u in zip(
                positions,
                values[at.velocity],
                values[at.current],
                self._units_ma,
                self._units_load,
                self._torque,
                self._fault,
                self._warm,
                self._volts,
                strict=True,
            )
        ]

    def believes(self, slot: int, heard: Heard[Sample]) -> bool:
        """Return whether one servo's answer can be true; to be asked once for every answer."""
        return self.places.one(slot, heard.sample.position, heard.at_s)

    def one(self, slot: int, heard: Heard[Sample]) -> ServoReading:
        """Take one servo's answer, which was not refused."""
        sample = heard.sample
        if sample.torque is not None:
            self._torque[slot] = bool(sample.torque)
        if sample.temperature is not None and not sample.blank:
            self._warm = [*self._warm[:slot], sample.temperature, *self._warm[slot + 1 :]]
        if sample.voltage is not None and not sample.blank:
            self._volts = [*self._volts[:slot], 0.1 * sample.voltage, *self._volts[slot + 1 :]]
        return self._make(
            slot,
            sample.position,
            sample.velocity * VELOCITY_UNIT_STEPS_S,
            sample.current,
            heard.at_s,
            bool(sample.error & ALERT),
        )

    def held(self, slot: int, position: int, at_s: float, torque: bool) -> ServoReading:
        """Make the first reading of a servo that was just set up again and stands still."""
        self._torque[slot] = torque
        self.places.place(slot, position, at_s)
        return self._make(slot, position, 0.0, 0, at_s, False)

    def _make(
        self, slot: int, position: int, velocity: float, current: int, at_s: float, alert: bool
    ) -> ServoReading:
        return ServoReading(
            position,
            velocity,
            current * self._units_ma[slot],
            at_s,
            alert,
            self._torque[slot],
            self._fault[slot],
            max(-1.0, min(1.0, current * self._units_load[slot])),
            self._warm[slot],
            self._volts[slot],
        )
