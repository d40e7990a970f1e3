"""The registers of an emulated smart servo: bytes as they are on the wire, numbers by name."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Any


class ServoMemory(ABC):
    """One servo's registers.

    Args:
        registers: entries of its make's data sheet, with name, address, size and initial value.
        size: number of bytes.
        eeprom_end: address of the first register of the RAM.
    """

    def __init__(self, registers: Iterable[Any], size: int, eeprom_end: int) -> None:
        self.registers = {register.name: register for register in registers}
        self.bytes = bytearray(size)
        self._eeprom_end = eeprom_end
        self.restore(eeprom=True)

    def get(self, name: str) -> int:
        """Return a register's value."""
        register = self.registers[name]
        at = register.address
        return self.decode(register, self.bytes[at : at + register.size])

    def set(self, name: str, value: int) -> None:
        """Set a register regardless of its access."""
        register = self.registers[name]
        at = register.address
        self.bytes[at : at + register.size] = self.encode(register, value)

    def set_permanently(self, name: str, value: int) -> None:
        """Set a register so that a restart keeps it."""
        self.set(name, value)

    def restore(self, eeprom: bool) -> None:
        """Restore the start values of the EEPROM or of the RAM."""
        for name, register in self.registers.items():
            is_kept = register.address < self._eeprom_end
            if register.initial is not None and is_kept == eeprom:
                self.set_permanently(name, register.initial)

    def power_up(self) -> None:
        """Set the registers to their values after power-on."""
        self.restore(eeprom=False)

    @abstractmethod
    def decode(self, register: Any, data: bytes | bytearray) -> int:
        """Return the value of a register's bytes."""

    @abstractmethod
    def encode(self, register: Any, value: int) -> bytes:
        """Return a register's bytes for a value."""
