"""From register units to what the rest of the machine is given, with what was last known."""

from collections.abc import Sequence

from gazerig.drivers.dynamixel.control_table import MODELS, VELOCITY_UNIT_STEPS_S
from gazerig.drivers.dynamixel.read_windows import Sample
from gazerig.drivers.servo_bus.feedback import FeedbackColumns, with_value
from gazerig.drivers.servo_bus.sync_read import Heard, Whole
from gazerig.drivers.types import ServoSetup


class DynamixelFeedback(FeedbackColumns):
    """Feedback from answers of Dynamixel servos."""

    def __init__(self, setups: Sequence[ServoSetup]) -> None:
        models = [MODELS[setup.model] for setup in setups]
        # Models without a current sensor report load in 0.1 %.
        self._units_load = tuple(
            model.current_unit_ma / (1000.0 * model.stall_current_a)
            if model.current_unit_ma
            else 0.001
            for model in models
        )
        self._engaged = False
        self._armed: tuple[int, ...] = (0,) * len(models)
        super().__init__([model.no_load_steps_s for model in models])

    def expect_torque(self, on: bool) -> None:
        """Record that the torque has been switched for all."""
        super().expect_torque(on)
        self._engaged = on
        self._armed = (int(on),) * len(self._torque)

    def set_climate(self, slot: int, tenth_volts: int, temperature_c: int) -> None:
        """Record a servo's voltage and temperature."""
        self._voltage = with_value(self._voltage, slot, 0.1 * tenth_volts)
        self._temperature = with_value(self._temperature, slot, float(temperature_c))

    def take_whole(self, answer: Whole[Sample]) -> bool:
        """Take an answer in which nothing is amiss; False where anything must be looked at."""
        values, at, at_s = answer.values, answer.group.columns, answer.at_s
        positions = values[at.position]
        if any(values[at.error]):
            return False
        if at.torque is not None and at.hardware_error is not None:
            if values[at.torque] != self._armed or any(values[at.hardware_error]):
                return False
            # Without torque a zero may be that of an indirect block without addresses.
            if not self._engaged and 0 in positions:
                return False
            self._torque = (self._engaged,) * len(positions)
        if not self.places.whole(positions, at_s):
            return False
        if at.temperature is not None:
            self._temperature = values[at.temperature]
        if at.voltage is not None:
            self._voltage = tuple([0.1 * tenths for tenths in values[at.voltage]])
        unit = VELOCITY_UNIT_STEPS_S
        loads = [c * load for c, load in zip(values[at.current], self._units_load, strict=True)]
        if max(loads) > 1.0 or min(loads) < -1.0:
            loads = [max(-1.0, min(1.0, load)) for load in loads]
        self._take_all(
            positions, tuple([v * unit for v in values[at.velocity]]), tuple(loads), at_s
        )
        return True

    def believes(self, slot: int, heard: Heard[Sample]) -> bool:
        """Return whether one servo's answer can be true; to be asked once for every answer."""
        return self.places.one(slot, heard.sample.position, heard.at_s)

    def take(self, slot: int, heard: Heard[Sample]) -> None:
        """Take one servo's answer, which was not refused."""
        sample = heard.sample
        if sample.torque is not None:
            self.set_torque(slot, bool(sample.torque))
        if sample.temperature is not None and not sample.blank:
            self._temperature = with_value(self._temperature, slot, sample.temperature)
        if sample.voltage is not None and not sample.blank:
            self._voltage = with_value(self._voltage, slot, 0.1 * sample.voltage)
        load = max(-1.0, min(1.0, sample.current * self._units_load[slot]))
        velocity = sample.velocity * VELOCITY_UNIT_STEPS_S
        self._take_one(slot, sample.position, velocity, load, heard.at_s)
