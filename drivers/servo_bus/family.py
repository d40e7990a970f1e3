"""Interface between the bus engine and a servo family: all differences in one value.

The engine (gazerig.drivers.servo_bus) does not depend on any particular family. A family consists
of a protocol file (the codec), a table file and one ``Family`` built from both;
docs/servo-families.md explains it field by field.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.servo_bus.read_plan import ReadPlan
    from gazerig.drivers.types import ServoConfig


class Status(NamedTuple):
    """One status packet of a servo as it arrived.

    intact: whether its checksum is correct
    offset: index of its first byte in the received bytes
    """

    id: int
    error: int
    params: bytes
    intact: bool
    offset: int = 0


class Register(Protocol):
    """An entry of a servo's control table."""

    @property
    def name(self) -> str:
        """Name in the table."""

    @property
    def address(self) -> int:
        """Address of the first byte."""

    @property
    def size(self) -> int:
        """Number of bytes."""

    @property
    def area(self) -> str:
        """Its memory: "eeprom" or "ram"."""

    def encode(self, value: int) -> bytes:
        """Return a value as bytes."""

    def decode(self, data: bytes) -> int:
        """Return the value of bytes."""


class Model(Protocol):
    """A servo model of a family."""

    @property
    def name(self) -> str:
        """Name in a rig file."""

    @property
    def number(self) -> int:
        """Number in the servo's model register."""

    @property
    def no_load_steps_s(self) -> float:
        """No-load speed of its shaft."""

    @property
    def load_unit(self) -> float:
        """Share of the stall torque per unit of its present effort."""

    @property
    def max_voltage(self) -> int:
        """Factory setting of the upper voltage limit, 0.1 V."""

    @property
    def rated_v(self) -> float:
        """Rated voltage."""


class Identity(NamedTuple):
    """Model number and firmware version of a servo."""

    model_number: int
    firmware: int


class Codec(Protocol):
    """Encoder and decoder of packets; a module of functions."""

    @property
    def STATUS_OVERHEAD(self) -> int:
        """Bytes of an answer in addition to its params."""

    @property
    def BROADCAST(self) -> int:
        """Id that addresses all servos."""

    @property
    def REFUSAL(self) -> int:
        """Bits of an answer's error byte that report a rejected instruction."""

    @property
    def ALERT(self) -> int:
        """Bits of an answer's error byte that report a fault of the servo."""

    @property
    def ECHO_LENGTH(self) -> int | None:
        """Number of params of a read whose echo looks like an answer, None if none does."""

    @property
    def CHECK(self) -> str:
        """Struct code of the checksum after an answer's params."""

    def status_head(self, servo_id: int, length: int) -> bytes:
        """Return an answer's bytes before its error byte; ``length``: number of params."""

    @property
    def CHECKED(self) -> tuple[int, int]:
        """Bytes at the beginning and at the end of an answer that its checksum does not cover."""

    def all_intact(self, parts: Sequence[bytes], checks: tuple[int, ...]) -> bool:
        """Return whether the checksums of answers match the parts that they cover."""

    @property
    def IDENTITY_LENGTH(self) -> int:
        """Number of params of an identity answer."""

    def identity_request(self, servo_id: int) -> bytes:
        """Build a request for a servo's identity."""

    def parse_identity(self, status: Status) -> Identity | None:
        """Return model and firmware from an answer, None if it does not contain them."""

    def ping(self, servo_id: int) -> bytes:
        """Build a ping."""

    def read(self, servo_id: int, address: int, length: int) -> bytes:
        """Build a request for registers of one servo."""

    def write(self, servo_id: int, address: int, data: bytes) -> bytes:
        """Build an instruction to write registers of one servo."""

    def sync_read(self, ids: Sequence[int], address: int, length: int) -> bytes:
        """Build a request for the same registers of several servos."""

    def sync_write(
        self, ids: Sequence[int], address: int, size: int, rows: Iterable[bytes]
    ) -> bytes:
        """Build an instruction to write the same registers of several servos."""

    def parse_statuses(self, raw: bytes) -> list[Status]:
        """Return every complete answer in received bytes; noise is skipped."""

    def bytes_missing(self, raw: bytes, count: int, length: int) -> int:
        """Return how many bytes of ``count`` answers have not arrived yet."""


class GoalPackets(Protocol):
    """Builder of goal packets for a fixed set of servos."""

    def packet(self, goals: Sequence[int], speeds: Sequence[int]) -> bytes:
        """Build the packet with one goal and one speed per servo."""


class Arming(NamedTuple):
    """A register written before torque is switched on; ``speed``: whether it limits goal speeds."""

    register: str
    limits_speed: bool


