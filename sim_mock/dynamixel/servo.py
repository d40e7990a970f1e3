"""One emulated Dynamixel X servo: its control table, permitted writes, errors and watchdog.

Places, access and ranges are those of the driver's table, as in the e-Manual. It moves in the modes
with a position: 3 and 4 (more than a turn). The other modes can be set, then it does not move;
there are no indirect windows (168 and up). Gains are divided as the ROBOTIS e-Manual documents (P
128, D 16, I 65536). Their units are not documented. Assumed here: positions in steps, speeds in
steps/ms, sums per ms; the output is in units of PWM (885 are 100 %). Registers without any effect:
feed-forward, velocity gains, startup configuration, secondary id, LED; moving status, PWM and the
profile's state read 0.
"""

import struct
from collections.abc import Callable
from math import inf

from gazerig.drivers.dynamixel.control_table import (
    ACCELERATION_UNIT_STEPS_S2,
    BAUD_RATES,
    EEPROM_END,
    FAST_READ_SINCE,
    GAINS,
    MODELS,
    PWM_FULL,
    REGISTERS,
    VELOCITY_UNIT_STEPS_S,
    DynamixelModel,
    Register,
)
from gazerig.sim_mock.smart_servo.memory import ServoMemory
from gazerig.sim_mock.smart_servo.physics import DISABLED, Loop, Motor, ServoSpec
from gazerig.sim_mock.smart_servo.servo import EmulatedServo, Result
from gazerig.sim_mock.smart_servo.shaft import ShaftMaker, create_shaft

INSTRUCTION_ERROR, DATA_RANGE, DATA_LENGTH, DATA_LIMIT, ACCESS = 2, 4, 5, 6, 7
"""Numbers of the status error byte (Protocol 2.0)."""
ALERT = 0x80

SENSED, SENSED_AT = struct.Struct("<hii"), 126
"""Current, velocity, position: a control loop reads them every tick."""
MOTION, MOTION_AT = struct.Struct("<HB"), 120
"""Tick and moving."""
SENSED_END, MOTION_END = 136, 123

GOAL_AT, GOAL_END, WATCHDOG_AT = 116, 120, 98
WATCHDOG_UNIT_MS, TRIPPED = 20, 255
"""Unit of Bus Watchdog, and its value after it has stopped the servo."""

POSITION, EXTENDED = POSITION_MODES = 3, 4

REVERSE = 1
"""Bit of Drive Mode (10)."""
PWM_SLOPE_V_MS = 0.001977, 0.003955
"""Unit of PWM Slope (62) of the models for 5 V and for 12 V."""
MULTI_TURN_STEPS = 1_048_575
_SPEED_UNIT = VELOCITY_UNIT_STEPS_S / 1000.0
_RAMP_UNIT = ACCELERATION_UNIT_STEPS_S2 / 1e6
_IDENTITY = struct.Struct("<HB")

Get = Callable[[str], int]


def control_loop(get: Get, model: DynamixelModel) -> Loop:
    """Return the controller that the registers describe."""
    if get("operating_mode") not in POSITION_MODES:
        return DISABLED
    slew = inf
    if model.series == "x330":
        slew = get("pwm_slope") * PWM_SLOPE_V_MS[model.rated_v > 5.0] / model.rated_v
    return Loop(
        p=get("position_p_gain") / 128.0 / PWM_FULL,
        i=get("position_i_gain") / 65536.0 / PWM_FULL,
        d=get("position_d_gain") / 16.0 / PWM_FULL,
        u_max=min(get("pwm_limit"), abs(get("goal_pwm"))) / PWM_FULL,
        slew=slew,
    )


def registers_of(model: DynamixelModel) -> tuple[Register, ...]:
    """Return a model's registers with its initial values."""
    absent = {"pwm_slope"} if model.series == "x430" else set[str]()
    if model.current_limit is None:
        absent |= {"current_limit", "goal_current"}
    initial: dict[str, int | None] = {
        "model_number": model.number,
        "temperature_limit": model.temperature_limit,
        "max_voltage_limit": model.max_voltage,
        "min_voltage_limit": model.min_voltage,
        "current_limit": model.current_limit,
        "velocity_limit": model.velocity_limit,
        "pwm_slope": 255 if model.name.startswith("xc330-t") else 140,
        "shutdown": model.shutdown,
        **dict(zip(GAINS, model.gains, strict=True)),
    }
    return tuple(
        one._replace(initial=initial.get(one.name, one.initial))
        for one in REGISTERS.values()
        if one.name not in absent
    )


