"""The registers of an emulated smart servo: bytes as they are on the wire, numbers by name."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import Generic, Protocol, TypeVar


class RegisterPlace(Protocol):
    """Name, address and size of a register."""

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


R = TypeVar("R", bound=RegisterPlace)


class ServoMemory(ABC, Generic[R]):
    """One servo's registers."""

    def __init__(self, registers: Iterable[R], size: int) -> None:
        self._by_name = {register.name: register for register in registers}
        self.bytes = bytearray(size)

    def get(self, name: str) -> int:
        """Return a register's value."""
        register = self._by_name[name]
        at = register.address
        return self._decode(register, self.bytes[at : at + register.size])

    def set(self, name: str, value: int) -> None:
        """Set a register regardless of its access."""
        self.put(self._by_name[name], value)

    def set_permanently(self, name: str, value: int) -> None:
        """Set a register permanently, if that differs from ``set``."""
        self.set(name, value)

    def put(self, register: R, value: int) -> None:
        """Store a value."""
        at = register.address
        self.bytes[at : at + register.size] = self._encode(register, value)

    def has(self, name: str) -> bool:
        """Return whether this model has a register."""
        return name in self._by_name

    def register_named(self, name: str) -> R:
        """Return a register by its name."""
        return self._by_name[name]

    @abstractmethod
    def power_up(self) -> None:
        """Set the registers to their values after power-on."""

    @abstractmethod
    def _decode(self, register: R, data: bytes | bytearray) -> int:
        """Return the value of a register's bytes."""

    @abstractmethod
    def _encode(self, register: R, value: int) -> bytes:
        """Return a register's bytes for a value."""
