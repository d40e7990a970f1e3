"""The registers of an emulated smart servo: bytes as they are on the wire, numbers by name."""

from collections.abc import Iterable

from gazerig.drivers.dynamixel.control_table import DynamixelRegister
from gazerig.drivers.feetech.memory_table import FeetechRegister

Register = DynamixelRegister | FeetechRegister


class ServoMemory:
    """One servo's registers: the places are those of the driver's table of its make.

    Args:
        registers: its registers.
        size: number of bytes.
    """

    def __init__(self, registers: Iterable[Register], size: int) -> None:
        self.registers = {register.name: register for register in registers}
        self.bytes = bytearray(size)

    def get(self, name: str) -> int:
        """Return a register's value."""
        register = self.registers[name]
        at = register.address
        return register.decode(bytes(self.bytes[at : at + register.size]))

    def set(self, name: str, value: int) -> None:
        """Set a register regardless of its access."""
        register = self.registers[name]
        at = register.address
        self.bytes[at : at + register.size] = register.encode(value)

    def set_permanently(self, name: str, value: int) -> None:
        """Set a register so that a restart keeps it."""
        self.set(name, value)

    def restore(self, eeprom: bool) -> None:
        """Restore the start values of the EEPROM or of the RAM."""
        for name, register in self.registers.items():
            if register.initial is not None and (register.area == "eeprom") == eeprom:
                self.set_permanently(name, register.initial)

    def power_up(self) -> None:
        """Set the registers to their values after power-on."""
        self.restore(eeprom=False)
