"""The memory of an emulated Feetech servo, series STS and SCS: registers, permitted writes.

Nothing is ever refused: a write to a read-only register, or of an id, baud rate or mode that
does not exist, is answered like any other and changes nothing. While Lock is 1, a write to the
EEPROM area lasts until power-off; only writes while it is 0 are permanent.

SCS servos use the same packets with the high byte of a word first. Their position is measured by
a potentiometer of 1024 steps over less than a turn; with both angle limits 0 the duty in Goal
Time (44) drives them. They answer no sync read and have no offset, torque limit or current.

Sources: Feetech, memory table of the STS series and SCSCL of its SDK (addresses); rustypot's table
of the SCS0009. Start values marked [A] are assumed, [R] were read by owners.
"""

from collections.abc import Callable, Iterable, Mapping
from typing import Literal, NamedTuple

from gazerig.drivers.feetech.memory_table import (
    BAUD_RATES,
    HIGHEST_ID,
    MODELS,
    SCS_BAUD_RATES,
    SCS_MODELS,
    SCS_STEPS,
    FeetechModel,
)
from gazerig.sim_mock.feetech.packets import signed, unsigned
from gazerig.sim_mock.smart_servo.memory import ServoMemory

SERVO, WHEEL, PWM, STEP = 0, 1, 2, 3
"""Operating modes (33)."""


class EmulatedFeetechRegister(NamedTuple):
    """One register; ``sign``: the bit of its sign, None without a sign."""

    name: str
    address: int
    size: int = 1
    initial: int = 0
    sign: int | None = None


def _with_start_values(
    registers: tuple[EmulatedFeetechRegister, ...], **initial: int
) -> tuple[EmulatedFeetechRegister, ...]:
    """Return registers with other start values."""
    return tuple(r._replace(initial=initial.get(r.name, r.initial)) for r in registers)


