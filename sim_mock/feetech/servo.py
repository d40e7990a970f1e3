"""One emulated Feetech servo, series STS and SCS: its registers, effects of writes, errors.

Nothing is ever refused: a write to a read-only register, or of an id or baud rate that does not
exist, is answered like any other and changes nothing. While Lock is 1, a write to the EEPROM area
lasts until power-off; only writes while it is 0 are permanent. An overload lowers the torque until
the next new goal; other errors in Unloading Condition switch it off.

The registers' places are those of the driver's table. Of them have no effect: goal time (44),
modes other than position (33 and, for SCS, both limits 0), phase (18), starting force and dead
zones (24, 26, 27; without them friction keeps it up to 2 steps from its goal, as on a real servo),
protection current (28), angular resolution (30), velocity gains (37, 39), LED (20).

Position, goal and target are sign and magnitude. The encoder knows its place within a turn, 0 to
4095 at power-on; from there the servo counts on, and subtracts the offset (31): a shaft that was
turned on, or has an offset, is at 4368 or -100. Goals end at the angle limits (9, 11), within a
turn, unless both are 0: then they may be turns away.

SCS servos have the high byte of a word first and a potentiometer of 1024 steps over less than a
turn. They answer no sync read and have no offset, torque limit or current.

Undocumented properties of the controller are assumed such that a servo with factory gains reaches
full duty at 50 steps of error and does not overshoot: owners measure 20-30 steps at half the stall
torque.
"""

import struct
from typing import Literal

from gazerig.drivers.feetech.memory_table import (
    ACCELERATION_UNIT_STEPS_S2,
    BAUD_RATES,
    CURRENT_UNIT_MA,
    EEPROM_END,
    HIGHEST_ID,
    MODELS,
    REGISTERS,
    SCS_BAUD_RATES,
    SCS_MODELS,
    SCS_REGISTERS,
    SCS_STEPS,
    SET_MIDDLE,
    TORQUE_FULL,
    Register,
)
from gazerig.drivers.feetech.memory_table import STEPS_PER_TURN as TURN
from gazerig.drivers.servo_bus.family import ServoModel
from gazerig.sim_mock.feetech.packets import signed, unsigned
from gazerig.sim_mock.smart_servo.memory import ServoMemory
from gazerig.sim_mock.smart_servo.physics import DISABLED, Loop, Motor, ServoSpec
from gazerig.sim_mock.smart_servo.servo import (
    HEAT,
    OVERLOAD,
    REBOOT,
    VOLTAGE,
    EmulatedServo,
    Result,
)
from gazerig.sim_mock.smart_servo.shaft import ShaftMaker, create_shaft

SCS_TRAVEL_DEG = {"scs0009": 300.0, "scs15": 200.0}
"""Travel of the potentiometer's 1024 steps."""
RETURN_DELAY = 250
"""As owners read it on delivery."""

MIDDLE = 2048
TIME_UNIT_S = 0.01
RAMP_UNIT = ACCELERATION_UNIT_STEPS_S2 / 1e6
"""Unit of Acceleration (41) in steps/ms2."""
P_SHARE, I_SHARE, D_SHARE = 1 / 1600, 1 / 1.6e6, 1 / 64
"""Duty per unit of each gain for steps, steps times ms, and steps/ms, as shares of full duty."""

SIZE = 512
"""More than can be read; addresses without a register read 0."""
TORQUE_AT, GOALS_AT, GOAL_AT, GOAL_END, GOALS_END = 40, 41, 42, 44, 48
_GOALS = {"little": struct.Struct("<BHHH"), "big": struct.Struct(">BHHH")}
"""Acceleration, goal position, goal time, goal speed: written together in every tick."""
SENSED_AT, SENSED_END = 56, 71
_SENSED = {"little": struct.Struct("<HHHBBBBBHH"), "big": struct.Struct(">HHHBBBBBHH")}
"""56 position, speed, load, voltage, temperature, registered, status, moving, target, current."""

Order = Literal["little", "big"]


