"""What bring-up asks of a kind of smart servo: finding, naming, examining and restarting one.

One value a kind stands in robot.bringup.servo_families; a Maestro, which has channels instead of
servos that answer, is looked at in robot.bringup.doctor.maestro.
"""

from collections.abc import Callable
from typing import NamedTuple, Protocol

from drivers.serial.port import BusPort
from drivers.servo_models import BusKind
from drivers.types import ServoSetup
from robot.bringup.doctor.findings import Finding, Fix

Tell = Callable[[str], None]
"""Is told in a few words what is being done now."""


class Found(Protocol):
    """One servo that answered."""

    @property
    def id(self) -> int:
        """Give its id."""
        ...

    @property
    def number(self) -> int:
        """Give its model number."""
        ...

    @property
    def firmware(self) -> int:
        """Give its firmware as its kind counts it."""
        ...

    @property
    def baud(self) -> int:
        """Give the rate at which it answered."""
        ...

    @property
    def model(self) -> str:
        """Name its model."""
        ...


class SetUp(NamedTuple):
    """What has become of one servo: as it was found, as it is now, and what was written."""

    before: Found
    now: Found
    done: tuple[str, ...]


class Standing(NamedTuple):
    """How a servo stands.

    errors: by name; torque: None where it could not be read
    position: in steps, None likewise
    latching: errors stay until a restart; else they go with their cause
    """

    errors: tuple[str, ...]
    torque: bool | None
    position: int | None
    voltage_v: float | None
    latching: bool = True

    def __str__(self) -> str:
        """Say it in a line."""
        word, none = ("latched", "nothing latched") if self.latching else ("reports", "no errors")
        errors = f"{word}: {' and '.join(self.errors)}" if self.errors else none
        torque = {None: "torque unknown", False: "torque off", True: "torque on"}[self.torque]
        volts = "" if self.voltage_v is None else f", {self.voltage_v:.1f} V"
        return f"{errors}, {torque}, at step {self.position}{volts}"


class ServoKind(NamedTuple):
    """One kind of smart servo; ports are open at the baud rate that is given or was found.

    title: as people call it
    rates: every baud rate, the usual ones first; factory_baud: of a new servo, whose id is 1
    nobody: what to look at where no servo answers
    notes: what must be known of all of them
    version: writes a firmware number as the maker does
    number: gives the model number of a model by its name
    everybody: asks all ids; gives who answered, and the number of bytes that made no sense
    anybody: tells quickly whether anyone at all answers; True where only ``everybody`` knows
    ping: asks one id at the baud rate given; garbled: how many of some answers came in pieces
    assign: gives a servo id and baud rate of a joint
    examine: judges one servo; the last number is what ``garbled`` has counted
    mend: writes one fix, the torque being off; gives "" or why it was not done
    standing: reads how a servo stands; reboot: tells it to restart
    """

    name: BusKind
    title: str
    rates: tuple[int, ...]
    factory_baud: int
    nobody: str
    notes: tuple[str, ...]
    version: Callable[[int], str]
    number: Callable[[str], int]
    everybody: Callable[[BusPort, int], tuple[tuple[Found, ...], int]]
    anybody: Callable[[BusPort], bool]
    ping: Callable[[BusPort, int, int, int], Found | None]
    garbled: Callable[[BusPort, int, int], int]
    assign: Callable[[BusPort, Found, ServoSetup, int, Tell], SetUp]
    examine: Callable[[BusPort, ServoSetup, Found, int], list[Finding]]
    mend: Callable[[BusPort, Fix], str]
    standing: Callable[[BusPort, int], Standing]
    reboot: Callable[[BusPort, int], None]