_KEPT = (
    EmulatedFeetechRegister("id", 5, initial=1),
    EmulatedFeetechRegister("baud_rate", 6),
    EmulatedFeetechRegister("return_delay_time", 7, initial=250),  # [R]; 2 us
    EmulatedFeetechRegister("status_return_level", 8, initial=1),
    EmulatedFeetechRegister("min_position_limit", 9, 2),
    EmulatedFeetechRegister("max_position_limit", 11, 2, 4095),
    EmulatedFeetechRegister("temperature_limit", 13, initial=70),
    EmulatedFeetechRegister("max_voltage_limit", 14, initial=80),
    EmulatedFeetechRegister("min_voltage_limit", 15, initial=40),
    EmulatedFeetechRegister("max_torque", 16, 2, 1000),
    EmulatedFeetechRegister(
        "phase", 18, initial=12
    ),  # [R]: speeds in steps/s, speed 0 is the highest
    EmulatedFeetechRegister(
        "unloading_condition", 19, initial=0x2C
    ),  # [R]: overheat, overcurrent, overload
    EmulatedFeetechRegister("led_alarm_condition", 20, initial=0x2F),  # [R]
    EmulatedFeetechRegister("position_p_gain", 21, initial=32),  # [R]
    EmulatedFeetechRegister("position_d_gain", 22, initial=32),  # [R]
    EmulatedFeetechRegister("position_i_gain", 23),
    EmulatedFeetechRegister("minimum_startup_force", 24, 2, 16),  # [R]
    EmulatedFeetechRegister("cw_dead_zone", 26, initial=1),
    EmulatedFeetechRegister("ccw_dead_zone", 27, initial=1),
)
_STS_KEPT = (
    *_KEPT,
    EmulatedFeetechRegister("protection_current", 28, 2, 500),  # [R]; 6.5 mA
    EmulatedFeetechRegister("angular_resolution", 30, initial=1),
    EmulatedFeetechRegister("position_offset", 31, 2, sign=11),
    EmulatedFeetechRegister("operating_mode", 33),
    EmulatedFeetechRegister("protective_torque", 34, initial=20),
    EmulatedFeetechRegister("protection_time", 35, initial=200),
    EmulatedFeetechRegister("overload_torque", 36, initial=80),
    EmulatedFeetechRegister("velocity_p_gain", 37, initial=10),  # [R]
    EmulatedFeetechRegister("overcurrent_time", 38, initial=200),
    EmulatedFeetechRegister("velocity_i_gain", 39, initial=200),  # [A]
    # Set in the factory.
    EmulatedFeetechRegister("moving_threshold", 80, initial=1),  # [A]
    EmulatedFeetechRegister("dts", 81),
    EmulatedFeetechRegister("velocity_unit_factor", 82, initial=1),
    EmulatedFeetechRegister("hts", 83),
    EmulatedFeetechRegister("max_velocity_limit", 84),  # 50 steps/s, as of the model
    EmulatedFeetechRegister("max_acceleration", 85, initial=254),  # [R]
    EmulatedFeetechRegister("acceleration_factor", 86, initial=1),
)
_SCS_KEPT = (
    # The values of STS servos are assumed for these servos as well [A].
    *_with_start_values(
        _KEPT, max_position_limit=1023, unloading_condition=0x24, led_alarm_condition=0x25
    ),
    EmulatedFeetechRegister("protective_torque", 37, initial=20),
    EmulatedFeetechRegister("protection_time", 38, initial=200),
    EmulatedFeetechRegister("overload_torque", 39, initial=80),
    EmulatedFeetechRegister("pwm_step", 78),
    EmulatedFeetechRegister("moving_threshold", 79, initial=1),  # [A]
    EmulatedFeetechRegister("dts", 80),
    EmulatedFeetechRegister("min_velocity_limit", 81),
    EmulatedFeetechRegister("max_velocity_limit", 82),  # 50 steps/s, as of the model
)
_RAM = (
    EmulatedFeetechRegister("torque_enable", 40),
    EmulatedFeetechRegister("acceleration", 41),
    EmulatedFeetechRegister("goal_position", 42, 2, sign=15),
    EmulatedFeetechRegister(
        "goal_time", 44, 2
    ),  # the duty in modes with a duty, its sign in bit 10
    EmulatedFeetechRegister("goal_speed", 46, 2, sign=15),
)
_FIXED = (
    EmulatedFeetechRegister("firmware_major", 0, initial=3),
    EmulatedFeetechRegister("firmware_minor", 1),
    EmulatedFeetechRegister("endianness", 2),
    EmulatedFeetechRegister("model_number", 3, 2),
    EmulatedFeetechRegister("registered_instruction", 64),
)
_ABSENT_FROM_SCS = (
    EmulatedFeetechRegister("protection_current", 256, 2, 0xFFFF),
    EmulatedFeetechRegister("position_offset", 258, 2),
    EmulatedFeetechRegister("operating_mode", 260),
    EmulatedFeetechRegister("overcurrent_time", 261, initial=255),
    EmulatedFeetechRegister("torque_limit", 262, 2, 1000),
    EmulatedFeetechRegister("velocity_p_gain", 264, initial=10),
    EmulatedFeetechRegister("velocity_i_gain", 265, initial=200),
)


class FeetechTable(NamedTuple):
    """Registers of one series of servos.

    permanent: permanent registers; ram: registers with start values; fixed: read-only registers
    absent: registers that a series lacks but its emulated motor uses; they cannot be read
    order: byte order of words
    lock_at: the register that makes writes temporary
    highest: largest valid value, by address
    turn_steps: steps of the position per whole turn
    last_step: end of the position sensor, None if it is continuous
    sync_read: whether its servos answer a sync read
    baud_rates: bit/s by the value of their register
    """

    permanent: tuple[EmulatedFeetechRegister, ...]
    ram: tuple[EmulatedFeetechRegister, ...]
    lock_at: int
    highest: Mapping[int, int]
    fixed: tuple[EmulatedFeetechRegister, ...] = _FIXED
    absent: tuple[EmulatedFeetechRegister, ...] = ()
    order: Literal["little", "big"] = "little"
    turn_steps: float = 4096.0
    last_step: int | None = None
    sync_read: bool = True
    baud_rates: tuple[int, ...] = BAUD_RATES


STS = FeetechTable(
    permanent=_STS_KEPT,
    ram=(
        *_RAM,
        EmulatedFeetechRegister("torque_limit", 48, 2),
        EmulatedFeetechRegister("lock", 55, initial=1),
    ),
    lock_at=55,
    highest={5: HIGHEST_ID, 6: len(BAUD_RATES) - 1, 33: STEP},
)


