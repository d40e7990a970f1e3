"""One emulated Dynamixel X servo: what may be written when, errors, watchdog, restarts.

It moves when looked at: ``advance`` brings it up to a time, nothing runs by itself. The
control table is in sim_mock.dynamixel.memory; what turns the shaft in servo_drive, its modes
in servo_modes, profile in servo_profile, motor and shaft in servo_motion; heat, load and
voltage in servo_protection; every physical number in servo_physics. What it does not do:
play inside the gear, a blinking LED, the RC, S.Bus and iBus protocols of register 13.
"""

from drivers.dynamixel.control_table import (
    BACKUP_SINCE,
    BAUD_RATES,
    FAST_READ_SINCE,
    MODELS,
    RETURN_DELAY_UNIT_S,
    SHADOW_OFF,
)
from sim_mock.dynamixel.backup import Backup
from sim_mock.dynamixel.drive import TRIPPED, Drive
from sim_mock.dynamixel.live_registers import LIVE_AT, SENSED, SENSED_AT, put, put_sensed
from sim_mock.dynamixel.memory import (
    ACCESS,
    DATA_RANGE,
    INSTRUCTION_ERROR,
    RESULT_FAIL,
    DynamixelMemory,
    in_eeprom,
)
from sim_mock.dynamixel.modes import DRIVEN_BY, TORQUE_ON_BY_GOAL
from sim_mock.dynamixel.motor import long_pause
from sim_mock.dynamixel.write_rules import GOALS, Rules
from sim_mock.smart_servo.physics import Physics, Quirks, ServoSpec, checked
from sim_mock.smart_servo.protection import BITS, LOOK_MS, Protection

__all__ = ["DynamixelServo", "ServoSpec"]

ALERT = 0x80
REBOOT_MS = 400
WATCHDOG_UNIT_MS = 20

STARTS_WITH_TORQUE, RESTORES_RAM = 1, 2
"""Bits of Startup Configuration (60)."""

KEPT_BY_RESET: dict[int, tuple[str, ...]] = {0xFF: (), 1: ("id",), 2: ("id", "baud_rate")}
"""What each option of Factory Reset leaves alone."""

_GOAL_AT, _GOAL_SIZE = 116, 4


