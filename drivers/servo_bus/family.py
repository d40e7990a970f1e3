"""The interface between the bus engine and a make of servo: all differences in one value.

The engine (gazerig.drivers.servo_bus) knows no make by name. A make is a protocol file (the
codec), a table file and one ``Family`` made of both; docs/servo-families.md explains it field by
field.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol

from gazerig.drivers.serial.port import BusPort

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.servo_bus.read_plan import ReadPlan
    from gazerig.drivers.types import ServoConfig


class Status(NamedTuple):
    """One answer of a servo as it arrived.

    intact: its check sum is right
    at: byte of what was received at which it begins
    """

    id: int
    error: int
    params: bytes
    intact: bool
    at: int = 0


class Register(Protocol):
    """One entry of a servo's table."""

    @property
    def name(self) -> str:
        """Name as the table has it."""

    @property
    def address(self) -> int:
        """First byte."""

    @property
    def size(self) -> int:
        """Number of bytes."""

    @property
    def area(self) -> str:
        """Memory it lives in: "eeprom" or "ram"."""

    def encode(self, value: int) -> bytes:
        """Return a value as it is written."""

    def decode(self, data: bytes) -> int:
        """Return the value that bytes stand for."""


class Model(Protocol):
    """One model of a family."""

    @property
    def name(self) -> str:
        """Name as in a rig file."""

    @property
    def number(self) -> int:
        """Number in the servo's own register."""

    @property
    def no_load_steps_s(self) -> float:
        """Speed of its shaft without load."""

    @property
    def load_unit(self) -> float:
        """Share of the stall torque that one unit of its present effort is."""

    @property
    def max_voltage(self) -> int:
        """Upper voltage limit from the factory, 0.1 V."""

    @property
    def rated_v(self) -> float:
        """Voltage that it is made for."""


class Identity(NamedTuple):
    """Model number and firmware version of a servo."""

    model_number: int
    firmware: int


class Codec(Protocol):
    """Packets as bytes; a module of functions."""

    @property
    def HEADER(self) -> bytes:
        """First bytes of every packet."""

    @property
    def STATUS_OVERHEAD(self) -> int:
        """Bytes of an answer without params."""

    @property
    def BROADCAST(self) -> int:
        """Id that stands for all servos."""

    @property
    def REFUSAL(self) -> int:
        """Bits of an answer's error byte that mean a rejected instruction."""

    @property
    def ALERT(self) -> int:
        """Bits of an answer's error byte that mean a fault of the servo."""

    @property
    def ECHO_LENGTH(self) -> int | None:
        """Params of a read whose echo looks like an answer, None where none does."""

    @property
    def CHECK(self) -> str:
        """Struct code of the check behind an answer's params."""

    def status_head(self, servo_id: int, length: int) -> bytes:
        """Return an answer's bytes before its error byte; ``length``: of its params."""

    @property
    def CHECKED(self) -> tuple[int, int]:
        """So many bytes at the beginning and at the end of an answer are not under its check."""

    def all_intact(self, parts: Sequence[bytes], checks: tuple[int, ...]) -> bool:
        """Return whether the checks of answers are right, from what is under each."""

    @property
    def IDENTITY_LENGTH(self) -> int:
        """Params of an answer about what a servo is."""

    def identify(self, servo_id: int) -> bytes:
        """Build a question about what a servo is."""

    def identity(self, status: Status) -> Identity | None:
        """Return model and firmware from an answer, None if it does not hold them."""

    def ping(self, servo_id: int) -> bytes:
        """Build a ping."""

    def reboot(self, servo_id: int) -> bytes:
        """Build an order to restart."""

    def read(self, servo_id: int, address: int, length: int) -> bytes:
        """Build a request for registers of one servo."""

    def write(self, servo_id: int, address: int, data: bytes) -> bytes:
        """Build an order to write registers of one servo."""

    def sync_read(self, ids: Sequence[int], address: int, length: int) -> bytes:
        """Build a request for the same registers of several servos."""

    def sync_write(
        self, ids: Sequence[int], address: int, size: int, rows: Iterable[bytes]
    ) -> bytes:
        """Build an order to write the same registers of several servos."""

    def statuses(self, raw: bytes) -> list[Status]:
        """Return every complete answer in received bytes; noise is passed over."""

    def bytes_missing(self, raw: bytes, count: int, length: int) -> int:
        """Return how many bytes are still to come of ``count`` answers."""