def _scs(travel_deg: float) -> FeetechTable:
    """Return the registers of a model."""
    return FeetechTable(
        permanent=_SCS_KEPT,
        ram=(*_RAM, EmulatedFeetechRegister("lock", 48, initial=1)),
        lock_at=48,
        highest={5: HIGHEST_ID, 6: len(SCS_BAUD_RATES) - 1},
        absent=_ABSENT_FROM_SCS,
        order="big",
        turn_steps=SCS_STEPS * 360.0 / travel_deg,
        last_step=SCS_STEPS - 1,
        sync_read=False,
        baud_rates=SCS_BAUD_RATES,
    )


SCS = {"scs0009": _scs(300.0), "scs15": _scs(200.0)}


def model_and_table(model: str) -> tuple[FeetechModel, FeetechTable]:
    """Return a model and the registers of its series.

    Raises:
        ValueError: the model is unknown.
    """
    if model in SCS:
        return SCS_MODELS[model], SCS[model]
    if model not in MODELS:
        raise ValueError(f"model {model!r}: Feetech servos are {', '.join((*MODELS, *SCS))}")
    return MODELS[model], STS


SIZE = 256
"""Addresses without a register read 0."""
ABSENT_SIZE = 32
SPEED_UNIT_STEPS_S = 50
"""Unit of the register of the highest speed."""


def _bytes_of(registers: Iterable[EmulatedFeetechRegister]) -> frozenset[int]:
    return frozenset(r.address + i for r in registers for i in range(r.size))


class FeetechMemory(ServoMemory[EmulatedFeetechRegister]):
    """One servo's memory; ``bytes`` holds what is read; the permanent EEPROM is separate."""

    def __init__(
        self, model: FeetechModel, servo_id: int, firmware: int, table: FeetechTable = STS
    ) -> None:
        registers = (*table.permanent, *table.ram, *table.fixed, *table.absent)
        super().__init__(registers, SIZE + ABSENT_SIZE)
        self._model = model
        self.table = table
        self._kept_at = _bytes_of(table.permanent)
        self._writable = self._kept_at | _bytes_of(table.ram)
        self._kept = bytearray(SIZE + ABSENT_SIZE)
        for register in registers:
            self.put(register, register.initial)
        self.set("firmware_minor", firmware)
        self.set("model_number", model.number)
        self.factory_settings()
        self.set_permanently("id", servo_id)

    def _decode(self, register: EmulatedFeetechRegister, data: bytes | bytearray) -> int:
        raw = int.from_bytes(data, self.table.order)
        return raw if register.sign is None else signed(raw, register.sign)

    def _encode(self, register: EmulatedFeetechRegister, value: int) -> bytes:
        """Return sign and magnitude if the register has a sign."""
        raw = value if register.sign is None else unsigned(value, register.sign)
        return raw.to_bytes(register.size, self.table.order)

    def set_permanently(self, name: str, value: int) -> None:
        """Set a register, in the EEPROM as well."""
        self.set(name, value)
        _, address, size, _, _ = self.register_named(name)
        self._kept[address : address + size] = self.bytes[address : address + size]

    def factory_settings(self) -> None:
        """Restore the factory settings of the EEPROM, except the id."""
        model = self._model
        own = {
            "temperature_limit": model.temperature_limit,
            "max_voltage_limit": model.max_voltage,
            "min_voltage_limit": model.min_voltage,
            "max_velocity_limit": round(model.no_load_steps_s / SPEED_UNIT_STEPS_S),
        }
        for register in self.table.permanent:
            if register.name != "id":
                self.set_permanently(register.name, own.get(register.name, register.initial))

    def power_up(self) -> None:
        """Set the start values of the RAM, and the permanent values of the EEPROM."""
        for address in self._kept_at:
            self.bytes[address] = self._kept[address]
        for register in (*self.table.ram, self.register_named("registered_instruction")):
            self.put(register, register.initial)
        self.set("torque_limit", self.get("max_torque"))

    def read(self, address: int, length: int) -> bytes:
        """Return bytes as they are on the wire; addresses without a register are 0."""
        return bytes(self.bytes[address : min(SIZE, address + length)]).ljust(length, b"\0")

    def write(self, address: int, data: bytes, changed: Callable[[int], None]) -> None:
        """Write the writable bytes; call ``changed`` with each address that was written."""
        keeps, highest = self.bytes[self.table.lock_at] == 0, self.table.highest
        for at, byte in enumerate(data, address):
            if at not in self._writable or byte > highest.get(at, 0xFF):
                continue
            self.bytes[at] = byte
            if keeps and at in self._kept_at:
                self._kept[at] = byte
            changed(at)