class DynamixelMemory(ServoMemory):
    """One servo's control table."""

    def __init__(self, model: DynamixelModel) -> None:
        registers = registers_of(model)
        super().__init__(registers, max(r.address + r.size for r in registers), EEPROM_END)
        self.by_address = {register.address: register for register in registers}
        self._defined = {r.address + i for r in registers for i in range(r.size)}

    def decode(self, register: Register, data: bytes | bytearray) -> int:
        """Return the value of a register's bytes."""
        return int.from_bytes(data, "little", signed=register.signed)

    def encode(self, register: Register, value: int) -> bytes:
        """Return the value's bytes, in two's complement if it is negative."""
        return (value & (1 << 8 * register.size) - 1).to_bytes(register.size, "little")

    def has(self, address: int, length: int) -> bool:
        """Return whether all these addresses are defined."""
        return bool(length) and self._defined.issuperset(range(address, address + length))

    def fields(self, address: int, data: bytes) -> list[tuple[Register, int]] | int:
        """Split bytes to write into registers with their values, or return the error number."""
        fields, at = list[tuple[Register, int]](), 0
        while at < len(data):
            register = self.by_address.get(address + at)
            if register is None or register.access == "r":
                return ACCESS
            end = at + register.size
            if end > len(data):
                return DATA_LENGTH
            value, low, high = self.decode(register, data[at:end]), register.low, register.high
            if (low is not None and value < low) or (high is not None and value > high):
                return DATA_RANGE
            fields.append((register, value))
            at = end
        return fields or DATA_LENGTH


