"""One emulated Dynamixel X servo: permitted writes, errors, watchdog, restarts.

The control table is in gazerig.sim_mock.dynamixel.memory, modes, profiles and gains in its
neighbours. Not emulated: play inside the gear, a blinking LED, the RC, S.Bus and iBus protocols
of register 13.
"""

import struct
from dataclasses import dataclass
from typing import ClassVar, Literal

from gazerig.drivers.dynamixel.control_table import (
    BACKUP_SINCE,
    BAUD_RATES,
    EEPROM_END,
    FAST_READ_SINCE,
    HARDWARE_ERRORS,
    MODELS,
    SHADOW_OFF,
    DynamixelModel,
    DynamixelRegister,
)
from gazerig.sim_mock.dynamixel.drive import (
    DRIVEN_BY,
    POSITION,
    TORQUE_ON_BY_GOAL,
    TRIPPED,
    DynamixelDrive,
    supported_modes,
)
from gazerig.sim_mock.dynamixel.memory import (
    ACCESS,
    DATA_LIMIT,
    DATA_RANGE,
    GOAL_AT,
    GOAL_END,
    INSTRUCTION_ERROR,
    MOTION,
    MOTION_AT,
    REFERENCE,
    REFERENCE_AT,
    RESULT_FAIL,
    SENSED,
    SENSED_AT,
    SURROUNDINGS,
    SURROUNDINGS_AT,
    Backup,
    DynamixelMemory,
    Fields,
    SensedWindow,
    in_eeprom,
)
from gazerig.sim_mock.smart_servo.motor import ShaftMaker, create_shaft
from gazerig.sim_mock.smart_servo.physics import Quirks, ServoSpec
from gazerig.sim_mock.smart_servo.quirks import ChainQuirks
from gazerig.sim_mock.smart_servo.servo import EmulatedServo

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
        self._modes = supported_modes(model)
        self._drive = drive
        self.goal_range = (0, 0)

    def apply_settings(self) -> None:
        """Apply the present register values."""
        get = self._memory.get
        self.goal_range = -MULTI_TURN_STEPS, MULTI_TURN_STEPS
        if self._drive.mode == POSITION:
            self.goal_range = get("min_position_limit"), get("max_position_limit")

    def is_permitted(self, address: int, data: bytes) -> Fields | int:
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


BadCrc = Literal["silent", "reply"]
Stuffing = Literal["accept", "strict"]


@dataclass(frozen=True, kw_only=True)
class DynamixelQuirks(ChainQuirks):
    """Choices of behaviour.

    bad_crc: reply to a wrong CRC: silence, or error number 3
    stuffing: an instruction with FF FF FD among its parameters that lacks byte stuffing is
        understood by its length, or dropped
    """

    bad_crc: BadCrc = "silent"
    stuffing: Stuffing = "accept"


ALERT = 0x80
WATCHDOG_UNIT_MS = 20

STARTS_WITH_TORQUE, RESTORES_RAM = 1, 2
"""Bits of Startup Configuration (60)."""

KEPT_BY_RESET: dict[int, tuple[str, ...]] = {0xFF: (), 1: ("id",), 2: ("id", "baud_rate")}
"""Registers that each option of Factory Reset keeps."""

_IDENTITY = struct.Struct("<HB")


