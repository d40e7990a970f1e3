"""What an emulated STS servo watches over: voltage, temperature, current, overload.

Looked at every 20 ms of its own time, so the result does not depend on how often it is asked.
Voltage and temperature are flagged as long as they are wrong; overcurrent and overload
stay until something ends them. What a heavy load is no document says, duty or torque; here it
is torque, as a motor at full speed has all the duty and no load. ``overload_share`` and
``overload_s`` of Physics mean nothing here: registers say so.
Source: Feetech, memory table of the STS series, registers 13-15, 28, 34-38 and 65.
"""

from typing import NamedTuple

from drivers.feetech.memory_table import FeetechModel
from sim_mock.feetech.memory import FeetechMemory
from sim_mock.feetech.motor import CURRENT_UNIT_A
from sim_mock.smart_servo.physics import Physics
from sim_mock.smart_servo.protection import LOOK_MS as LOOK_MS
from sim_mock.smart_servo.protection import LOOK_S, warmed

TIME_UNIT_S = 0.01

VOLTAGE, ANGLE, HEAT, CURRENT, OVERLOAD = 1, 2, 4, 8, 32
"""Bits of Status (65), of every status packet, and of Unload Conditions (19)."""


class Limits(NamedTuple):
    """The registers that matter, in their units, times in looks."""

    hottest: int
    highest: int
    lowest: int
    current: int
    current_looks: float
    overload: int
    overload_looks: float


class FeetechProtection:
    """Temperature of the motor, and what is wrong.

    status: bits of register 65
    ambient_c: degC, may be changed at any time
    """

    def __init__(self, model: FeetechModel, physics: Physics, memory: FeetechMemory) -> None:
        self._model = model
        self._physics = physics
        self._memory = memory
        self.ambient_c = self.temperature_c = physics.ambient_c
        self.restart()

    def restart(self) -> None:
        """Forget all but the heat."""
        self.status = 0
        self._heavy_looks = self._strong_looks = 0
        self.settle()

    def settle(self) -> None:
        """Take over what the registers say now."""
        get = self._memory.get
        per_unit = TIME_UNIT_S / LOOK_S
        self._limits = Limits(
            get("temperature_limit"),
            get("max_voltage"),
            get("min_voltage"),
            get("protection_current"),
            get("overcurrent_time") * per_unit,
            get("overload_torque"),
            get("protection_time") * per_unit,
        )

    def look(self, effort: float, volts: float, looks: int = 1) -> None:
        """Go on by 20 ms, or so many times that, at this torque and voltage (shares)."""
        physics, limits = self._physics, self._limits
        to_c = self.ambient_c + physics.stall_rise_c * effort * effort
        self.temperature_c = warmed(self.temperature_c, to_c, physics.thermal_s, looks)
        self._flag(HEAT, self.temperature_c > limits.hottest)
        tenths = volts * self._model.rated_v * 10.0
        self._flag(VOLTAGE, not limits.lowest - 0.5 <= tenths <= limits.highest + 0.5)
        effort = abs(effort)
        amps = effort * self._model.stall_current_a
        heavy = effort > 0.0 and effort * 100.0 >= limits.overload * volts - 1e-9
        self._heavy_looks = self._heavy_looks + looks if heavy else 0
        strong = amps > limits.current * CURRENT_UNIT_A
        self._strong_looks = self._strong_looks + looks if strong else 0
        if self._heavy_looks and self._heavy_looks >= limits.overload_looks:
            self.status |= OVERLOAD
        if self._strong_looks and self._strong_looks >= limits.current_looks:
            self.status |= CURRENT

    def _flag(self, bit: int, wrong: bool) -> None:
        self.status = self.status | bit if wrong else self.status & ~bit

    def end(self, bit: int) -> None:
        """End what was wrong, and begin to count anew."""
        self.status &= ~bit
        self._heavy_looks = self._strong_looks = 0

    @property
    def steady(self) -> bool:
        """Tell whether looking again changes nothing but what the motor does."""
        return not self._heavy_looks and not self._strong_looks

    def browned_out(self, volts: float) -> bool:
        """Tell whether the voltage (a share) is too low for the servo to run."""
        return volts < self._physics.brown_out_share
