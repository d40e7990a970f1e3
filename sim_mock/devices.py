"""Emulated devices: descriptions that can be sent to another process, and their construction."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NamedTuple

from gazerig.drivers.bus.servo_models import BusKind
from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import BUS, BusPlugin, EmulatedJoint, find, load
from gazerig.sim_mock.device import Device
from gazerig.sim_mock.hobby_servo import HobbyMaker, HobbyServo, HobbySpec
from gazerig.sim_mock.smart_servo.physics import ServoSpec
from gazerig.sim_mock.smart_servo.shaft import ShaftMaker, create_shaft


@dataclass(frozen=True, slots=True)
class _SmartServoLine:
    """Smart servos on one line.

    Attributes:
        servos: specifications of the servos.
        baud: the servos' rate; clients at another rate get no answer; None: any rate works.
    """

    servos: tuple[ServoSpec, ...]
    baud: int | None = None


class DynamixelLine(_SmartServoLine):
    """Dynamixel servos on one line."""

    __slots__ = ()
    kind: ClassVar[BusKind] = "dynamixel"


class FeetechLine(_SmartServoLine):
    """Feetech servos on one line."""

    __slots__ = ()
    kind: ClassVar[BusKind] = "feetech"


@dataclass(frozen=True, slots=True)
class MaestroLine:
    """A Pololu Maestro and its servos.

    channels: 6, 12, 18 or 24
    crc: whether it expects a CRC after every command
    servos: servos that differ from the default, by their channel
    """

    channels: int = 12
    crc: bool = False
    servos: tuple[HobbySpec, ...] = ()
    baud: ClassVar[int | None] = None
    kind: ClassVar[BusKind] = "maestro"


@dataclass(frozen=True, slots=True)
class Pca9685Line:
    """PCA9685 boards on an I2C bus behind a bridge, and their servos.

    addresses: addresses of the boards; the channels of the second begin at 16
    oscillator_hz: frequencies of their clocks
    servos: servos that differ from the default, by their channel
    """

    addresses: tuple[int, ...] = (0x40,)
    oscillator_hz: float = 25e6
    servos: tuple[HobbySpec, ...] = ()
    baud: ClassVar[int | None] = None
    kind: ClassVar[BusKind] = "pca9685"


@dataclass(frozen=True, slots=True)
class PluginLine:
    """The servos of a package's bus.

    kind: kind of the bus
    settings: its parameters
    servos: servos in the order of the joints
    """

    kind: BusKind
    settings: object
    servos: tuple[EmulatedJoint, ...]
    baud: int | None = None


Emulated = DynamixelLine | FeetechLine | MaestroLine | Pca9685Line | PluginLine


class ShaftMakers(NamedTuple):
    """Factories of the shafts of smart servos and hobby servos."""

    make_shaft: ShaftMaker = create_shaft
    make_servo: HobbyMaker = HobbyServo


OWN_SHAFTS = ShaftMakers()
"""Independent shafts, without a world around them."""


def build(
    what: Emulated,
    now_s: Callable[[], float],
    seed: int = 0,
    shafts: ShaftMakers = OWN_SHAFTS,
) -> Device:
    """Build a device.

    Args:
        what: the device to build.
        now_s: its clock.
        seed: seed of the random numbers of its faults.
        shafts: factories of its servos' shafts; a package's device has its own.

    Raises:
        ValueError: it cannot exist; the message names the wrong value and valid ones.
    """
    if isinstance(what, PluginLine):
        make = load(BUS, what.kind, BusPlugin).device
        assert make is not None  # ``plugin_line`` has checked it
        device: Device = make(what.settings, what.servos, now_s, seed)
        return device
    # A chain or board is imported when it is built: a process that starts a server needs none.
    if isinstance(what, MaestroLine):
        from gazerig.sim_mock.maestro.board import build_board

        return build_board(what.channels, now_s, what.crc, seed, what.servos, shafts.make_servo)
    if isinstance(what, Pca9685Line):
        from gazerig.sim_mock.pca9685.bridge import build_bridge

        return build_bridge(
            what.addresses, now_s, what.oscillator_hz, seed, what.servos, shafts.make_servo
        )
    options: dict[str, Any] = {"seed": seed, "make_shaft": shafts.make_shaft}
    if isinstance(what, FeetechLine):
        from gazerig.sim_mock.feetech.chain import build_feetech

        return build_feetech(what.servos, now_s, what.baud, **options)
    from gazerig.sim_mock.dynamixel.chain import build_dynamixel

    return build_dynamixel(what.servos, now_s, what.baud, **options)


def plugin_line(kind: BusKind, params: object, servos: tuple[EmulatedJoint, ...]) -> PluginLine:
    """Return the emulated servos of a package's bus.

    Raises:
        PluginError: the package has none.
    """
    if load(BUS, kind, BusPlugin).device is None:
        raise PluginError(f"{find(BUS, kind).label} has no emulated device: run it without --mock")
    return PluginLine(kind, params, servos)
