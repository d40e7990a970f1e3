"""The registers of an emulated smart servo: bytes as they are on the wire, numbers by name."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Generic, Protocol, TypeVar


class RegisterPlace(Protocol):
    """An entry of a make's data sheet."""

    @property
    def name(self) -> str:
        """Return its name."""
        ...

    @property
    def address(self) -> int:
        """Return its first address."""
        ...

    @property
    def size(self) -> int:
        """Return its number of bytes."""
        ...

    @property
    def initial(self) -> int | None:
        """Return its start value, None if the servo decides."""
        ...

    @property
    def area(self) -> str:
        """Return "eeprom" or "ram"."""
        ...


R = TypeVar("R", bound=RegisterPlace)


class ServoMemory(ABC, Generic[R]):
    """One servo's registers.

    Args:
        registers: its registers.
        size: number of bytes.
    """

    def __init__(self, registers: Iterable[R], size: int) -> None:
        self.registers = {register.name: register for register in registers}
        self.bytes = bytearray(size)

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

    def restore(self, area: str) -> None:
        """Restore the start values of the EEPROM or of the RAM."""
        for name, register in self.registers.items():
            if register.initial is not None and register.area == area:
                self.set_permanently(name, register.initial)

    def power_up(self) -> None:
        """Set the registers to their values after power-on."""
        self.restore("ram")

    @abstractmethod
    def decode(self, register: R, data: bytes | bytearray) -> int:
        """Return the value of a register's bytes."""

    @abstractmethod
    def encode(self, register: R, value: int) -> bytes:
        """Return a register's bytes for a value."""