class GoalPackets(Protocol):
    """Packets of goals for a fixed set of servos."""

    def packet(self, goals: Sequence[int], speeds: Sequence[int]) -> bytes:
        """Build the packet for one goal and one speed a servo."""


class Arming(NamedTuple):
    """A register written before the torque comes on; ``speed``: it bounds the speed of goals."""

    register: str
    speed: bool


@dataclass(frozen=True)
class Family:
    """One make of servo.

    Codec and table:
        codec: packets as bytes
        registers, models: by name
        steps_per_turn: of the shaft
        name_errors: texts for the bits of ``error_register``
        velocity_unit_steps_s: of the present velocity
        sign_bits: fields of a ``Sample`` whose sign is a bit of its own, and that bit
        speed_units: from steps/s to the register of speed limits; at least 1
        acceleration_units: likewise from steps/s^2, None for no limit
        goals: packets of goals for some servos
        sync_read: one request asks several servos; else each is asked by itself
        baud_rates: bit/s by the value of the servo's register
        usual_rates: all of them, the usual ones first
        factory_baud: of a new servo
        highest_id: of a servo
        version: writes a firmware number as the maker does

    Reading:
        read_plan: windows and packets for some servos, a rig's choice (params) and the servos'
            firmware by id, None before it is known
        effort_register: the one that holds load or current
        armed: fields of a ``Sample`` that show whether a servo is still armed, and what
            they should be; None where anything will do
        weak_check: the check over an answer lets some damage pass

    Settings:
        spans: first and last of registers that are read together
        wanted: registers a servo must have; written in this order within a span
        target: what a register must be where it was found so and wanted so
        passes: a first correction may put other settings back, which takes a second
        answer_level: Status Return Level with which every order is answered
        lock: register that must be 0 while EEPROM is written, None where the torque is the lock

    Traits:
        error_register: holds a servo's faults
        faults_latch: a fault stays until the servo is restarted; else its bit comes and goes
        torque_faults: bits of faults that switch the torque off, where they come and go
        watchdog_unit_s: of Bus Watchdog; None where there is no watchdog
        goal_speed: a goal carries the speed that may be used for it
        single_turn: beyond its encoder's zero a servo would go the long way round
        broadcast_ping: a ping to all is answered one after the other; else each id is asked
        quiet_s, thorough_s: time-outs of a search: silence after a ping to all, or for each id
        duplicate_id_registers: first and last of registers in which two servos with the same
            id differ
        protocol_1: ids that answer to Protocol 1.0 only, where they may have been set to it
        arming: what is written before the torque comes on
        most_goals: so many servos' goals fit into one packet
        usual_bauds: bit/s to choose where an adaptor cannot run at another
        fault_cure, jump_cure: what helps where torque is refused, or a position jumps
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
    goals: Callable[[Sequence[int]], GoalPackets]
    sync_read: bool
    baud_rates: tuple[int, ...]
    usual_rates: tuple[int, ...]
    factory_baud: int
    highest_id: int
    version: Callable[[int], str]
    read_plan: "Callable[[Sequence[ServoConfig], Any, Mapping[int, int] | None], ReadPlan]"
    effort_register: str
    armed: Callable[["ServoConfig"], Mapping[str, int | None]]
    weak_check: bool
    spans: tuple[tuple[str, str], ...]
    wanted: Callable[["ServoConfig"], Mapping[str, int]]
    target: Callable[[str, int, int], int]
    passes: int
    answer_level: int
    lock: str | None
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
    protocol_1: Callable[[BusPort], tuple[int, ...]] | None
    arming: Arming
    most_goals: int
    usual_bauds: str
    fault_cure: str
    jump_cure: str

    def __deepcopy__(self, memo: object) -> "Family":
        """Return itself: it never changes, and its codec is a module."""
        return self

    def request(self, ids: Sequence[int], address: int, length: int) -> bytes:
        """Return a request for the same registers of servos; of one where each is asked alone."""
        if self.sync_read:
            return self.codec.sync_read(ids, address, length)
        (servo_id,) = ids
        return self.codec.read(servo_id, address, length)

    def asked_together(self, ids: Sequence[int]) -> Iterable[tuple[int, ...]]:
        """Return which of some servos go into one request."""
        if not self.sync_read:
            return [(servo_id,) for servo_id in ids]
        return [tuple(ids)] if ids else []

    def model_name(self, number: int) -> str:
        """Return the name of a model, "model number 350" where it is not known."""
        names = (model.name for model in self.models.values() if model.number == number)
        return next(names, f"model number {number}")
