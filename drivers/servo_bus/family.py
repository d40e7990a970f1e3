"""A family of smart servos as data: registers, models, units, and the module of its packets.

The bus (gazerig.drivers.servo_bus) does not depend on any particular family; docs/extend.md
explains how to add one.
"""

import struct
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import TYPE_CHECKING, Literal, NamedTuple

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig


BROADCAST = 0xFE
PING, READ, WRITE, SYNC_READ, SYNC_WRITE, FAST_SYNC_READ = 0x01, 0x02, 0x03, 0x82, 0x83, 0x8A
"""Id of all servos, and instructions; the protocols of all families have the same ones."""

FASTEST = 32767
"""Largest value of a speed limit."""


class Register(NamedTuple):
    """An entry of a servo's control table.

    initial: factory value in EEPROM, start value in RAM; None if the device itself decides
    low, high: range of valid values; None if the model or other registers decide
    signed: whether it is a two's complement
    sign: index of a separate sign bit before a magnitude; None without one
    order: byte order
    """

    name: str
    address: int
    size: int = 1
    access: Literal["r", "rw"] = "r"
    initial: int | None = None
    low: int | None = None
    high: int | None = None
    signed: bool = False
    sign: int | None = None
    order: Literal["little", "big"] = "little"

    def encode(self, value: int) -> bytes:
        """Return a value as bytes.

        Raises:
            ValueError: it does not fit.
        """
        bits = self.sign if self.sign is not None else 8 * self.size - self.signed
        low = -(1 << bits) if self.signed else 0 if self.sign is None else 1 - (1 << bits)
        if not low <= value < 1 << bits:
            raise ValueError(f"{self.name}: {value} does not fit into {self.size} byte")
        raw = -value | 1 << bits if self.sign is not None and value < 0 else value
        return raw.to_bytes(self.size, self.order, signed=self.signed)

    def decode(self, data: bytes) -> int:
        """Return the value of bytes."""
        raw = int.from_bytes(data, self.order, signed=self.signed)
        return raw if self.sign is None else from_sign_magnitude(raw, self.sign)


def from_sign_magnitude(raw: int, sign: int) -> int:
    """Return the signed value of a magnitude whose sign is in bit ``sign``."""
    magnitude = raw & (1 << sign) - 1
    return -magnitude if raw >> sign & 1 else magnitude


@dataclass(frozen=True)
class ServoModel:
    """A servo model of a family.

    number: value of its model register
    temperature_limit, min_voltage, max_voltage: factory settings, degC and 0.1 V
    stall_torque_nm, stall_current_a, no_load_rpm: values at rated_v
    """

    name: str
    number: int
    steps_per_turn: int
    temperature_limit: int
    min_voltage: int
    max_voltage: int
    stall_torque_nm: float
    rated_v: float
    stall_current_a: float
    no_load_rpm: float

    @property
    def no_load_steps_s(self) -> float:
        """Return the no-load speed at the rated voltage."""
        return self.no_load_rpm / 60.0 * self.steps_per_turn

    @property
    def load_unit(self) -> float:
        """Return the share of the stall torque per unit of its present effort."""
        return 0.001


class Status(NamedTuple):
    """One answer of a servo as it arrived; ``intact``: whether its checksum is correct."""

    id: int
    error: int
    params: bytes
    intact: bool


class Identity(NamedTuple):
    """Model number and firmware version of a servo."""

    model_number: int
    firmware: int


class Window(NamedTuple):
    """Bytes read from every servo: their address and meaning.

    layout: struct codes of all bytes, with the byte order
    fields: names of the numbers, in their order: position, velocity and effort, and in some
        families voltage, temperature and status
    signs: separate sign bits of position, velocity and effort; empty for two's complements
    """

    address: int
    layout: str
    fields: tuple[str, ...]
    signs: tuple[int, ...] = ()

    @property
    def length(self) -> int:
        """Return the number of bytes."""
        return struct.calcsize(self.layout)


class AnswerFrame(NamedTuple):
    """The bytes around the registers in an answer of several servos without errors.

    heads: bytes before each servo's registers, its error byte included
    check: struct code of the checksum after each servo's registers
    parts: struct codes of the parts that the checksums cover
    is_intact: returns whether the checksums match, from the covered parts and the checksums
    """

    heads: Sequence[bytes]
    check: str
    parts: str
    is_intact: Callable[[tuple[bytes, ...], tuple[int, ...]], bool]