class FeetechMemory(ServoMemory):
    """One servo's memory; ``bytes`` holds what is read; the permanent EEPROM is separate."""

    def __init__(self, model: ServoModel, servo_id: int, firmware: int) -> None:
        scs = model.name in SCS_MODELS
        own = {
            "id": servo_id,
            "return_delay_time": RETURN_DELAY,
            "firmware_minor": firmware,
            "model_number": model.number,
            "temperature_limit": model.temperature_limit,
            "max_voltage_limit": model.max_voltage,
            "min_voltage_limit": model.min_voltage,
        }
        registers = [
            register._replace(initial=own.get(register.name, register.initial))
            for register in (SCS_REGISTERS if scs else REGISTERS).values()
        ]
        self._kept = bytearray(SIZE)
        super().__init__(registers, SIZE, EEPROM_END)
        writable = [r for r in registers if r.access == "rw"]
        self._writable = {r.address + i for r in writable for i in range(r.size)}
        last_baud = len(SCS_BAUD_RATES if scs else BAUD_RATES) - 1
        self._highest = {5: HIGHEST_ID, 6: last_baud, 33: 3}
        self._lock_at = self.registers["lock"].address

    def decode(self, register: Register, data: bytes | bytearray) -> int:
        """Return the value of a register's bytes."""
        raw = int.from_bytes(data, register.order)
        return raw if register.sign is None else signed(raw, register.sign)

    def encode(self, register: Register, value: int) -> bytes:
        """Return sign and magnitude if the register has a sign."""
        raw = value if register.sign is None else unsigned(value, register.sign)
        return raw.to_bytes(register.size, register.order)

    def set_permanently(self, name: str, value: int) -> None:
        """Set a register, in the EEPROM as well."""
        self.set(name, value)
        register = self.registers[name]
        place = slice(register.address, register.address + register.size)
        self._kept[place] = self.bytes[place]

    def power_up(self) -> None:
        """Set the start values of the RAM, and the permanent values of the EEPROM."""
        self.bytes[:EEPROM_END] = self._kept[:EEPROM_END]
        super().power_up()
        if "torque_limit" in self.registers:
            self.set("torque_limit", self.get("max_torque"))

    def write(self, address: int, data: bytes) -> list[int]:
        """Write the writable bytes; return their addresses."""
        keeps, written = not self.bytes[self._lock_at], list[int]()
        for at, byte in enumerate(data, address):
            if at in self._writable and byte <= self._highest.get(at, 0xFF):
                self.bytes[at] = byte
                if keeps and at < EEPROM_END:
                    self._kept[at] = byte
                written.append(at)
        return written