class DynamixelServo:
    """One servo on the chain. Its clock counts the chain's whole milliseconds.

    Raises:
        ValueError: the spec's physics cannot exist.
    """

    def __init__(self, spec: ServoSpec, now_ms: int) -> None:
        self.model = MODELS[spec.model]
        self.firmware = spec.firmware
        self.quirks = Quirks(*spec.quirks)
        self.memory = DynamixelMemory(self.model, spec.firmware)
        self.memory.set("firmware_version", spec.firmware)
        self.memory.set("id", spec.id)
        physics = checked(Physics(*spec.physics))
        seed = spec.id if spec.seed is None else spec.seed
        start = float(spec.start_steps)
        self.drive = Drive(self.memory, self.model, physics, self.quirks, start, seed)
        self.shaft = self.drive.shaft
        self._rules = Rules(self.memory, self.model, self.drive)
        self.protection = Protection(self.model, physics)
        self.id = spec.id
        self.fast_reads = spec.firmware >= FAST_READ_SINCE[self.model.family]
        self._new = spec.firmware >= BACKUP_SINCE[self.model.family]
        self._backup = Backup()
        self._limits = (0, 0, 0)
        self._ms = self._booted_ms = self._deaf_until_ms = now_ms
        self._look_ms = now_ms + LOOK_MS
        self._boot()

    def _boot(self) -> None:
        """Give the RAM area its start values, torque off unless it is to start with it."""
        memory = self.memory
        memory.restore(lambda register: not in_eeprom(register))
        self._watchdog_ms = 0
        self.alert = 0
        self._pending: tuple[int, bytes] | None = None
        self.protection.restart()
        memory.set("backup_ready", self._backup.ready)
        self.drive.boot()
        startup = memory.get("startup_configuration") if self._new else 0
        if startup & RESTORES_RAM:
            self._backup.recall(memory, eeprom=False)
        self._remember()
        if startup & STARTS_WITH_TORQUE:
            memory.set("torque_enable", 1)
            self._switch(True)

    # --- time

    def advance(self, now_ms: int, fed_ms: int) -> bool:
        """Move on to now; the last packet before that was on the bus at ``fed_ms``.

        Gives whether it listens: it is deaf while it restarts.
        """
        ahead = now_ms - self._ms
        if ahead > 0:
            if self._watchdog_ms and self.torque and now_ms >= fed_ms + self._watchdog_ms:
                self._trip(fed_ms + self._watchdog_ms - self._ms, ahead)
            if self.shaft.quiet and now_ms < self._look_ms:
                self._ms = now_ms
            else:
                self._move(now_ms)
        return now_ms >= self._deaf_until_ms

    def _move(self, until_ms: int) -> None:
        """Move on; a long pause is passed at once, so that whoever asks then is answered."""
        pause_at_ms, pause_ms = long_pause(self._ms, until_ms, LOOK_MS)
        self._live_on(pause_at_ms)
        if pause_ms:
            self.shaft.skip(pause_ms)
            self._ms += pause_ms
            self._look_ms += pause_ms - LOOK_MS
            self._look(pause_ms // LOOK_MS)
            self._live_on(until_ms)

    def _live_on(self, until_ms: int) -> None:
        """Move on, and look at heat, load and voltage every 20 ms of its own time."""
        shaft = self.shaft
        while self._ms < until_ms:
            stop = min(until_ms, self._look_ms)
            shaft.run(stop - self._ms)
            self._ms = stop
            if stop == self._look_ms:
                self._look()
                if self._calm and shaft.quiet and until_ms > self._look_ms:
                    self._look_ms += (until_ms - self._look_ms) // LOOK_MS * LOOK_MS

    def _look(self, looks: int = 1) -> None:
        """Watch over itself: latch what is wrong, restart where the voltage is gone."""
        self._look_ms += LOOK_MS
        shaft, protection = self.shaft, self.protection
        before = protection.temperature_c
        bits = protection.look(shaft.effort, shaft.volts, self._limits, looks)
        self._calm = protection.temperature_c == before and protection.steady
        if bits & ~self.alert:
            self._latch(bits)
        if protection.browned_out(shaft.volts):
            self.brown_out()

    def _trip(self, after_ms: int, ahead_ms: int) -> int:
        """Stop as the bus watchdog does; goals are refused until 98 is cleared.

        Gives what is left of ``ahead_ms``.
        """
        after_ms = max(0, after_ms)
        self._move(self._ms + after_ms)
        self._watchdog_ms = 0
        self.memory.set("bus_watchdog", TRIPPED)
        self.drive.halt()
        return ahead_ms - after_ms

    # --- reading

    @property
    def torque(self) -> bool:
        """Tell whether the torque is on."""
        return self.drive.torque

    @property
    def position_steps(self) -> float:
        """Give the true position of the shaft in the registers' terms, finer than they are."""
        return self.drive.position_steps

    @property
    def joint_steps(self) -> float:
        """Give the position of the joint behind the play, in the registers' terms."""
        return self.drive.joint_steps

    def read(self, address: int, length: int) -> bytes | None:
        """Give bytes of the control table, None where an address is not defined."""
        if address == SENSED_AT and length == SENSED.size:
            return SENSED.pack(*self.drive.sensed(self._ms))
        if address + length > LIVE_AT:
            self._refresh(self.memory.gather(address, length).profiled)
        return self.memory.read(address, length)

    def _refresh(self, profiled: bool) -> None:
        """Bring the registers that live up to date, the profile's only where they are asked for."""
        warmth, drive = round(self.protection.temperature_c), self.drive
        if profiled:
            put(drive.live(self._ms - self._booted_ms, self._ms, warmth), self.memory.bytes)
        else:
            put_sensed(drive.sensed(self._ms), drive.voltage(), warmth, self.memory.bytes)

    # --- writing

    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; gives the error number, 0 when done."""
        if address == _GOAL_AT and len(data) == _GOAL_SIZE and self.drive.follows:
            return self._take_goal(data)
        fields = self._rules.permitted(address, data)
        if isinstance(fields, int):
            return fields
        for register, value in fields:
            self.memory.put(register, value)
            self._act(register.name, value)
        return 0

    def _take_goal(self, data: bytes) -> int:
        """Take the one write of every tick, a goal position under torque, the short way."""
        value = int.from_bytes(data, "little", signed=True)
        error = self._rules.goal_error(value)
        if error:
            return error
        self.memory.bytes[_GOAL_AT : _GOAL_AT + _GOAL_SIZE] = data
        self.drive.aim(value)
        return 0

    def _act(self, name: str, value: int) -> None:
        """Let a written value take effect."""
        drive = self.drive
        if name == "torque_enable":
            self._switch(bool(value))
        elif name == "bus_watchdog":
            self._watchdog_ms = value * WATCHDOG_UNIT_MS
        elif name == "operating_mode":
            drive.change_mode(value)
        elif name in ("homing_offset", "drive_mode"):
            drive.shift_origin()
        elif name == "id":
            self.id = value
        elif name in GOALS:
            self._command(name, value)
        self._remember()

    def _command(self, name: str, value: int) -> None:
        """Follow a new goal, where the mode is driven by it."""
        if name != DRIVEN_BY.get(self.drive.mode, "goal_position"):
            return
        if not self.torque and self._new and self.memory.get("drive_mode") & TORQUE_ON_BY_GOAL:
            self.memory.set("torque_enable", 1)
            self._switch(True)
        elif self.torque and name == "goal_position":
            self.drive.aim(value)
        elif self.torque and name == "goal_velocity":
            self.drive.spin(value)

    def _switch(self, on: bool) -> None:
        """Switch the torque; a latched error keeps it off."""
        if on and self.alert & self.memory.get("shutdown"):
            self.memory.set("torque_enable", 0)
        else:
            self.drive.switch(on)

    def _remember(self) -> None:
        """Keep what is asked often as plain numbers, and tell the drive its settings."""
        get = self.memory.get
        self._calm = False
        self.status_level = get("status_return_level")
        self._limits = (
            get("temperature_limit"), get("max_voltage_limit"), get("min_voltage_limit"),
        )  # fmt: skip
        self._rules.settle()
        self.drive.settle()

    # --- instructions

    def register(self, address: int, data: bytes) -> int:
        """Keep a write for Action; gives the error number."""
        fields = self._rules.permitted(address, data)
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
        self._booted_ms = self._ms
        self._deaf_until_ms = self._ms + REBOOT_MS
        self._boot()

    def brown_out(self) -> None:
        """Restart as a dip of the supply makes it: no status tells."""
        self.reboot()

    def factory_reset(self, option: int) -> int:
        """Put the EEPROM back (0xFF all, 1 all but id, 2 all but id and baud), then restart."""
        kept = KEPT_BY_RESET.get(option)
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
        return 0 if self.drive.clear_turns() else RESULT_FAIL

    def backup(self) -> int:
        """Store the control table; gives the error number, 1 while the torque is on."""
        if not self._new:
            return INSTRUCTION_ERROR
        if self.torque:
            return RESULT_FAIL
        self._backup.store(self.memory)
        self.memory.set("backup_ready", 1)
        return 0

    def restore(self) -> int:
        """Put the stored control table back and restart; gives the error number."""
        if not self._new:
            return INSTRUCTION_ERROR
        if self.torque or not self._backup.ready:
            return RESULT_FAIL
        self._backup.recall(self.memory, eeprom=True)
        self.id = self.memory.get("id")
        self.reboot()
        self._backup.recall(self.memory, eeprom=False)
        self._remember()
        return 0

    # --- errors

    def fail(self, error: str) -> None:
        """Latch a hardware error by name, as the servo's own protection would.

        Raises:
            ValueError: there is no such error.
        """
        if error not in BITS:
            raise ValueError(f"hardware error {error!r}: there is {', '.join(BITS)}")
        self._latch(1 << BITS[error])

    def _latch(self, bits: int) -> None:
        """Set bits of Hardware Error Status; those of Shutdown take the torque."""
        self.alert |= bits
        self.memory.set("hardware_error_status", self.alert)
        if self.alert & self.memory.get("shutdown"):
            self.memory.set("torque_enable", 0)
            self._switch(False)

    @property
    def error_flag(self) -> int:
        """Give the alert bit as it stands on every status."""
        return ALERT if self.alert else 0

    # --- for the line

    @property
    def baud(self) -> int:
        """Give bit/s by register 8; a new one acts after the status of its write has gone out."""
        return BAUD_RATES[self.memory.get("baud_rate")]

    @property
    def return_delay_s(self) -> float:
        """Give the pause before a status, by register 9."""
        return self.memory.get("return_delay_time") * RETURN_DELAY_UNIT_S

    @property
    def shadow_id(self) -> int | None:
        """Give the id under which it carries out writes to RAM and never answers."""
        shadow = self.memory.get("secondary_id")
        return None if shadow >= SHADOW_OFF else shadow

    # --- from outside

    def turn(self, steps: float) -> None:
        """Turn the joint by hand, in the registers' direction; under torque it fights back."""
        self.drive.turn(steps)

    def hold_fast(self, stuck: bool = True) -> None:
        """Jam the joint where it is, or free it."""
        self.shaft.hold_fast(stuck)

    def pull(self, load_nm: float) -> None:
        """Hang a constant torque on the joint, as a spring or a cable does, from now on."""
        self.shaft.pull(load_nm / self.model.stall_torque_nm)

    @property
    def supply_v(self) -> float:
        """Give the open-circuit voltage; far too little makes it restart again and again."""
        return self.shaft.supply * self.model.rated_v

    @supply_v.setter
    def supply_v(self, volts: float) -> None:
        self._calm = False
        self.shaft.feed(max(0.0, volts) / self.model.rated_v)

    @property
    def temperature_c(self) -> float:
        """Give the temperature of the motor; it drifts to what load and room make it."""
        return self.protection.temperature_c

    @temperature_c.setter
    def temperature_c(self, celsius: float) -> None:
        self._calm = False
        self.protection.temperature_c = celsius

    @property
    def ambient_c(self) -> float:
        """Give the temperature around the servo."""
        return self.protection.ambient_c

    @ambient_c.setter
    def ambient_c(self, celsius: float) -> None:
        self._calm = False
        self.protection.ambient_c = celsius