class DynamixelServo(EmulatedServo):
    """One Dynamixel servo on the chain.

    Raises:
        ValueError: the spec's physics cannot exist.
    """

    restart_ms = 400
    unreadable = ACCESS
    none_registered = INSTRUCTION_ERROR
    read_level, answer_level = 1, 2
    error_bits: ClassVar = {name: 1 << bit for bit, name in HARDWARE_ERRORS.items()}
    model: DynamixelModel
    memory: DynamixelMemory
    drive: DynamixelDrive

    def __init__(self, spec: ServoSpec, now_ms: int, make_shaft: ShaftMaker = create_shaft) -> None:
        self.model = MODELS[spec.model]
        self.mute_reboot = Quirks(*spec.quirks).mute_reboot
        self.memory = DynamixelMemory(self.model, spec.firmware)
        self.memory.set("firmware_version", spec.firmware)
        self.memory.set("id", spec.id)
        self.baud_rates = BAUD_RATES[: (self.memory.register_named("baud_rate").high or 0) + 1]
        self.drive = DynamixelDrive(self.memory, self.model, spec, make_shaft)
        self._rules = WriteRules(self.memory, self.model, self.drive)
        self.fast_reads = spec.firmware >= FAST_READ_SINCE[self.model.family]
        self._new = spec.firmware >= BACKUP_SINCE[self.model.family]
        self._backup = Backup()
        super().__init__(spec, now_ms)

    def _load_limits(self) -> tuple[float, ...]:
        """Return overload share and time from the physics, because no register holds them."""
        return self._physics.overload_share, self._physics.overload_s

    def identity(self) -> bytes:
        """Return model number and firmware."""
        return _IDENTITY.pack(self.model.number, self.firmware)

    def _boot(self) -> None:
        """Reset to power-on, with torque if Startup Configuration requires it."""
        self._around: tuple[int, int] | None = None
        super()._boot()
        self.memory.set("backup_ready", self._backup.ready)
        startup = self.memory.get("startup_configuration") if self._new else 0
        if startup & RESTORES_RAM:
            self._backup.recall(self.memory, eeprom=False)
            self._apply_settings()
        if startup & STARTS_WITH_TORQUE:
            self.memory.set("torque_enable", 1)
            self._switch(True)

    def _apply_settings(self) -> None:
        """Apply settings that have changed."""
        shadow = self.memory.get("secondary_id")
        self.shadow_id = None if shadow >= SHADOW_OFF else shadow
        super()._apply_settings()
        self._rules.apply_settings()

    def _protect_from(self, bits: int) -> None:
        """Latch new hardware errors."""
        if bits & ~self.errors:
            self._latch(bits)

    def _trip(self, after_ms: int) -> None:
        """Stop as the bus watchdog does; goals are refused until 98 is cleared."""
        super()._trip(after_ms)
        self.memory.set("bus_watchdog", TRIPPED)
        self.drive.hold_position()

    # --- reading

    @property
    def joint_steps(self) -> float:
        """Return the position of the joint behind the play, in the registers' unit."""
        return self.drive.joint_steps

    def read(self, address: int, length: int) -> bytes | None:
        """Return bytes of the control table, None if an address is not defined."""
        memory = self.memory
        gather = memory.gathers.get((address, length)) or memory.gather(address, length)
        if gather is None:
            return None
        _, fetch, sensed, surroundings, profiled = gather
        into = memory.bytes
        if sensed:
            SENSED.pack_into(into, SENSED_AT, *self.drive.sensed(self._ms))
        if surroundings and self.stale_surroundings:
            self._refresh_surroundings()
        if profiled:
            tick_ms = self._ms - self._booted_ms & 0x7FFF
            MOTION.pack_into(into, MOTION_AT, tick_ms, *self.drive.motion(self._ms))
            REFERENCE.pack_into(into, REFERENCE_AT, *self.drive.reference())
        return b"".join(fetch(into))

    def window(self, wanted: tuple[int, int, int]) -> SensedWindow | None:
        """Return the layout of its part of a fast read, None if ``read`` must do it.

        Args:
            wanted: id, address, length.
        """
        memory = self.memory
        if wanted not in memory.windows:
            memory.window(wanted)
        found = memory.windows[wanted]
        if found is not None and found.surroundings and self.stale_surroundings:
            self._refresh_surroundings()
            return memory.windows.get(wanted) or memory.window(wanted)
        return found

    def _refresh_surroundings(self) -> None:
        """Update voltage and temperature."""
        self.stale_surroundings = False
        around = self.voltage_01v, self.warmth_c
        if around != self._around:
            self._around = around
            SURROUNDINGS.pack_into(self.memory.bytes, SURROUNDINGS_AT, *around)
            self.memory.windows.clear()

    # --- writing

    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; return the error number, 0 on success."""
        if address == GOAL_AT and len(data) == GOAL_END - GOAL_AT and self.drive.follows:
            return self._take_goal(data)
        fields = self._rules.is_permitted(address, data)
        if isinstance(fields, int):
            return fields
        for register, value in fields:
            self.memory.put(register, value)
            name = register.name
            drive = self.drive
            if name == "torque_enable":
                self._switch(bool(value))
            elif name == "bus_watchdog":
                self._watchdog_ms = value * WATCHDOG_UNIT_MS
            elif name == "operating_mode":
                drive.change_mode(value)
            elif name in ("homing_offset", "drive_mode"):
                drive.shift_origin()
            elif name in GOALS:
                self._command(name, value)
            self._apply_settings()
        return 0

    def _take_goal(self, data: bytes) -> int:
        """Write a goal position under torque by a shortcut, because it happens every tick."""
        value = int.from_bytes(data, "little", signed=True)
        low, high = self._rules.goal_range
        if not low <= value <= high or self.memory.bytes[WATCHDOG_AT] == TRIPPED:
            return self._rules.goal_error(value)
        self.memory.bytes[GOAL_AT:GOAL_END] = data
        drive = self.drive
        drive.set_goal(value)
        drive.followed = GOAL_AT, data
        return 0

    def _command(self, name: str, value: int) -> None:
        """Follow a new goal if the operating mode uses it."""
        if name != DRIVEN_BY.get(self.drive.mode, "goal_position"):
            return
        if not self.torque and self._new and self.memory.get("drive_mode") & TORQUE_ON_BY_GOAL:
            self.memory.set("torque_enable", 1)
            self._switch(True)
        elif self.torque and name == "goal_position":
            self.drive.set_goal(value)
        elif self.torque and name == "goal_velocity":
            self.drive.set_goal_velocity(value)

    def _switch(self, on: bool) -> None:
        """Switch the torque; a latched error keeps it off."""
        if on and self.errors & self.memory.get("shutdown"):
            self.memory.set("torque_enable", 0)
        else:
            self.drive.switch(on)

    # --- instructions

    def store_write(self, address: int, data: bytes) -> int:
        """Store a write for Action if it is permitted now; return the error number."""
        fields = self._rules.is_permitted(address, data)
        return fields if isinstance(fields, int) else super().store_write(address, data)

    def factory_reset(self, option: int) -> int:
        """Restore the EEPROM (0xFF all, 1 all but id, 2 all but id and baud), then restart."""
        kept = KEPT_BY_RESET.get(option)
        if kept is None:
            return DATA_RANGE
        if self.torque:
            return ACCESS
        self.memory.restore(lambda register: in_eeprom(register) and register.name not in kept)
        self.restart()
        return 0

    def reset_all(self) -> int:
        """Restore factory settings, id 1; return the error number."""
        return self.factory_reset(0xFF)

    def clear_turns(self) -> int:
        """Wrap a multi-turn position into one turn; refused while moving."""
        return 0 if self.drive.clear_turns() else RESULT_FAIL

    def backup(self) -> int:
        """Store the control table; return the error number, 1 while the torque is on."""
        if not self._new:
            return INSTRUCTION_ERROR
        if self.torque:
            return RESULT_FAIL
        self._backup.store(self.memory)
        self.memory.set("backup_ready", 1)
        return 0

    def restore(self) -> int:
        """Restore the stored control table and restart; return the error number."""
        if not self._new:
            return INSTRUCTION_ERROR
        if self.torque or not self._backup.ready:
            return RESULT_FAIL
        self._backup.recall(self.memory, eeprom=True)
        self.restart()
        self._backup.recall(self.memory, eeprom=False)
        self._apply_settings()
        return 0

    # --- errors

    def _latch(self, bits: int) -> None:
        """Set bits of Hardware Error Status; those of Shutdown switch the torque off."""
        self.errors |= bits
        self.memory.set("hardware_error_status", self.errors)
        if self.errors & self.memory.get("shutdown"):
            self.memory.set("torque_enable", 0)
            self._switch(False)

    @property
    def error_flag(self) -> int:
        """Return the alert bit of every status."""
        return ALERT if self.errors else 0