class FeetechServo(EmulatedServo):
    """One Feetech servo on the chain.

    The spec's ``firmware`` is the number after 3.

    Raises:
        ValueError: the model is unknown.
    """

    restart_ms = 800
    model: ServoModel
    memory: FeetechMemory

    def __init__(self, spec: ServoSpec, now_ms: int, make_shaft: ShaftMaker = create_shaft) -> None:
        models = {**MODELS, **SCS_MODELS}
        if spec.model not in models:
            raise ValueError(f"model {spec.model!r}: Feetech servos are {', '.join(models)}")
        model = self.model = models[spec.model]
        self._scs = spec.model in SCS_MODELS
        self.group_reads = not self._scs
        order: Order = "big" if self._scs else "little"
        self._goals, self._sensed = _GOALS[order], _SENSED[order]
        self.baud_rates = SCS_BAUD_RATES if self._scs else BAUD_RATES
        turn = SCS_STEPS * 360.0 / SCS_TRAVEL_DEG[spec.model] if self._scs else TURN
        self._top = model.no_load_rpm / 60.0 * TURN / 1000.0
        self._current_full = model.stall_current_a * 1000.0 / CURRENT_UNIT_MA
        memory = FeetechMemory(model, spec.id, spec.firmware)
        memory.set("present_input_voltage", round(model.rated_v * 10.0))
        motor = Motor(model.stall_torque_nm, model.no_load_rpm)
        super().__init__(spec, motor, memory, now_ms, make_shaft, turn / TURN)

    def _apply_settings(self) -> None:
        """Apply settings that have changed."""
        super()._apply_settings()
        self._measure()
        low, high = self.memory.get("min_position_limit"), self.memory.get("max_position_limit")
        self._range = (min(low, high), max(low, high)) if low or high else (-0x7FFF, 0x7FFF)

    def answers_instruction(self, code: int) -> bool:
        """Return whether it answers; it restarts without an answer."""
        return code != REBOOT and super().answers_instruction(code)

    def _overload_limit(self) -> tuple[float, float]:
        get = self.memory.get
        return get("overload_torque") / 100.0, get("protection_time") * TIME_UNIT_S

    def _set_controller(self) -> None:
        """Apply gains and torque limit."""
        get = self.memory.get
        most = 1.0 if self._scs else min(get("torque_limit") / TORQUE_FULL, 1.0)
        if self.errors & OVERLOAD & get("unloading_condition"):
            most = min(most, get("protective_torque") / 100.0)
        loop = Loop(
            p=P_SHARE * get("position_p_gain"),
            i=I_SHARE * get("position_i_gain"),
            d=D_SHARE * get("position_d_gain"),
            u_max=most,
        )
        self.shaft.drive(loop if self.torque else DISABLED)

    # --- motion

    def _origin(self) -> tuple[int, int]:
        return 1, 0 if self._scs else -self.memory.get("position_offset")

    def _follow(self) -> None:
        """Follow the goal registers."""
        if not self.torque:
            return
        ramp, goal, _, speed = self._goals.unpack_from(self.memory.bytes, GOALS_AT)
        low, high = self._range
        goal = max(low, min(high, signed(goal, 15)))
        place = goal / self._scale - self._shift
        cruise = min(abs(signed(speed, 15)) / self._scale / 1000.0 or self._top, self._top)
        self.shaft.lead_to(place, cruise, ramp * RAMP_UNIT)

    def _calibrate(self) -> None:
        """Set the present position to the middle; the offset is stored permanently."""
        if not self._scs:
            offset = (round(self.shaft.x) - MIDDLE + TURN // 2) % TURN - TURN // 2
            self.memory.set_permanently("position_offset", offset)
            self._wrap_to_one_turn()
            self._set_goal_here()

    # --- reading

    @property
    def error_flag(self) -> int:
        """Return the error byte of every status."""
        return self.errors

    def read(self, address: int, length: int) -> Result:
        """Return bytes of the memory; addresses without a register are 0."""
        if address < SENSED_END and address + length > SENSED_AT:
            self._sense()
        return 0, bytes(self.memory.bytes[address : address + length])

    def _sense(self) -> None:
        """Write the registers with live values, 56 to 70."""
        shaft, scale, into = self.shaft, self._scale, self.memory.bytes
        at = round((shaft.x + self._shift) * scale)
        if self._scs:
            at = max(0, min(SCS_STEPS - 1, at))
        speed = round(shaft.v * scale * 1000.0)
        goal = round((shaft.goal + self._shift) * scale) if self.torque else 0
        moving = self.torque and shaft.led or not -1 <= speed <= 1
        load, current = round(shaft.u * TORQUE_FULL), round(shaft.effort * self._current_full)
        # Half of them have no sign: the word is the value.
        self._sensed.pack_into(
            into, SENSED_AT,
            at if at >= 0 else unsigned(at, 15),
            speed if speed >= 0 else unsigned(speed, 15),
            load if load >= 0 else unsigned(load, 10),
            into[62], into[63], 0, self.errors, moving,
            goal if goal >= 0 else unsigned(goal, 15),
            current if current >= 0 else unsigned(current, 15),
        )  # fmt: skip

    # --- writing

    def write(self, address: int, data: bytes) -> int:
        """Write bytes as an instruction does; nothing is ever refused."""
        memory, end = self.memory, address + len(data)
        goal = memory.bytes[GOAL_AT:GOAL_END]
        if GOALS_AT <= address < end <= GOALS_END:
            # A shortcut for the only write of every tick.
            memory.bytes[address:end] = data
            self._take_goal(goal)
            if self.torque:
                self.followed = address, data
            return 0
        written = memory.write(address, data)
        if not written:
            return 0
        if TORQUE_AT in written:
            self._take_torque(memory.get("torque_enable"))
        elif "position_offset" in memory.registers and 31 in written:
            self._wrap_to_one_turn()
        self._apply_settings()
        if written[-1] >= GOALS_AT:
            self._take_goal(goal)
        return 0

    def _take_goal(self, goal_before: bytearray) -> None:
        """Follow new goals; one ends an overload."""
        if self.errors & OVERLOAD and self.memory.bytes[GOAL_AT:GOAL_END] != goal_before:
            self._end_overload()
        self._follow()

    def _take_torque(self, value: int) -> None:
        """Switch the torque, or make the present position the middle."""
        if value == SET_MIDDLE:
            self.memory.set("torque_enable", int(self.torque))
            self._calibrate()
            return
        if not value:
            self._end_overload()
        forbidden = self.errors & self.memory.get("unloading_condition") & ~OVERLOAD
        self._switch(value == 1 and not forbidden)

    def _end_overload(self) -> None:
        if self.errors & OVERLOAD:
            self.errors &= ~OVERLOAD
            self._heavy_checks = 0
            self._apply_settings()

    # --- errors

    def _protect_from(self, bits: int) -> None:
        """Flag voltage and heat while they are wrong, other errors until they are reset."""
        errors = self.errors & ~(HEAT | VOLTAGE) | bits
        if errors != self.errors:
            self.errors = errors
            off = errors & self.memory.get("unloading_condition") & ~OVERLOAD
            if off and self.torque:
                self._switch(False)
            self._apply_settings()
