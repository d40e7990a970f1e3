"""Protections of an emulated servo: temperature, load, current, input voltage.

They are checked every 20 ms of the servo's time, so the result does not depend on how often it is
read. A heavy load is torque, not duty: a motor at full speed has full duty and no load.
"""

from math import inf
from typing import NamedTuple

from gazerig.sim_mock.smart_servo.physics import Motor, Physics

CHECK_MS = 20
CHECK_S = CHECK_MS / 1000.0

VOLTAGE, HEAT, CURRENT, OVERLOAD = 1, 4, 8, 32
"""Bits of the errors, as in the registers of the servos that have them."""


class Limits(NamedTuple):
    """Limits of a servo's protections.

    hottest_c: degC; highest_01v, lowest_01v: 0.1 V
    overload_share: share of the stall torque at the present voltage; overload_s: its duration
    current_a, current_s: limit of the current and its duration
    """

    hottest_c: int
    highest_01v: int
    lowest_01v: int
    overload_share: float
    overload_s: float
    current_a: float = inf
    current_s: float = inf


def temperature_after(now_c: float, final_c: float, thermal_s: float, checks: int) -> float:
    """Return the temperature of a motor after some checks; up to a minute as one by one."""
    share = CHECK_S / thermal_s
    if checks * CHECK_S > 60.0:
        return final_c + (now_c - final_c) * (1.0 - share) ** checks
    for _ in range(checks):
        now_c += (final_c - now_c) * share
    return now_c


class ServoProtection:
    """Temperature of the motor and duration of its overload.

    ambient_c: degC, may be changed at any time
    """

    def __init__(self, model: Motor, physics: Physics, limits: Limits) -> None:
        self._model = model
        self._physics = physics
        self.limits = limits
        self.ambient_c = physics.ambient_c
        self.temperature_c = physics.ambient_c
        self._heavy_checks = self._strong_checks = 0

    def restart(self) -> None:
        """Reset the counts of load and current; the temperature stays."""
        self._heavy_checks = self._strong_checks = 0

    def check(self, effort: float, volts: float, checks: int = 1) -> int:
        """Return the error bits after another 20 ms at this torque and voltage (shares).

        checks: advance by this number of times 20 ms in one step
        """
        physics = self._physics
        hottest_c, highest, lowest, heavy_share, heavy_s, current_a, current_s = self.limits
        target = self.ambient_c + physics.stall_rise_c * effort * effort
        if checks == 1:
            self.temperature_c += (target - self.temperature_c) * (CHECK_S / physics.thermal_s)
        else:
            self.temperature_c = temperature_after(
                self.temperature_c, target, physics.thermal_s, checks
            )
        effort = abs(effort)
        bits = 0
        if effort > 0.0 and effort >= heavy_share * volts - 1e-11:
            self._heavy_checks += checks
            if self._heavy_checks * CHECK_S >= heavy_s:
                bits |= OVERLOAD
        else:
            self._heavy_checks = 0
        if effort * self._model.stall_current_a > current_a:
            self._strong_checks += checks
            if self._strong_checks * CHECK_S >= current_s:
                bits |= CURRENT
        else:
            self._strong_checks = 0
        if self.temperature_c > hottest_c:
            bits |= HEAT
        if not lowest - 0.5 <= volts * self._model.rated_v * 10.0 <= highest + 0.5:
            bits |= VOLTAGE
        return bits

    @property
    def is_steady(self) -> bool:
        """Return whether further checks change nothing unless the motor changes."""
        return not self._heavy_checks and not self._strong_checks

    def is_browned_out(self, volts: float) -> bool:
        """Return whether the voltage (a share) is too low for the servo to run."""
        return volts < self._physics.brown_out_share
