"""A family of smart servos as data: registers, models, units, and the module of its packets.

The bus (gazerig.drivers.servo_bus) does not depend on any particular family; docs/servo-families.md
explains how to add one.
"""

import struct
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import TYPE_CHECKING, Literal, NamedTuple, Protocol

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoConfig


Area = Literal["eeprom", "ram"]


class Register(NamedTuple):
    """An entry of a servo's control table.

    initial: factory value in EEPROM, start value in RAM; None if the device itself decides
    low, high: range of valid values; None if the model or other registers decide
    signed: whether it is a two's complement
    sign: index of a separate sign bit before a magnitude; None without one
    order: byte order
    area: memory of the register; EEPROM keeps values without power
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
    area: Area = "ram"

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

    front: bytes before those of the first servo
    heads: bytes before each servo's registers, its error byte included
    check: struct code of the checksum after each servo's registers
    parts: struct codes of the parts that the checksums cover
    is_intact: returns whether the checksums match, from the covered parts and the checksums
    """

    front: bytes
    heads: Sequence[bytes]
    check: str
    parts: str
    is_intact: Callable[[tuple[bytes, ...], tuple[int, ...]], bool]


class GoalPackets(Protocol):
    """Builder of goal packets for a fixed set of servos."""

    def packet(self, goals: Sequence[int], speeds: Sequence[int]) -> bytes:
        """Build the packet with one goal and one speed per servo."""


@dataclass(frozen=True)
class Family:
    """A family of smart servos.

    Packets and table:
        codec: module of packets, with the functions of gazerig.drivers.dynamixel.protocol
        registers, models: registers and models by name
        steps_per_turn: steps per turn of the shaft
        name_errors: texts for the bits of ``error_register``
        velocity_unit_steps_s: unit of the present velocity
        speed_units: converts steps/s to the unit of speed limits; at least 1
        acceleration_units: converts steps/s^2 to the unit of acceleration limits; None for no limit
        create_goal_packets: builds goal packets for some servos
        sync_read: whether one request reads several servos; otherwise each is read alone
        baud_rates: bit/s, indexed by the value of the servo's register
        scan_rates: all baud rates, the usual ones first
        factory_baud: baud rate of a new servo
        highest_id: highest id of a servo
        format_firmware: formats a firmware number as the manufacturer does

    Reading:
        window: registers read from all servos in every cycle; up to 7 bytes before them can be read
        polled: first and last register of spans that are read from one servo after the other
        has_fast_read: returns whether a model with a firmware has a fast sync read
        prompt_timeout_s: shortest time-out of an answer in addition to its bytes on the wire
        effort_register: register of load or current

    Settings:
        read_spans: first and last register of ranges that are read together
        wanted_settings: required register values; written in this order within a span
        corrected_value: value to write to a register, given the found and the wanted value
        answer_level: Status Return Level at which every instruction is answered
        lock_register: register that must be 0 while EEPROM is written, None if torque is the lock

    Traits:
        error_register: register of a servo's faults
        faults_latch: whether a fault stays until the servo is restarted; otherwise its bit comes
            and goes
        watchdog_unit_s: unit of Bus Watchdog; None without a watchdog
        goal_speed: whether a goal includes its speed; otherwise ``arming_register`` limits it
        single_turn: whether a servo measures its position within one turn when it starts
        duplicate_id_registers: first and last of the registers in which two servos with the same id
            differ
        arming_register: limit of speed or acceleration that is written before torque is switched on
        most_goals: largest number of goals in one packet
        fault_cure, jump_cure: remedies if torque is refused, or a position jumps
    """

    name: str
    codec: ModuleType
    registers: Mapping[str, Register]
    models: Mapping[str, ServoModel]
    steps_per_turn: int
    name_errors: Callable[[int], tuple[str, ...]]
    velocity_unit_steps_s: float
    speed_units: Callable[[float], int]
    acceleration_units: Callable[[float | None], int]
    create_goal_packets: Callable[[Sequence[int]], GoalPackets]
    sync_read: bool
    baud_rates: tuple[int, ...]
    scan_rates: tuple[int, ...]
    factory_baud: int
    highest_id: int
    format_firmware: Callable[[int], str]
    window: Window
    polled: tuple[tuple[str, str], ...]
    has_fast_read: Callable[[str, int], bool]
    prompt_timeout_s: float
    effort_register: str
    read_spans: tuple[tuple[str, str], ...]
    wanted_settings: Callable[["ServoConfig"], Mapping[str, int]]
    corrected_value: Callable[[str, int, int], int]
    answer_level: int
    lock_register: str | None
    error_register: str
    faults_latch: bool
    watchdog_unit_s: float | None
    goal_speed: bool
    single_turn: bool
    duplicate_id_registers: tuple[str, str]
    arming_register: str
    most_goals: int
    fault_cure: str
    jump_cure: str

    def request(self, ids: Sequence[int], address: int, length: int) -> bytes:
        """Return a request for the same registers of some servos; of one if each is read alone."""
        ask, asked = (self.codec.sync_read, ids) if self.sync_read else (self.codec.read, ids[0])
        packet: bytes = ask(asked, address, length)
        return packet

    def model_name(self, number: int) -> str:
        """Return the name of a model, "model number 350" if it is unknown."""
        names = (model.name for model in self.models.values() if model.number == number)
        return next(names, f"model number {number}")
