"""The memory of an emulated STS servo as bytes: what may be written, and what is kept.

Nothing is ever refused: a write to what cannot be written, or of an id, baud rate or mode that
does not exist, is answered like any other and changes nothing. While Lock (55) is 1 a write to
the EEPROM area counts until the power goes; only what is written while it is 0 is kept.
Source: Feetech, memory table of the STS series; start values marked [A] are assumed, [R] are
those that owners read out of an STS3215.
"""

from collections.abc import Callable, Mapping
from typing import Literal, NamedTuple

from gazerig.drivers.feetech.memory_table import BAUD_RATES, HIGHEST_ID, FeetechModel
from gazerig.sim_mock.feetech.packets import signed

SIZE = 256
"""What is not a register reads 0."""
ABSENT_SIZE = 32

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


class Table(NamedTuple):
    """The registers of one series of servos.

    eeprom, factory: kept without power; ram: given start values; fixed: never written
    absent: what a series lacks and its motor goes by all the same; beyond what can be read
    order: which byte of two comes first
    lock_at: the register that keeps what is written from being kept
    highest: largest value that exists, by address
    turn_steps: steps of the position a whole turn would have
    last_step: where the sensor of the position ends, None where it goes round
    sync_read: its servos answer a sync read
    baud_rates: bit/s by the value of their register
    """

    eeprom: tuple[Register, ...] = EEPROM
    factory: tuple[Register, ...] = FACTORY
    ram: tuple[Register, ...] = RAM
    fixed: tuple[Register, ...] = FIXED
    absent: tuple[Register, ...] = ()
    order: Literal["little", "big"] = "little"
    lock_at: int = LOCK_AT
    highest: Mapping[int, int] = {5: HIGHEST_ID, 6: len(BAUD_RATES) - 1, 33: STEP}
    turn_steps: float = 4096.0
    last_step: int | None = None
    sync_read: bool = True
    baud_rates: tuple[int, ...] = BAUD_RATES


STS = Table()


def _bytes_of(registers: tuple[Register, ...]) -> frozenset[int]:
    return frozenset(r.address + i for r in registers for i in range(r.size))


SPEED_UNIT_STEPS_S = 50
"""Unit of Maximum Speed (84)."""


class FeetechMemory:
    """One servo's memory; ``bytes`` is what is read, the EEPROM's own content stands apart."""

    def __init__(
        self, model: FeetechModel, servo_id: int, firmware: int, table: Table = STS
    ) -> None:
        self._model = model
        self.table = table
        kept = (*table.eeprom, *table.factory)
        registers = (*kept, *table.ram, *table.fixed, *table.absent)
        self._registers = {register.name: register for register in registers}
        self._kept_at = _bytes_of(kept)
        self._writable = self._kept_at | _bytes_of(table.ram)
        self.bytes = bytearray(SIZE + ABSENT_SIZE)
        self._kept = bytearray(SIZE + ABSENT_SIZE)
        for register in registers:
            self.set(register.name, register.initial)
        self.set("firmware_minor", firmware)
        self.set("model", model.number)
        self.factory_settings()
        self.keep("id", servo_id)

    def get(self, name: str) -> int:
        """Return a register's value, with its sign where it has one."""
        _, address, size, _, sign = self._registers[name]
        raw = int.from_bytes(self.bytes[address : address + size], self.table.order)
        return raw if sign is None else signed(raw, sign)

    def set(self, name: str, raw: int) -> None:
        """Set a register as it is on the wire; the EEPROM keeps what it has."""
        _, address, size, _, _ = self._registers[name]
        self.bytes[address : address + size] = raw.to_bytes(size, self.table.order)

    def keep(self, name: str, raw: int) -> None:
        """Set a register as it is on the wire, in the EEPROM as well."""
        self.set(name, raw)
        _, address, size, _, _ = self._registers[name]
        self._kept[address : address + size] = self.bytes[address : address + size]

    def factory_settings(self) -> None:
        """Put everything in the EEPROM as it left the factory, except the id."""
        for register in (*self.table.eeprom, *self.table.factory):
            if register.name != "id":
                self.keep(register.name, register.initial)
        model = self._model
        self.keep("temperature_limit", model.temperature_limit)
        self.keep("max_voltage", model.max_voltage)
        self.keep("min_voltage", model.min_voltage)
        top_steps_s = model.no_load_rpm / 60.0 * model.steps_per_turn
        self.keep("max_speed", round(top_steps_s / SPEED_UNIT_STEPS_S))

    def power_up(self) -> None:
        """Return the RAM its start values and the EEPROM area what was kept."""
        for address in self._kept_at:
            self.bytes[address] = self._kept[address]
        for register in (*self.table.ram, self._registers["registered"]):
            self.set(register.name, register.initial)
        self.set("torque_limit", self.get("max_torque"))

    def read(self, address: int, length: int) -> bytes:
        """Return bytes as they are on the wire; what is no register is 0."""
        return bytes(self.bytes[address : min(SIZE, address + length)]).ljust(length, b"\0")

    def write(self, address: int, data: bytes, changed: Callable[[int], None]) -> None:
        """Write what can be written; ``changed`` is told of every address that was."""
        keeps, highest = self.bytes[self.table.lock_at] == 0, self.table.highest
        for at, byte in enumerate(data, address):
            if at not in self._writable or byte > highest.get(at, 0xFF):
                continue
            self.bytes[at] = byte
            if keeps and at in self._kept_at:
                self._kept[at] = byte
            changed(at)