@dataclass(frozen=True)
class Family:
    """A family of smart servos.

    Codec and table:
        codec: encoder and decoder of packets
        registers, models: registers and models by name
        steps_per_turn: steps per turn of the shaft
        name_errors: texts for the bits of ``error_register``
        velocity_unit_steps_s: unit of the present velocity
        sign_bits: fields of a ``Sample`` with a separate sign bit, and that bit
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
        read_plan: returns windows and packets for some servos and the firmware by id, None before
            it is known
        prompt_timeout_s: shortest time-out of an answer; from it to the longest it adapts to twice
            the worst delay measured
        effort_register: register of load or current
        armed_values: fields of a ``Sample`` that show whether a servo is still armed, and their
            expected values; None accepts any value
        weak_check: whether the checksum of an answer misses some damage

    Settings:
        read_spans: first and last register of ranges that are read together
        wanted_settings: required register values; written in this order within a span
        corrected_value: value to write to a register, given the found and the wanted value
        correction_passes: number of correction passes; a first correction may reset other settings
        answer_level: Status Return Level at which every instruction is answered
        lock_register: register that must be 0 while EEPROM is written, None if torque is the lock

    Traits:
        error_register: register of a servo's faults
        faults_latch: whether a fault stays until the servo is restarted; otherwise its bit comes
            and goes
        torque_faults: bits of transient faults that switch torque off
        watchdog_unit_s: unit of Bus Watchdog; None without a watchdog
        goal_speed: whether a goal includes its speed
        single_turn: whether a servo beyond its encoder's zero would move in the wrong direction
        broadcast_ping: whether servos answer a broadcast ping one after another; otherwise each id
            is read
        quiet_s, thorough_s: time-outs of a search: silence after a broadcast ping, or for each id
        duplicate_id_registers: first and last of the registers in which two servos with the same id
            differ
        arming: register written before torque is switched on
        most_goals: largest number of goals in one packet
        recommended_bauds: bit/s to recommend if an adaptor does not support another rate
        fault_cure, jump_cure: remedies if torque is refused, or a position jumps
    """

    name: str
    codec: Codec
    registers: Mapping[str, Register]
    models: Mapping[str, Model]
    steps_per_turn: int
    name_errors: Callable[[int], tuple[str, ...]]
    velocity_unit_steps_s: float
    sign_bits: Mapping[str, int]
    speed_units: Callable[[float], int]
    acceleration_units: Callable[[float | None], int]
    create_goal_packets: Callable[[Sequence[int]], GoalPackets]
    sync_read: bool
    baud_rates: tuple[int, ...]
    scan_rates: tuple[int, ...]
    factory_baud: int
    highest_id: int
    format_firmware: Callable[[int], str]
    read_plan: "Callable[[Sequence[ServoConfig], Mapping[int, int] | None], ReadPlan]"
    prompt_timeout_s: float
    effort_register: str
    armed_values: Callable[["ServoConfig"], Mapping[str, int | None]]
    weak_check: bool
    read_spans: tuple[tuple[str, str], ...]
    wanted_settings: Callable[["ServoConfig"], Mapping[str, int]]
    corrected_value: Callable[[str, int, int], int]
    correction_passes: int
    answer_level: int
    lock_register: str | None
    error_register: str
    faults_latch: bool
    torque_faults: int
    watchdog_unit_s: float | None
    goal_speed: bool
    single_turn: bool
    broadcast_ping: bool
    quiet_s: float
    thorough_s: float
    duplicate_id_registers: tuple[str, str]
    arming: Arming
    most_goals: int
    recommended_bauds: str
    fault_cure: str
    jump_cure: str

    def __deepcopy__(self, memo: object) -> "Family":
        """Return itself: it is immutable, and its codec is a module."""
        return self

    def request(self, ids: Sequence[int], address: int, length: int) -> bytes:
        """Return a request for the same registers of some servos; of one if each is read alone."""
        if self.sync_read:
            return self.codec.sync_read(ids, address, length)
        (servo_id,) = ids
        return self.codec.read(servo_id, address, length)

    def request_groups(self, ids: Sequence[int]) -> Iterable[tuple[int, ...]]:
        """Return the groups of servos that are read with one request."""
        if not self.sync_read:
            return [(servo_id,) for servo_id in ids]
        return [tuple(ids)] if ids else []

    def model_name(self, number: int) -> str:
        """Return the name of a model, "model number 350" if it is unknown."""
        names = (model.name for model in self.models.values() if model.number == number)
        return next(names, f"model number {number}")
