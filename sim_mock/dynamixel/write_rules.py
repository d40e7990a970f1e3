"""Writes that an emulated servo permits: EEPROM lock, modes, limits, tripped watchdog."""

from gazerig.drivers.dynamixel.control_table import EEPROM_END, DynamixelModel, DynamixelRegister
from gazerig.sim_mock.dynamixel.drive import TRIPPED, DynamixelDrive
from gazerig.sim_mock.dynamixel.memory import (
    ACCESS,
    DATA_LIMIT,
    DATA_RANGE,
    DynamixelMemory,
    Fields,
)
from gazerig.sim_mock.dynamixel.modes import POSITION, modes_of

GOALS = ("goal_pwm", "goal_current", "goal_velocity", "goal_position")
MULTI_TURN_STEPS = 1_048_575
WATCHDOG_AT = 98


class WriteRules:
    """Decides which writes are permitted, from table and state; changes nothing.

    goal_range: permitted goal positions
    """

    def __init__(
        self, memory: DynamixelMemory, model: DynamixelModel, drive: DynamixelDrive
    ) -> None:
        self._memory = memory
        self._modes = modes_of(model)
        self._drive = drive
        self.goal_range = (0, 0)

    def apply_settings(self) -> None:
        """Apply the present register values."""
        get = self._memory.get
        self.goal_range = -MULTI_TURN_STEPS, MULTI_TURN_STEPS
        if self._drive.mode == POSITION:
            self.goal_range = get("min_position_limit"), get("max_position_limit")

    def permitted(self, address: int, data: bytes) -> Fields | int:
        """Return the registers of a write, or the error number."""
        fields = self._memory.fields(address, data)
        if isinstance(fields, int):
            return fields
        for register, value in fields:
            error = self._refusal(register, value)
            if error:
                return error
        return fields

    def goal_error(self, goal: int) -> int:
        """Return the error number for a goal position, 0 if it may be written."""
        if self._memory.bytes[WATCHDOG_AT] == TRIPPED:
            return DATA_RANGE
        low, high = self.goal_range
        return 0 if low <= goal <= high else DATA_LIMIT

    def _refusal(self, register: DynamixelRegister, value: int) -> int:
        name = register.name
        if register.address < EEPROM_END:
            if self._drive.torque:
                return ACCESS
            unknown = name == "operating_mode" and value not in self._modes
            return DATA_RANGE if unknown else 0
        if name == "goal_position":
            return self.goal_error(value)
        if name in GOALS:
            if self._memory.bytes[WATCHDOG_AT] == TRIPPED:
                return DATA_RANGE
            limit = self._memory.get(name.replace("goal_", "") + "_limit")
            return 0 if -limit <= value <= limit else DATA_LIMIT
        return 0
