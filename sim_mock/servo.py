"""One emulated Dynamixel X servo: control table, torque, errors, watchdog, motion.

It moves when looked at: ``advance`` brings it up to a time, nothing runs by
itself. What it does not do: motion in the current, velocity and PWM modes (the shaft
stands still), reverse and time-based drive mode, secondary id, control table backup,
baud rates, temperature and voltage changes.
"""

import struct
from typing import NamedTuple

from drivers.dynamixel_table import (
    ACCELERATION_UNIT_STEPS_S2,
    EEPROM_END,
    FAST_READ_SINCE,
    HARDWARE_ERRORS,
    MODELS,
    STEPS_PER_TURN,
    VELOCITY_UNIT_STEPS_S,
    Register,
)
from sim_mock.servo_memory import (
    ACCESS,
    DATA_LIMIT,
    DATA_RANGE,
    INSTRUCTION_ERROR,
    RESULT_FAIL,
    Fields,
    Memory,
    in_eeprom,
)
from sim_mock.servo_motion import STEP_S, Feel, Shaft

ALERT = 0x80
REBOOT_MS = 400
WATCHDOG_UNIT_MS = 20
TRIPPED = 255
TEMPERATURE_C = 30
PWM_FULL = 885

POSITION_MODES = (3, 4, 5)
MODES = (0, 1, 3, 4, 5, 16)
GOALS = ("goal_pwm", "goal_current", "goal_velocity", "goal_position")
MULTI_TURN_STEPS = 1_048_575
HOMING_ACTS_STEPS = 1024
"""Part of the homing offset that counts in position mode."""

# 126 current, 128 velocity, 132 position: what a control loop reads every tick
_SENSED = struct.Struct("<hii")
_SENSED_AT = 126
# 120 tick, 122 moving, 123 status, 124 pwm | 136 and 140 trajectory, 144 voltage, 146 temperature
_LIVE_HEAD, _LIVE_TAIL = struct.Struct("<HBBh"), struct.Struct("<iiHB")
_LIVE_AT, _TAIL_AT = 120, 136
_GOAL_AT, _GOAL_SIZE, _WATCHDOG_AT = 116, 4, 98
_VELOCITY_PER_MS = 1.0 / (STEP_S * VELOCITY_UNIT_STEPS_S)


class ServoSpec(NamedTuple):
    """How to build one servo; the last three are as in sim_mock.servo_motion.Feel."""

    id: int
    model: str
    start_steps: float = 2048
    firmware: int = 53
    lag_s: float = Feel().lag_s
    spin_up_s: float = Feel().spin_up_s
    rest_steps: float | None = None


