"""The control table of an emulated servo as bytes: access, ranges, indirect windows.

It applies the rules that follow from the table alone. gazerig.sim_mock.dynamixel.servo applies
those that need the servo's state (EEPROM lock, limit registers, watchdog).
"""

import struct
from collections.abc import Callable, Iterable, Iterator
from operator import itemgetter
from typing import NamedTuple

from gazerig.drivers.dynamixel.control_table import (
    EEPROM_END,
    DynamixelModel,
    DynamixelRegister,
    IndirectBlock,
    indirect_blocks,
    registers_of,
)
from gazerig.sim_mock.smart_servo.memory import ServoMemory

SENSED, SENSED_AT = struct.Struct("<hii"), 126
"""Current, velocity, position: a control loop reads them every tick."""
SURROUNDINGS, SURROUNDINGS_AT = struct.Struct("<HB"), 144
"""Voltage and temperature."""
MOTION, MOTION_AT = struct.Struct("<HBBh"), 120
"""Tick, moving, moving status, PWM."""
REFERENCE, REFERENCE_AT = struct.Struct("<ii"), 136
"""Velocity and position of the profile."""

SENSED_SPAN = SENSED_AT, REFERENCE_AT
SURROUNDINGS_SPAN = SURROUNDINGS_AT, SURROUNDINGS_AT + SURROUNDINGS.size
PROFILED = ((MOTION_AT, SENSED_AT), (REFERENCE_AT, SURROUNDINGS_AT))
"""Their addresses; the last two are the profile's, which a control loop rarely reads."""


# Numbers of the status error byte (Protocol 2.0).
RESULT_FAIL = 1
INSTRUCTION_ERROR = 2
DATA_RANGE = 4
DATA_LENGTH = 5
DATA_LIMIT = 6
ACCESS = 7

NOT_STORED = (
    "torque_enable", "bus_watchdog", "goal_pwm", "goal_current", "goal_velocity", "goal_position",
)  # fmt: skip
"""A backup (instruction 0x20) omits registers that move the servo [assumed: not documented]."""

Fields = tuple[tuple[DynamixelRegister, int], ...]
"""Registers with the values to write."""


class ResolvedRange(NamedTuple):
    """Real addresses of a range, resolved through the indirect windows.

    runs: first address and end of each run of neighbours
    fetch: returns the bytes of all real addresses, in runs of neighbours
    sensed, surroundings, profiled: whether the range contains sensor values, voltage or
        temperature, or the state of the profile
    """

    runs: tuple[tuple[int, int], ...]
    fetch: Callable[[bytearray], Iterable[bytearray]]
    sensed: bool
    surroundings: bool
    profiled: bool


class SensedWindow(NamedTuple):
    """Current, velocity and position among registers that rarely change, as a block is packed.

    layout: error, id, ``before``, current, velocity, position, ``after``
    surroundings: whether the others include voltage or temperature
    """

    layout: struct.Struct
    before: bytes
    after: bytes
    surroundings: bool


GOAL_AT, GOAL_END = 116, 120
"""Addresses of the goal position."""