@dataclass(frozen=True)
class Family:
    """A family of smart servos; docs/extend.md explains how to add one.

    A span is the first and the last of registers that are read together.
    """

    name: str
    codec: ModuleType
    """Module of its packets, with the names of gazerig.drivers.feetech.protocol."""
    registers: Mapping[str, Register]
    models: Mapping[str, ServoModel]
    steps_per_turn: int
    errors: Mapping[int, str]
    """Texts for the bits of ``error_register``."""
    error_register: str
    effort_register: str
    """Register of load or current."""
    velocity_unit_steps_s: float
    acceleration_units: Callable[[float | None], int]
    """Converts steps/s^2 to the unit of acceleration limits; None for no limit."""
    goal_layout: str
    """Struct codes of a servo's id, goal and further numbers in a packet of goals."""
    goal_speed: bool
    """Whether the last of them is a speed; otherwise ``arming_register`` limits it."""
    arming_register: str
    """Limit of speed or acceleration that is written before torque is switched on."""
    most_goals: int
    """Largest number of goals in one packet."""
    sync_read: bool
    """Whether one request reads several servos; otherwise each is read alone."""
    fast_read_since: Mapping[str, int]
    """First firmware of a model that answers a sync read in one packet."""
    baud_rates: tuple[int, ...]
    """Bit/s, indexed by the value of the servo's register."""
    factory_baud: int
    highest_id: int
    format_firmware: Callable[[int], str]
    """Formats a firmware number as the manufacturer does."""
    updater: str
    """The manufacturer's program that updates the firmware."""
    window: Window
    """Registers read from all servos in every cycle; up to 7 bytes before them can be read."""
    polled: tuple[tuple[str, str], ...]
    """Spans that are read from one servo after the other."""
    read_spans: tuple[tuple[str, str], ...]
    """Spans of settings."""
    wanted_settings: Callable[["ServoConfig"], Mapping[str, int]]
    """Required register values; written in this order within a span."""
    corrected_value: Callable[[str, int, int], int]
    """Value to write to a register, given the found and the wanted value."""
    answer_level: int
    """Status Return Level at which every instruction is answered."""
    lock_register: str | None
    """Register that must be 0 while EEPROM is written, None if torque is the lock."""
    faults_latch: bool
    """Whether a fault stays until the servo is restarted; otherwise its bit comes and goes."""
    watchdog_unit_s: float | None
    single_turn: bool
    """Whether a servo measures its position within one turn when it starts."""
    prompt_timeout_s: float = 0.002
    """Shortest time-out of an answer in addition to its bytes on the wire."""

    def request(
        self, ids: Sequence[int], address: int, length: int, is_fast: bool = False
    ) -> bytes:
        """Build a request for the same registers of some servos; of one if each is read alone."""
        if not self.sync_read:
            return self.read(ids[0], address, length)
        params = self._span(address, length) + bytes(ids)
        return self._instruction(BROADCAST, FAST_SYNC_READ if is_fast else SYNC_READ, params)

    def read(self, servo_id: int, address: int, length: int) -> bytes:
        """Build a request for registers of one servo."""
        return self._instruction(servo_id, READ, self._span(address, length))

    def write(self, servo_id: int, name: str, value: int) -> bytes:
        """Build a write to a register of one servo, which confirms it."""
        register = self.registers[name]
        address: bytes = self.codec.number(register.address)
        return self._instruction(servo_id, WRITE, address + register.encode(value))

    def sync_write(self, ids: Sequence[int], name: str, values: Iterable[int]) -> bytes:
        """Build a write to the same register of several servos, which no servo confirms."""
        register = self.registers[name]
        rows = [bytes((i,)) + register.encode(v) for i, v in zip(ids, values, strict=True)]
        params = self._span(register.address, register.size) + b"".join(rows)
        return self._instruction(BROADCAST, SYNC_WRITE, params)

    def _instruction(self, servo_id: int, code: int, params: bytes) -> bytes:
        packet: bytes = self.codec.instruction(servo_id, code, params)
        return packet

    def _span(self, address: int, length: int) -> bytes:
        found: bytes = self.codec.number(address) + self.codec.number(length)
        return found

    def span(self, first: str, last: str) -> tuple[int, int]:
        """Return the address and the number of bytes of a span."""
        begin, end = self.registers[first], self.registers[last]
        return begin.address, end.address + end.size - begin.address

    def decode(self, address: int, data: bytes) -> dict[str, int]:
        """Return the values by name of the registers in bytes that begin at an address."""
        return {
            one.name: one.decode(data[one.address - address :][: one.size])
            for one in self.registers.values()
            if address <= one.address and one.address + one.size <= address + len(data)
        }

    def speed_units(self, speed_steps_s: float) -> int:
        """Return a speed in the unit of speed limits, at least 1, as 0 means no limit."""
        return max(1, min(FASTEST, int(speed_steps_s / self.velocity_unit_steps_s)))

    def name_errors(self, status: int) -> tuple[str, ...]:
        """Return the names of the set bits of ``error_register``."""
        bits = [1 << bit for bit in range(8) if status >> bit & 1]
        return tuple(self.errors.get(bit, f"error bit {bit:#04x}") for bit in bits)

    def model_name(self, number: int) -> str:
        """Return the name of a model, "model number 350" if it is unknown."""
        names = (model.name for model in self.models.values() if model.number == number)
        return next(names, f"model number {number}")


class GoalWrite:
    """Builder of packets that write the goals of a fixed set of servos."""

    def __init__(self, family: Family, ids: Sequence[int]) -> None:
        order, codes = family.goal_layout[0], family.goal_layout[1:]
        self._rows = struct.Struct(order + codes * len(ids))
        self._count, self._has_speed = len(codes), family.goal_speed
        self._row = [n for servo_id in ids for n in (servo_id, *[0] * (self._count - 1))]
        codec, address = family.codec, family.registers["goal_position"].address
        length = struct.calcsize(order + codes) - 1
        self._span = codec.number(address) + codec.number(length)
        self._instruction = partial(codec.instruction, BROADCAST, SYNC_WRITE)

    def packet(self, goals: Sequence[int], speeds: Sequence[int]) -> bytes:
        """Build the packet with one goal per servo, and one speed if the family sends it."""
        row = self._row
        row[1 :: self._count] = goals
        if self._has_speed:
            row[self._count - 1 :: self._count] = speeds
        packet: bytes = self._instruction(self._span + self._rows.pack(*row))
        return packet