class Servo:
    """One servo on the chain. Its clock counts the chain's whole milliseconds."""

    def __init__(self, spec: ServoSpec, now_ms: int) -> None:
        self.model = MODELS[spec.model]
        self.firmware = spec.firmware
        self.memory = Memory(self.model, spec.firmware)
        self.memory.set("firmware_version", spec.firmware)
        self.memory.set("id", spec.id)
        feel = Feel(spec.lag_s, spec.spin_up_s, spec.rest_steps)
        self.shaft = Shaft(spec.start_steps, self.model.no_load_steps_s, feel)
        self.id = spec.id
        self.fast_reads = spec.firmware >= FAST_READ_SINCE[self.model.family]
        self._ms = self._deaf_until_ms = now_ms
        self._offset = 0
        self._boot()

    def _boot(self) -> None:
        """Give the RAM area its start values, torque off."""
        self.memory.restore(lambda register: not in_eeprom(register))
        self.torque = False
        self._watchdog_ms = 0
        self.alert = 0
        self.status_level = 2
        self._pending: tuple[int, bytes] | None = None
        self.shaft.let_go()
        self._wrap()
        self._reset_goals()

    # --- time

    def advance(self, now_ms: int, fed_ms: int) -> bool:
        """Move on to now; the last packet before that was on the bus at ``fed_ms``.

        Gives whether it listens: it is deaf while it restarts.
        """
        ahead = now_ms - self._ms
        if ahead > 0:
            if self._watchdog_ms and self.torque and now_ms >= fed_ms + self._watchdog_ms:
                ahead = self._trip(fed_ms + self._watchdog_ms - self._ms, ahead)
            self._ms = now_ms
            self.shaft.advance(ahead)
        return now_ms >= self._deaf_until_ms

    def _trip(self, after_ms: int, ahead_ms: int) -> int:
        """Stop as the bus watchdog does; goals are refused until 98 is cleared."""
        self.shaft.advance(max(0, after_ms))
        self.shaft.stop()
        self._watchdog_ms = 0
        self.memory.set("bus_watchdog", TRIPPED)
        return ahead_ms - max(0, after_ms)

    # --- reading

    @property
    def position_steps(self) -> float:
        """Give the true position of the shaft, finer than the register."""
        return self.shaft.x

    def read(self, address: int, length: int) -> bytes | None:
        """Give bytes of the control table, None where an address is not defined."""
        if address == _SENSED_AT and length == _SENSED.size:
            return _SENSED.pack(*self._sensed())
        if address + length > _LIVE_AT:
            self._refresh()
        return self.memory.read(address, length)

    def _sensed(self) -> tuple[int, int, int]:
        """Give present current, velocity and position in register units."""
        shaft = self.shaft
        v = shaft.v
        if v == 0.0:
            return 0, 0, round(shaft.x)
        current = self._effort() * self._current_full
        return round(current), round(v * _VELOCITY_PER_MS), round(shaft.x)

    def _effort(self) -> float:
        """Give the torque as a share of the stall torque, which falls with speed."""
        shaft = self.shaft
        return shaft.effort * (1.0 - abs(shaft.top_share)) if self.torque else 0.0

    def _refresh(self) -> None:
        """Bring the live registers up to date."""
        shaft, sensed, into = self.shaft, self._sensed(), self.memory.bytes
        running = self.torque and shaft.r != shaft.goal
        moving = running or abs(sensed[1]) > self.memory.get("moving_threshold")
        drive = self._effort() + shaft.top_share if self.torque else 0.0
        _LIVE_HEAD.pack_into(
            into,
            _LIVE_AT,
            self._ms & 0x7FFF,
            moving,
            (not moving) | running << 1 | self._profile_kind << 4,
            round(PWM_FULL * max(-1.0, min(1.0, drive))),
        )
        _SENSED.pack_into(into, _SENSED_AT, *sensed)
        _LIVE_TAIL.pack_into(
            into,
            _TAIL_AT,
            round(shaft.profile_speed_steps_s / VELOCITY_UNIT_STEPS_S),
            round(shaft.r),
            round(self.model.rated_v * 10.0),
            TEMPERATURE_C,
        )

    # --- writing

    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; gives the error number, 0 when done."""
        if address == _GOAL_AT and len(data) == _GOAL_SIZE and self._follows:
            return self._aim(data)
        fields = self._permitted(address, data)
        if isinstance(fields, int):
            return fields
        for register, value in fields:
            self.memory.put(register, value)
            self._act(register.name, value)
        return 0

    def _aim(self, data: bytes) -> int:
        """Take the one write of every tick, a goal position under torque, the short way."""
        value = int.from_bytes(data, "little", signed=True)
        low, high = self._goal_range
        if self.memory.bytes[_WATCHDOG_AT] == TRIPPED:
            return DATA_RANGE
        if not low <= value <= high:
            return DATA_LIMIT
        self.memory.bytes[_GOAL_AT : _GOAL_AT + _GOAL_SIZE] = data
        if value != self.shaft.goal:
            self.shaft.aim(value)
        return 0

    def _permitted(self, address: int, data: bytes) -> Fields | int:
        """Check a write against table and state."""
        fields = self.memory.fields(address, data)
        if isinstance(fields, int):
            return fields
        for register, value in fields:
            error = self._refusal(register, value)
            if error:
                return error
        return fields

    def _refusal(self, register: Register, value: int) -> int:
        name = register.name
        if register.address < EEPROM_END:
            if self.torque:
                return ACCESS
            return DATA_RANGE if name == "operating_mode" and value not in self._modes() else 0
        if name in GOALS:
            if self.memory.bytes[_WATCHDOG_AT] == TRIPPED:
                return DATA_RANGE
            low, high = self._goal_limits(name)
            return 0 if low <= value <= high else DATA_LIMIT
        return 0

    def _modes(self) -> tuple[int, ...]:
        return MODES if self.memory.has("goal_current") else (1, 3, 4, 16)

    def _goal_limits(self, name: str) -> tuple[int, int]:
        """Give the range a goal must keep to now."""
        if name == "goal_position":
            return self._goal_range
        limit = self.memory.get(name.replace("goal_", "") + "_limit")
        return -limit, limit

    def _act(self, name: str, value: int) -> None:
        """Let a written value take effect."""
        if name == "torque_enable":
            self._switch(bool(value))
        elif name == "bus_watchdog":
            self._watchdog_ms = value * WATCHDOG_UNIT_MS
        elif name == "status_return_level":
            self.status_level = value
        elif name == "operating_mode":
            self._change_mode()
        elif name == "homing_offset":
            self._move_origin()
        elif name == "id":
            self.id = value
        self._remember()

    def _switch(self, on: bool) -> None:
        """Switch the torque; a latched error keeps it off, an old goal is followed at once."""
        if on and self.alert & self.memory.get("shutdown"):
            self.memory.set("torque_enable", 0)
            return
        if on and not self.torque and self.mode in POSITION_MODES:
            self.shaft.drive(self.memory.get("goal_position"))
        elif not on and self.torque:
            self.shaft.let_go()
        self.torque = on

    def _change_mode(self) -> None:
        for name in ("profile_acceleration", "profile_velocity"):
            self.memory.set(name, 0)
        self._wrap()
        self._reset_goals()

    def _move_origin(self) -> None:
        offset = self._homing()
        self.shaft.place(self.shaft.x + offset - self._offset)
        self._offset = offset

    def _homing(self) -> int:
        offset = self.memory.get("homing_offset")
        if self.mode != 3:
            return offset
        return max(-HOMING_ACTS_STEPS, min(HOMING_ACTS_STEPS, offset))

    def _wrap(self) -> None:
        """Bring the position into one turn, as power-on and leaving multi-turn do."""
        self.shaft.place(self.shaft.x % STEPS_PER_TURN)

    def _reset_goals(self) -> None:
        """Set the goals to the limits, the goal position to where it is."""
        for name in ("goal_pwm", "goal_current", "goal_velocity"):
            if self.memory.has(name):
                self.memory.set(name, self.memory.get(name.replace("goal_", "") + "_limit"))
        self.memory.set("goal_position", round(self.shaft.x))
        self._remember()
        self._offset = self._homing()

    def _remember(self) -> None:
        """Keep what is asked often as plain numbers."""
        get = self.memory.get
        self.mode = get("operating_mode")
        self._follows = self.torque and self.mode in POSITION_MODES
        if self.mode == 3:
            self._goal_range = get("min_position_limit"), get("max_position_limit")
        else:
            self._goal_range = -MULTI_TURN_STEPS, MULTI_TURN_STEPS
        speed, ramp = get("profile_velocity"), get("profile_acceleration")
        self.shaft.shape(speed * VELOCITY_UNIT_STEPS_S, ramp * ACCELERATION_UNIT_STEPS_S2)
        self._profile_kind = 0 if speed == 0 else 1 if ramp == 0 else 3
        unit = self.model.current_unit_ma
        # Models without a current sensor report load in 0.1 %.
        self._current_full = self.model.stall_current_a * 1000.0 / unit if unit else 1000.0

    # --- instructions

    def register(self, address: int, data: bytes) -> int:
        """Keep a write for Action; gives the error number."""
        fields = self._permitted(address, data)
        if isinstance(fields, int):
            return fields
        self._pending = (address, data)
        self.memory.set("registered_instruction", 1)
        return 0

    def action(self) -> int:
        """Carry out the kept write; gives the error number."""
        if self._pending is None:
            return INSTRUCTION_ERROR
        address, data = self._pending
        self._pending = None
        self.memory.set("registered_instruction", 0)
        return self.write(address, data)

    def reboot(self) -> None:
        """Restart: deaf for 0.4 s, then RAM at its start values and no hardware error."""
        self._deaf_until_ms = self._ms + REBOOT_MS
        self._boot()

    def factory_reset(self, option: int) -> int:
        """Put the EEPROM back (0xFF all, 1 all but id, 2 all but id and baud), then restart."""
        kept = {0xFF: (), 1: ("id",), 2: ("id", "baud_rate")}.get(option)
        if kept is None:
            return DATA_RANGE
        if self.torque:
            return ACCESS
        self.memory.restore(lambda register: in_eeprom(register) and register.name not in kept)
        self.id = self.memory.get("id")
        self.reboot()
        return 0

    def clear_turns(self) -> int:
        """Bring a multi-turn position back into one turn; refused while moving."""
        if not self.shaft.settled:
            return RESULT_FAIL
        self._wrap()
        return 0

    def fail(self, error: str) -> None:
        """Latch a hardware error by name, as the servo's own protection would."""
        bit = next(bit for bit, name in HARDWARE_ERRORS.items() if name == error)
        self.alert |= 1 << bit
        self.memory.set("hardware_error_status", self.alert)
        if self.alert & self.memory.get("shutdown"):
            self.memory.set("torque_enable", 0)
            self._switch(False)
            self._remember()

    @property
    def error_flag(self) -> int:
        """Give the alert bit as it stands on every status."""
        return ALERT if self.alert else 0
