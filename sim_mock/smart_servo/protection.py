"""What an emulated servo watches over: temperature, load, input voltage.

Looked at every 20 ms of its own time, so the result does not depend on how often it is
asked. Thresholds and times that no data sheet tells are in sim_mock.smart_servo.physics.
"""

from drivers.dynamixel.control_table import HARDWARE_ERRORS, Model
from sim_mock.smart_servo.physics import Physics

LOOK_MS = 20
LOOK_S = LOOK_MS / 1000.0

BITS = {name: bit for bit, name in HARDWARE_ERRORS.items()}


def warmed(now_c: float, final_c: float, thermal_s: float, looks: int) -> float:
    """Return the temperature of a motor after some looks; up to a minute as one by one."""
    share = LOOK_S / thermal_s
    if looks * LOOK_S > 60.0:
        return final_c + (now_c - final_c) * (1.0 - share) ** looks
    for _ in range(looks):
        now_c += (final_c - now_c) * share
    return now_c


class Protection:
    """Temperature of the motor and how long it has been overloaded.

    ambient_c: degC, may be changed at any time
    """

    def __init__(self, model: Model, physics: Physics) -> None:
        self._model = model
        self._physics = physics
        self.ambient_c = physics.ambient_c
        self.temperature_c = physics.ambient_c
        self._overloaded_looks = 0

    def restart(self) -> None:
        """Forget the load; the heat stays."""
        self._overloaded_looks = 0

    def look(
        self, effort: float, volts: float, limits: tuple[int, int, int], looks: int = 1
    ) -> int:
        """Go on by 20 ms at this torque and voltage (shares); gives bits of register 70.

        limits: registers 31, 32 and 34 (degC, 0.1 V, 0.1 V).
        looks: go on by so many times 20 ms at once
        """
        physics = self._physics
        target = self.ambient_c + physics.stall_rise_c * effort * effort
        self.temperature_c = warmed(self.temperature_c, target, physics.thermal_s, looks)
        too_much = abs(effort) >= physics.overload_share * volts and effort != 0.0
        self._overloaded_looks = self._overloaded_looks + looks if too_much else 0
        hottest, highest, lowest = limits
        tenths = volts * self._model.rated_v * 10.0
        bits = 0
        if self._overloaded_looks * LOOK_S >= physics.overload_s:
            bits |= 1 << BITS["overload"]
        if self.temperature_c > hottest:
            bits |= 1 << BITS["overheating"]
        if tenths > highest + 0.5 or tenths < lowest - 0.5:
            bits |= 1 << BITS["input voltage"]
        return bits

    @property
    def steady(self) -> bool:
        """Tell whether looking again changes nothing but what the motor does."""
        return self._overloaded_looks == 0

    def browned_out(self, volts: float) -> bool:
        """Tell whether the voltage (a share) is too low for the servo to run."""
        return volts < self._physics.brown_out_share
