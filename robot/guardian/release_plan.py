"""What must be known to release the servos of one port: data that fits on a command line."""

import base64
import json
import pickle
from collections.abc import Callable
from typing import Any, NamedTuple

from gazerig.drivers.bus.servo_models import HOBBY_KINDS, BusKind
from gazerig.drivers.maestro.params import Form, MaestroParams
from gazerig.drivers.serial.port import BusPort


class ReleasePlan(NamedTuple):
    """The servos of one port and how they are reached.

    port: path of the serial port
    baud: bit/s
    ids: of the servos; channels of a Maestro
    protocol, device, crc, channels: of a Maestro, as in gazerig.drivers.maestro.params
    addresses: of PCA9685 boards
    family: of smart servos, by its name
    settings: of a package's bus, its parameters as ``pickled`` wrote them
    """

    kind: BusKind
    port: str
    baud: int
    ids: tuple[int, ...]
    protocol: Form = "compact"
    device: int = 12
    crc: bool = False
    channels: int = 12
    addresses: tuple[int, ...] = ()
    family: str = ""
    settings: str = ""


def pickled(params: object) -> str:
    """Return the parameters of a package's bus as text."""
    return base64.b85encode(pickle.dumps(params)).decode()


def unpickled(text: str) -> Any:
    """Return the parameters that ``pickled`` wrote in this program."""
    return pickle.loads(base64.b85decode(text))


def encode(plans: tuple[ReleasePlan, ...]) -> str:
    """Return plans as one word of a command line."""
    return json.dumps(plans)


def decode(text: str) -> tuple[ReleasePlan, ...]:
    """Return the plans that ``encode`` wrote."""
    plans = [ReleasePlan(*fields) for fields in json.loads(text)]
    return tuple(
        plan._replace(ids=tuple(plan.ids), addresses=tuple(plan.addresses)) for plan in plans
    )


Releaser = Callable[[BusPort], tuple[int, ...]]


def releaser(plan: ReleasePlan) -> Releaser:
    """Return what releases the servos of a plan through a port of its path.

    It opens the port and returns the ids that did not confirm; it raises PortError where the
    port cannot be opened, BusLost where it went away. All that it needs is imported here.
    """
    return RELEASERS.get(plan.kind, _of_package)(plan)


def _smart(plan: ReleasePlan) -> Releaser:
    from gazerig.drivers.bus.servo_families import FAMILIES
    from gazerig.drivers.servo_bus.torque import disable_torque

    family = FAMILIES[plan.family or plan.kind]
    return lambda port: disable_torque(port, family, plan.baud, plan.ids)


def _maestro(plan: ReleasePlan) -> Releaser:
    from gazerig.drivers.hobby_board.release import stop_pulses
    from gazerig.drivers.maestro.line import MaestroLink

    params = MaestroParams(plan.baud, plan.protocol, plan.device, plan.crc, plan.channels)
    return lambda port: stop_pulses(port, plan.baud, MaestroLink(port, params), plan.ids)


def _pca9685(plan: ReleasePlan) -> Releaser:
    from gazerig.drivers.hobby_board.release import stop_pulses
    from gazerig.drivers.pca9685.board import Pca9685Board
    from gazerig.drivers.pca9685.params import Pca9685Params

    first, *more = plan.addresses
    params = Pca9685Params(first, tuple(more))
    return lambda port: stop_pulses(port, params.baud, Pca9685Board(port, params), plan.ids)


def _of_package(plan: ReleasePlan) -> Releaser:
    from gazerig.drivers.plugins import BUS, BusPlugin, load

    release, params = load(BUS, plan.kind, BusPlugin).release, unpickled(plan.settings)
    if release is None:
        return lambda port: ()
    wanted = release
    return lambda port: wanted(port, params, plan.ids)


RELEASERS: dict[BusKind, Callable[[ReleasePlan], Releaser]] = {
    "dynamixel": _smart,
    "feetech": _smart,
    "maestro": _maestro,
    "pca9685": _pca9685,
}
"""By the kind of bus; each imports what it needs alone."""


def describe(plan: ReleasePlan) -> str:
    """Return what letting go of a plan's servos means, e.g. "pulses off on 6 channels of PORT"."""
    count = len(plan.ids)
    if plan.kind in HOBBY_KINDS:
        return f"pulses off on {count} channel{'s' * (count != 1)} of {plan.port}"
    return f"torque off on {count} servo{'s' * (count != 1)} of {plan.port}"
