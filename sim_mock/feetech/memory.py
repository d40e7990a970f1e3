"""The memory of an emulated Feetech servo as bytes: permitted writes, permanent values.

Nothing is ever refused: a write to a read-only register, or of an id, baud rate or mode that
does not exist, is answered like any other and changes nothing. While Lock is 1, a write to the
EEPROM area lasts until power-off; only writes while it is 0 are permanent.
Source: Feetech, memory table of the STS series.
"""

from collections.abc import Callable, Iterable

from gazerig.drivers.feetech.memory_table import FeetechModel
from gazerig.sim_mock.feetech.packets import signed, unsigned
from gazerig.sim_mock.feetech.tables import STS, EmulatedFeetechRegister, Table
from gazerig.sim_mock.smart_servo.memory import ServoMemory

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
        self, model: FeetechModel, servo_id: int, firmware: int, table: Table = STS
    ) -> None:
        registers = (*table.kept, *table.ram, *table.fixed, *table.absent)
        super().__init__(registers, SIZE + ABSENT_SIZE)
        self._model = model
        self.table = table
        self._kept_at = _bytes_of(table.kept)
        self._writable = self._kept_at | _bytes_of(table.ram)
        self._kept = bytearray(SIZE + ABSENT_SIZE)
        for register in registers:
            self.put(register, register.initial)
        self.set("firmware_minor", firmware)
        self.set("model_number", model.number)
        self.factory_settings()
        self.keep("id", servo_id)

    def _decode(self, register: EmulatedFeetechRegister, data: bytes | bytearray) -> int:
        raw = int.from_bytes(data, self.table.order)
        return raw if register.sign is None else signed(raw, register.sign)

    def _encode(self, register: EmulatedFeetechRegister, value: int) -> bytes:
        """Return sign and magnitude if the register has a sign."""
        raw = value if register.sign is None else unsigned(value, register.sign)
        return raw.to_bytes(register.size, self.table.order)

    def keep(self, name: str, value: int) -> None:
        """Set a register, in the EEPROM as well."""
        self.set(name, value)
        _, address, size, _, _ = self.named(name)
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
        for register in self.table.kept:
            if register.name != "id":
                self.keep(register.name, own.get(register.name, register.initial))

    def power_up(self) -> None:
        """Set the start values of the RAM, and the permanent values of the EEPROM."""
        for address in self._kept_at:
            self.bytes[address] = self._kept[address]
        for register in (*self.table.ram, self.named("registered_instruction")):
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