class DynamixelMemory(ServoMemory[DynamixelRegister]):
    """One servo's control table."""

    def __init__(self, model: DynamixelModel, firmware: int) -> None:
        blocks = indirect_blocks(model, firmware)
        registers = registers_of(model) + tuple(_window_registers(blocks))
        size = max(register.address + register.size for register in registers)
        super().__init__(registers, size)
        self._by_address = {register.address: register for register in registers}
        self._layouts: dict[tuple[int, int], tuple[DynamixelRegister, ...] | int] = {}
        self._windows = [(b.data_base, b.data_base + b.entries, b.address_base) for b in blocks]
        self._window_low = min(low for low, _, _ in self._windows)
        self._pointers_low = min(pointers for _, _, pointers in self._windows)
        self.windows: dict[tuple[int, int, int], SensedWindow | None] = {}
        """Windows by their request, valid until any other byte in them changes."""
        self.gathers: dict[tuple[int, int], ResolvedRange] = {}
        """Ranges that were read, valid until an indirect address changes."""
        self._defined = bytearray(size)
        for register in registers:
            end = register.address + register.size
            self._defined[register.address : end] = b"\x01" * register.size
        self.restore(lambda register: True)

    def restore(self, chosen: Callable[[DynamixelRegister], bool]) -> None:
        """Restore the initial values of the chosen registers."""
        for register in self._by_address.values():
            if register.initial is not None and chosen(register):
                self.put(register, register.initial)

    def power_up(self) -> None:
        """Set the start values of the RAM area."""
        self.restore(lambda register: not in_eeprom(register))

    def writable(self) -> Iterator[DynamixelRegister]:
        """Yield the writable registers except indirect data, which refers to other registers."""
        for register in self._by_address.values():
            if register.access == "rw" and not register.name.startswith("indirect_data"):
                yield register

    def put(self, register: DynamixelRegister, value: int) -> None:
        """Store a value."""
        super().put(register, value)
        self.windows.clear()
        if register.address >= self._pointers_low:
            self.gathers.clear()

    def _decode(self, register: DynamixelRegister, data: bytes | bytearray) -> int:
        return int.from_bytes(data, "little", signed=register.signed)

    def _encode(self, register: DynamixelRegister, value: int) -> bytes:
        """Return the value's bytes, in two's complement if it is negative."""
        return (value & ((1 << 8 * register.size) - 1)).to_bytes(register.size, "little")

    def read(self, address: int, length: int) -> bytes | None:
        """Return bytes as they are on the wire, None if an address is not defined."""
        gather = self.gather(address, length)
        return None if gather is None else self.collect(gather)

    def collect(self, gather: ResolvedRange) -> bytes:
        """Return the bytes at resolved addresses."""
        return b"".join(gather.fetch(self.bytes))

    def gather(self, address: int, length: int) -> ResolvedRange | None:
        """Return the real addresses of a range, None if an address is not defined.

        The result is cached, because a control loop reads the same ranges repeatedly.
        """
        found = self.gathers.get((address, length))
        if found is None:
            defined = self._defined[address : address + length]
            if length == 0 or len(defined) != length or 0 in defined:
                return None
            end = address + length
            runs: list[list[int]] = []
            for real in map(self.real, range(address, end)):
                if runs and runs[-1][1] == real:
                    runs[-1][1] = real + 1
                else:
                    runs.append([real, real + 1])

            def touches(*spans: tuple[int, int]) -> bool:
                return any(low < end and high > at for low, high in runs for at, end in spans)

            slices = [slice(low, high) for low, high in runs]
            # With a single slice, itemgetter would return the bytes themselves.
            found = self.gathers[address, length] = ResolvedRange(
                tuple((low, high) for low, high in runs),
                itemgetter(*slices, slice(0, 0)),
                touches(SENSED_SPAN),
                touches(SURROUNDINGS_SPAN),
                touches(*PROFILED),
            )
        return found

    def window(self, wanted: tuple[int, int, int]) -> "SensedWindow | None":
        """Return the layout of a servo's part of a fast read, None if it is not that simple.

        Args:
            wanted: id, address, length.
        """
        gather = self.gather(*wanted[1:])
        found: SensedWindow | None = None
        if gather is not None and SENSED_SPAN in gather.runs and not gather.profiled:
            at = gather.runs.index(SENSED_SPAN)
            before, after = gather.runs[:at], gather.runs[at + 1 :]
            if not any(low < GOAL_END and high > GOAL_AT for low, high in gather.runs):
                start = b"".join([self.bytes[low:high] for low, high in before])
                end = b"".join([self.bytes[low:high] for low, high in after])
                layout = struct.Struct(f"<BB{len(start)}shii{len(end)}s")
                found = SensedWindow(layout, start, end, gather.surroundings)
        self.windows[wanted] = found
        return found

    def real(self, address: int) -> int:
        """Return the address to which an indirect data byte refers, and others unchanged."""
        for low, high, pointers in self._windows:
            if low <= address < high:
                at = pointers + 2 * (address - low)
                return int.from_bytes(self.bytes[at : at + 2], "little")
        return address

    def fields(self, address: int, data: bytes) -> Fields | int:
        """Split bytes to write into registers, or return the error number."""
        if address + len(data) > self._window_low and any(
            self.real(a) != a for a in range(address, address + len(data))
        ):
            return self._indirect_fields(address, data)
        key = (address, len(data))
        if key not in self._layouts:
            self._layouts[key] = self._lay_out(address, len(data))
        layout = self._layouts[key]
        if isinstance(layout, int):
            return layout
        out = []
        for register in layout:
            at = register.address - address
            raw = data[at : at + register.size]
            value = int.from_bytes(raw, "little", signed=register.signed)
            low, high = register.low, register.high
            if (low is not None and value < low) or (high is not None and value > high):
                return DATA_RANGE
            out.append((register, value))
        return tuple(out)

    def _lay_out(self, address: int, length: int) -> tuple[DynamixelRegister, ...] | int:
        end, found = address + length, []
        while address < end:
            register = self._by_address.get(address)
            if register is None or register.access == "r":
                return ACCESS
            found.append(register)
            address += register.size
        return tuple(found) if found and address == end else DATA_LENGTH

    def _indirect_fields(self, address: int, data: bytes) -> Fields | int:
        """Split a write through a window: runs of neighbouring targets are one write each."""
        runs: list[tuple[int, bytearray]] = []
        for offset, byte in enumerate(data):
            target = self.real(address + offset)
            if runs and target == runs[-1][0] + len(runs[-1][1]):
                runs[-1][1].append(byte)
            else:
                runs.append((target, bytearray([byte])))
        out: list[tuple[DynamixelRegister, int]] = []
        for target, run in runs:
            part = self.fields(target, bytes(run))
            if isinstance(part, int):
                return part
            out.extend(part)
        return tuple(out)


def _window_registers(blocks: tuple[IndirectBlock, ...]) -> Iterator[DynamixelRegister]:
    """Yield the registers of the indirect windows; each starts as its own data byte."""
    for block in blocks:
        for i in range(block.entries):
            at, data = block.address_base + 2 * i, block.data_base + i
            yield DynamixelRegister(
                f"indirect_address_{at}", at, 2, "rw", data, block.target_low, block.target_high
            )
            yield DynamixelRegister(f"indirect_data_{data}", data, 1, "rw", 0, 0, 255)


def in_eeprom(register: DynamixelRegister) -> bool:
    """Return whether a register keeps its value without power."""
    return register.address < EEPROM_END


class Backup:
    """A stored copy of a control table; it survives restarts and is empty at first."""

    def __init__(self) -> None:
        self._stored: dict[str, int] = {}

    @property
    def ready(self) -> bool:
        """Return whether a copy is stored."""
        return bool(self._stored)

    def store(self, memory: DynamixelMemory) -> None:
        """Copy the control table."""
        names = [register.name for register in memory.writable()]
        self._stored = {name: memory.get(name) for name in names if name not in NOT_STORED}

    def recall(self, memory: DynamixelMemory, eeprom: bool) -> None:
        """Restore one area, the EEPROM's or the RAM's."""
        for name, value in self._stored.items():
            if in_eeprom(memory.register_named(name)) == eeprom:
                memory.set(name, value)
