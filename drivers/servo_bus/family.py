"""What the engine must know of a make of servo: everything that makes differ in, as one value.

The engine (gazerig.drivers.servo_bus) knows no make by name. A make is a protocol file (the
codec), a table file and one ``Family`` made of both; docs/servo-families.md explains it field by
field.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple, Protocol

from gazerig.drivers.serial.port import BusPort

if TYPE_CHECKING:  # the guardian starts without numpy
    from gazerig.drivers.types import ServoSetup


class Status(NamedTuple):
    """One answer of a servo as it arrived; ``intact``: its check sum is right."""

    id: int
    error: int
    params: bytes
    intact: bool


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
        """Number that the servo itself tells."""

    @property
    def no_load_steps_s(self) -> float:
        """Speed of its shaft without load."""


class Identity(NamedTuple):
    """What a servo says it is: the model number and the firmware version."""

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
    def REFUSAL(self) -> int:
        """Bits of an answer's error byte that say that nothing was done."""

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


class SingleRegisters(Protocol):
    """Single registers of single servos, each exchange confirmed.

    refusal: error number of the newest refused exchange, 0 where it was not refused
    """

    refusal: int

    def identify(self, servo_id: int) -> Identity | None:
        """Return what a servo is, None where it does not answer."""

    def write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a register; True if the servo confirmed it."""

    def write_bytes(self, servo_id: int, address: int, data: bytes) -> bool:
        """Write bytes; True if the servo confirmed it."""

    def write_all(self, ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to a register of several servos at once, unconfirmed."""


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
        speed_units: from steps/s to the register of speed limits; at least 1
        acceleration_units: likewise from steps/s^2, None for no limit
        goals: packets of goals for some servos
        single: single registers on a port, each exchange tried so often
        ping_all: who is there at a baud rate, as (model number, firmware) by id

    Settings:
        spans: first and last of registers that are read together
        wanted: registers a servo must have; written in this order within a span
        target: what a register must be where it was found so and wanted so
        passes: a first correction may put other settings back, which takes a second
        answer_level: Status Return Level with which every order is answered
        lock: register that must be 0 while EEPROM is written, None where the torque is the lock

    Traits:
        error_register: tells what ails a servo
        faults_latch: a fault stays until the servo is restarted; else its bit comes and goes
        watchdog_unit_s: of Bus Watchdog; None where there is no watchdog
        goal_speed: a goal carries the speed that may be used for it
        single_turn: beyond its encoder's zero a servo would go the long way round
        broadcast_ping: a ping to all is answered one after the other
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
    speed_units: Callable[[float], int]
    acceleration_units: Callable[[float | None], int]
    goals: Callable[[Sequence[int]], GoalPackets]
    single: Callable[[BusPort, int], SingleRegisters]
    ping_all: Callable[[BusPort, int], Mapping[int, tuple[int, int]]]
    spans: tuple[tuple[str, str], ...]
    wanted: Callable[["ServoSetup"], Mapping[str, int]]
    target: Callable[[str, int, int], int]
    passes: int
    answer_level: int
    lock: str | None
    error_register: str
    faults_latch: bool
    watchdog_unit_s: float | None
    goal_speed: bool
    single_turn: bool
    broadcast_ping: bool
    arming: Arming
    most_goals: int
    usual_bauds: str
    fault_cure: str
    jump_cure: str

    def __deepcopy__(self, memo: object) -> "Family":
        """Return itself: it never changes, and its codec is a module."""
        return self

    def model_name(self, number: int) -> str:
        """Return the name of a model, "model number 350" where it is not known."""
        names = (model.name for model in self.models.values() if model.number == number)
        return next(names, f"model number {number}")
