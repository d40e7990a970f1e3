"""What bring-up must know of a kind of smart servo: one value a kind.

The values stand in gazerig.robot.bringup.servo_families; everything else in bring-up is written
once. A board of hobby servos, whose channels do not answer, is no such kind.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Family, Identity
from gazerig.drivers.servo_models import BusKind

Tell = Callable[[str], None]
"""Is told in a few words what is being done now."""

TRIES = 3


class Found(Protocol):
    """One servo that answered."""

    @property
    def id(self) -> int:
        """Return its id."""
        ...

    @property
    def number(self) -> int:
        """Return its model number."""
        ...

    @property
    def firmware(self) -> int:
        """Return its firmware as its kind counts it."""
        ...

    @property
    def baud(self) -> int:
        """Return the rate at which it answered."""
        ...

    @property
    def model(self) -> str:
        """Return the name of its model."""
        ...


class ServoModel(Protocol):
    """What kinds of servos tell of each of their models."""

    @property
    def name(self) -> str:
        """Return its name in a rig's YAML."""
        ...

    @property
    def number(self) -> int:
        """Return the number by which it names itself."""
        ...

    @property
    def max_voltage(self) -> int:
        """Return its upper voltage limit from the factory, 0.1 V."""
        ...

    @property
    def rated_v(self) -> float:
        """Return the voltage that it is made for."""
        ...


class Registers(Protocol):
    """Single registers of single servos by name."""

    @property
    def refusal(self) -> int:
        """Return the error number of the newest exchange that was refused, 0 for none."""
        ...

    def identify(self, servo_id: int) -> Identity | None:
        """Return what a servo calls itself, None where nobody answers."""
        ...

    def read(self, servo_id: int, name: str) -> int | None:
        """Return a value, None where no good answer came."""
        ...

    def read_bytes(self, servo_id: int, address: int, length: int) -> bytes | None:
        """Return bytes of the table, None where no good answer came."""
        ...

    def write(self, servo_id: int, name: str, value: int) -> bool:
        """Write a value; returns whether the servo confirmed it."""
        ...

    def write_all(self, ids: Sequence[int], name: str, value: int) -> None:
        """Write one value to several servos at once, unconfirmed."""
        ...

    def settle(self, servo_id: int, name: str, value: int) -> bool:
        """Write a value only where it differs; returns whether it has it now."""
        ...


class Scanned(NamedTuple):
    """What asking all ids at one baud rate has brought.

    possible: the adaptor can run at it; junk: bytes that made no sense
    shared: ids that two servos seem to have; protocol_1: ids that answer to the old protocol
    """

    possible: bool
    found: tuple[Found, ...]
    junk: int
    shared: tuple[int, ...]
    protocol_1: tuple[int, ...] = ()


class Setting(NamedTuple):
    """A register that must have a value where it is calibrated; ``mask`` chooses its bits."""

    register: str
    value: int
    mask: int = ~0

    def of(self, now: int) -> int:
        """Return what the register should be, being this now."""
        return now & ~self.mask | self.value & self.mask


class Driving(NamedTuple):
    """How one servo of a kind is led gently by itself.

    settings: without which its steps do not mean what they should
    offset: register that shifts its position; offset_usable: it keeps to that
    full_drive: register and the one that holds its largest value, to which it is put back
    gentle: makes the registers of a share of full drive and a speed in steps/s; reads registers
        by name
    load: present current as a share of the stall current, of a model by its name
    """

    settings: tuple[Setting, ...]
    offset: str
    offset_usable: bool
    full_drive: tuple[str, str] | None
    gentle: Callable[[Callable[[str], int], float, float], dict[str, int]]
    load: Callable[[str, int], float]


class ServoKind(NamedTuple):
    """One kind of smart servo; ports are open at the baud rate that is given or was found.

    title: as people call it
    family: what the engine must know of it
    models: by name, with what a doctor must know of them
    rates: every baud rate, the usual ones first; factory_baud: of a new servo, whose id is 1
    baud_rates: by the value of the servo's register
    no_reply: what to look at where no servo answers
    notes: what must be known of all of them
    version: writes a firmware number as the maker does
    registers: makes access to single registers, of a port and a number of tries
    scan_ids: asks all ids; returns who answered, and the number of bytes that made no sense
    scan: the same of a port that may be closed, at a baud rate; thorough: with long patience
    any_reply: whether any servo answers, quickly; True where only ``scan_ids`` can tell
    ping: asks one id at the baud rate given; corrupt: how many of some answers came in pieces
    reboot: tells a servo to restart
    set_middle: makes the present position the middle, None where a kind cannot
    """

    name: BusKind
    title: str
    family: Family
    models: Mapping[str, ServoModel]
    rates: tuple[int, ...]
    baud_rates: tuple[int, ...]
    factory_baud: int
    highest_id: int
    no_reply: str
    notes: tuple[str, ...]
    driving: Driving
    version: Callable[[int], str]
    registers: Callable[[BusPort, int], Registers]
    scan_ids: Callable[[BusPort, int], tuple[tuple[Found, ...], int]]
    scan: Callable[[BusPort, int, bool], Scanned]
    any_reply: Callable[[BusPort], bool]
    ping: Callable[[BusPort, int, int, int], Found | None]
    corrupt: Callable[[BusPort, int, int], int]
    reboot: Callable[[BusPort, int], None]
    set_middle: Callable[[BusPort, int], int] | None = None

    def write_lasting(self, registers: Registers, servo_id: int, name: str, value: int) -> bool:
        """Write a register so that it outlives the power, where it is one that can.

        Where there is a lock it is open for this alone. Returns whether the servo has the value.
        """
        lock = self.family.lock
        if lock is None or self.family.registers[name].area != "eeprom":
            return registers.settle(servo_id, name, value)
        if not registers.write(servo_id, lock, 0):
            return False
        written = registers.write(servo_id, name, value)
        closed = registers.write(servo_id, lock, 1)
        return closed and written and registers.read(servo_id, name) == value