class DynamixelServo(EmulatedServo):
    """One Dynamixel servo on the chain."""

    restart_ms = 400
    read_level, answer_level = 1, 2
    model: DynamixelModel
    memory: DynamixelMemory

    def __init__(self, spec: ServoSpec, now_ms: int, make_shaft: ShaftMaker = create_shaft) -> None:
        model = self.model = MODELS[spec.model]
        memory = DynamixelMemory(model)
        memory.set("firmware_version", spec.firmware)
        memory.set("id", spec.id)
        memory.set("present_input_voltage", round(model.rated_v * 10.0))
        self.baud_rates = BAUD_RATES[: (memory.registers["baud_rate"].high or 0) + 1]
        self.fast_reads = spec.firmware >= FAST_READ_SINCE[model.series]
        unit = model.current_unit_ma
        # Models without a current sensor report load in 0.1 %.
        self._current_full = model.stall_current_a * 1000.0 / unit if unit else 1000.0
        motor = Motor(model.stall_torque_nm, model.no_load_rpm)
        super().__init__(spec, motor, memory, now_ms, make_shaft)

    def _boot(self) -> None:
        """Reset to power-on."""
        self._mode = self.memory.get("operating_mode")
        super()._boot()
        self._reset_goals()
        self._apply_settings()

    def _reset_goals(self) -> None:
        """Set the goals to their limits, and the goal position to the present position."""
        for name in ("pwm", "current", "velocity"):
            if f"goal_{name}" in self.memory.registers:
                self.memory.set(f"goal_{name}", self.memory.get(f"{name}_limit"))
        self._set_goal_here()

    def _set_controller(self) -> None:
        """Apply the registers of profile, gains and limits."""
        get = self.memory.get
        self._goal_range = -MULTI_TURN_STEPS, MULTI_TURN_STEPS
        if self._mode == POSITION:
            self._goal_range = get("min_position_limit"), get("max_position_limit")
        self._follows = self.torque and self._mode in POSITION_MODES
        self._speed = get("profile_velocity") * _SPEED_UNIT
        self._ramp = get("profile_acceleration") * _RAMP_UNIT
        self.shaft.drive(control_loop(get, self.model) if self.torque else DISABLED)

    def identity(self) -> bytes:
        """Return model number and firmware."""
        return _IDENTITY.pack(self.model.number, self.spec.firmware)

    # --- motion

    def _origin(self) -> tuple[int, int]:
        offset = self.memory.get("homing_offset")
        return -1 if self.memory.get("drive_mode") & REVERSE else 1, offset

    def _follow(self) -> None:
        if self._follows:
            goal = self._side * (self.memory.get("goal_position") - self._shift)
            self.shaft.lead_to(float(goal), self._speed, self._ramp)

    def _trip(self) -> None:
        """Stop as the bus watchdog does; goals are refused until 98 is cleared."""
        self.memory.bytes[WATCHDOG_AT] = TRIPPED
        self.shaft.hold()

    # --- reading

    def read(self, address: int, length: int) -> Result:
        """Return bytes of the control table, or an error number."""
        shaft, side, end = self.shaft, self._side, address + length
        current = round(side * shaft.effort * self._current_full)
        sensed = current, round(side * shaft.v / _SPEED_UNIT), round(side * shaft.x + self._shift)
        if address == SENSED_AT and end == SENSED_END:
            return 0, SENSED.pack(*sensed)  # a control loop reads them every tick
        memory, into = self.memory, self.memory.bytes
        if not memory.has(address, length):
            return ACCESS, b""
        SENSED.pack_into(into, SENSED_AT, *sensed)
        if address < MOTION_END and end > MOTION_AT:
            fast = abs(shaft.v / _SPEED_UNIT) > memory.get("moving_threshold")
            tick = self._ms - self._booted_ms & 0x7FFF
            MOTION.pack_into(into, MOTION_AT, tick, fast or (self._follows and shaft.led))
        return 0, bytes(into[address:end])

    # --- writing

    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; return the error number, 0 on success."""
        if address == GOAL_AT and len(data) == GOAL_END - GOAL_AT and self._follows:
            return self._take_goal(data)
        fields = self.memory.fields(address, data)
        if isinstance(fields, int):
            return fields
        for register, value in fields:
            error = self._refusal(register, value)
            if error:
                return error
        for register, value in fields:
            self.memory.set(register.name, value)
            self._react(register.name, value)
            self._apply_settings()
        return 0

    def _refusal(self, register: Register, value: int) -> int:
        """Return the error number of a write that the servo's state forbids, 0 if it may be."""
        name = register.name
        if register.address < EEPROM_END:
            return ACCESS if self.torque else 0
        if not name.startswith("goal_"):
            return 0
        if self.memory.bytes[WATCHDOG_AT] == TRIPPED:
            return DATA_RANGE
        low, high = self._goal_range
        if name != "goal_position":
            high = self.memory.get(f"{name.removeprefix('goal_')}_limit")
            low = -high
        return 0 if low <= value <= high else DATA_LIMIT

    def _take_goal(self, data: bytes) -> int:
        """Write a goal position under torque by a shortcut, because it happens every tick."""
        value = int.from_bytes(data, "little", signed=True)
        low, high = self._goal_range
        if self.memory.bytes[WATCHDOG_AT] == TRIPPED:
            return DATA_RANGE
        if not low <= value <= high:
            return DATA_LIMIT
        self.memory.bytes[GOAL_AT:GOAL_END] = data
        self.shaft.lead_to(float(self._side * (value - self._shift)), self._speed, self._ramp)
        self.followed = GOAL_AT, data
        return 0

    def _react(self, name: str, value: int) -> None:
        """Carry out what a changed register starts."""
        if name == "torque_enable":
            # A latched error keeps the torque off.
            self._switch(bool(value) and not self.errors & self.memory.get("shutdown"))
        elif name == "bus_watchdog":
            self._watchdog_ms = value * WATCHDOG_UNIT_MS
        elif name == "operating_mode" and value != self._mode:
            self._change_mode(value)
        elif name == "drive_mode":
            self._wrap_to_one_turn()
        elif name == "homing_offset":
            before = self._offset
            self._side, self._offset = self._origin()
            self._shift += self._offset - before
        elif name.endswith("_limit"):
            self._measure()

    def _change_mode(self, mode: int) -> None:
        """Set profile, gains and goals to a mode's start values, the position within one turn."""
        self._mode = mode
        for name, gain in zip(GAINS, self.model.gains, strict=True):
            self.memory.set(name, gain)
        for name in ("profile_acceleration", "profile_velocity"):
            self.memory.set(name, 0)
        self._wrap_to_one_turn()
        self._reset_goals()

    # --- errors

    def _protect_from(self, bits: int) -> None:
        """Latch new hardware errors; those of Shutdown switch the torque off."""
        if bits & ~self.errors:
            self.errors |= bits
            self.memory.set("hardware_error_status", self.errors)
            if self.torque and self.errors & self.memory.get("shutdown"):
                self._switch(False)

    @property
    def error_flag(self) -> int:
        """Return the alert bit of every status."""
        return ALERT if self.errors else 0
