"""The memory of an emulated STS servo as bytes: what may be written, and what is kept.

Nothing is ever refused: a write to what cannot be written, or of an id, baud rate or mode that
does not exist, is answered like any other and changes nothing. While Lock (55) is 1 a write to
the EEPROM area counts until the power goes; only what is written while it is 0 is kept.
Source: Feetech, memory table of the STS series; start values marked [A] are assumed, [R] are
those that owners read out of an STS3215.
"""

from collections.abc import Callable
from typing import NamedTuple

from drivers.feetech.memory_table import BAUD_RATES, HIGHEST_ID, FeetechModel
from sim_mock.feetech.packets import signed

SIZE = 256
"""What is not a register reads 0."""

SERVO, WHEEL, PWM, STEP = 0, 1, 2, 3
"""Operating modes (33)."""

LOCK_AT = 55


class Register(NamedTuple):
    """One register; ``sign``: the bit its sign stands in, None where it has none."""

    name: str
    address: int
    size: int = 1
    initial: int = 0
    sign: int | None = None


EEPROM = (
    Register("id", 5, initial=1),
    Register("baud_rate", 6),
    Register("return_delay", 7, initial=250),  # [R]; 2 us
    Register("status_level", 8, initial=1),
    Register("min_angle", 9, 2),
    Register("max_angle", 11, 2, 4095),
    Register("temperature_limit", 13, initial=70),
    Register("max_voltage", 14, initial=80),
    Register("min_voltage", 15, initial=40),
    Register("max_torque", 16, 2, 1000),
    Register("phase", 18, initial=12),  # [R]: speeds in steps/s, speed 0 is the highest
    Register("unload_conditions", 19, initial=0x2C),  # [R]: overheat, overcurrent, overload
    Register("led_conditions", 20, initial=0x2F),  # [R]
    Register("p_gain", 21, initial=32),  # [R]
    Register("d_gain", 22, initial=32),  # [R]
    Register("i_gain", 23),
    Register("minimum_force", 24, 2, 16),  # [R]
    Register("dead_zone_cw", 26, initial=1),
    Register("dead_zone_ccw", 27, initial=1),
    Register("protection_current", 28, 2, 500),  # [R]; 6.5 mA
    Register("resolution", 30, initial=1),
    Register("offset", 31, 2, sign=11),
    Register("mode", 33),
    Register("protective_torque", 34, initial=20),
    Register("protection_time", 35, initial=200),
    Register("overload_torque", 36, initial=80),
    Register("speed_p_gain", 37, initial=10),  # [R]
    Register("overcurrent_time", 38, initial=200),
    Register("speed_i_gain", 39, initial=200),  # [A]
)
FACTORY = (
    Register("moving_threshold", 80, initial=1),  # [A]
    Register("factory_81", 81),
    Register("speed_unit", 82, initial=1),
    Register("factory_83", 83),
    Register("max_speed", 84),  # 50 steps/s, as the model is
    Register("max_acceleration", 85, initial=254),  # [R]
    Register("acceleration_factor", 86, initial=1),
)
RAM = (
    Register("torque", 40),
    Register("acceleration", 41),
    Register("goal_position", 42, 2, sign=15),
    Register("goal_time", 44, 2),  # in mode PWM the duty, its sign in bit 10
    Register("goal_speed", 46, 2, sign=15),
    Register("torque_limit", 48, 2),
    Register("lock", LOCK_AT, initial=1),
)
FIXED = (
    Register("firmware_major", 0, initial=3),
    Register("firmware_minor", 1),
    Register("big_endian", 2),
    Register("model", 3, 2),
    Register("registered", 64),
)
REGISTERS = {register.name: register for register in (*EEPROM, *FACTORY, *RAM, *FIXED)}

_HIGHEST = {5: HIGHEST_ID, 6: len(BAUD_RATES) - 1, 33: STEP}
"""Highest value that exists, by address."""


def _bytes_of(registers: tuple[Register, ...]) -> frozenset[int]:
    return frozenset(r.address + i for r in registers for i in range(r.size))


_KEPT = _bytes_of((*EEPROM, *FACTORY))
_WRITABLE = _KEPT | _bytes_of(RAM)
SPEED_UNIT_STEPS_S = 50
"""Unit of Maximum Speed (84)."""


class FeetechMemory:
    """One servo's memory; ``bytes`` is what is read, the EEPROM's own content stands apart."""

    def __init__(self, model: FeetechModel, servo_id: int, firmware: int) -> None:
        self._model = model
        self.bytes = bytearray(SIZE)
        self._kept = bytearray(SIZE)
        for register in (*EEPROM, *FACTORY, *RAM, *FIXED):
            self.set(register.name, register.initial)
        self.set("firmware_minor", firmware)
        self.set("model", model.number)
        self.factory_settings()
        self.keep("id", servo_id)

    def get(self, name: str) -> int:
        """Give a register's value, with its sign where it has one."""
        _, address, size, _, sign = REGISTERS[name]
        raw = int.from_bytes(self.bytes[address : address + size], "little")
        return raw if sign is None else signed(raw, sign)

    def set(self, name: str, raw: int) -> None:
        """Set a register as it is on the wire; the EEPROM keeps what it has."""
        _, address, size, _, _ = REGISTERS[name]
        self.bytes[address : address + size] = raw.to_bytes(size, "little")

    def keep(self, name: str, raw: int) -> None:
        """Set a register as it is on the wire, in the EEPROM as well."""
        self.set(name, raw)
        _, address, size, _, _ = REGISTERS[name]
        self._kept[address : address + size] = self.bytes[address : address + size]

    def factory_settings(self) -> None:
        """Put everything in the EEPROM as it left the factory, except the id."""
        for register in (*EEPROM, *FACTORY):
            if register.name != "id":
                self.keep(register.name, register.initial)
        model = self._model
        self.keep("temperature_limit", model.temperature_limit)
        self.keep("max_voltage", model.max_voltage)
        self.keep("min_voltage", model.min_voltage)
        top_steps_s = model.no_load_rpm / 60.0 * model.steps_per_turn
        self.keep("max_speed", round(top_steps_s / SPEED_UNIT_STEPS_S))

    def power_up(self) -> None:
        """Give the RAM its start values and the EEPROM area what was kept."""
        for address in _KEPT:
            self.bytes[address] = self._kept[address]
        for register in (*RAM, REGISTERS["registered"]):
            self.set(register.name, register.initial)
        self.set("torque_limit", self.get("max_torque"))

    def read(self, address: int, length: int) -> bytes:
        """Give bytes as they are on the wire; what is no register is 0."""
        return bytes(self.bytes[address : address + length]).ljust(length, b"\0")

    def write(self, address: int, data: bytes, changed: Callable[[int], None]) -> None:
        """Write what can be written; ``changed`` is told of every address that was."""
        keeps = self.bytes[LOCK_AT] == 0
        for at, byte in enumerate(data, address):
            if at not in _WRITABLE or byte > _HIGHEST.get(at, 0xFF):
                continue
            self.bytes[at] = byte
            if keeps and at in _KEPT:
                self._kept[at] = byte
            changed(at)
