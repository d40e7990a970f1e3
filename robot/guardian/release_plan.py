"""What must be known to let go of the servos of one port: data that fits on a command line."""

import json
from collections.abc import Callable
from typing import NamedTuple

from gazerig.drivers.maestro.params import Form, MaestroParams
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_models import HOBBY_KINDS, BusKind


class ReleasePlan(NamedTuple):
    """The servos of one port and how they are reached.

    port: path of the serial port
    baud: bit/s
    ids: of the servos; channels of a Maestro
    protocol, device, crc, channels: of a Maestro, as in gazerig.drivers.maestro.params
    addresses: of PCA9685 boards
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


def encode(plans: tuple[ReleasePlan, ...]) -> str:
    """Return plans as one word of a command line."""
    return json.dumps(plans)


def decode(text: str) -> tuple[ReleasePlan, ...]:
    """Return the plans that ``encode`` wrote."""
    plans = [ReleasePlan(*fields) for fields in json.loads(text)]
    return tuple(
        plan._replace(ids=tuple(plan.ids), addresses=tuple(plan.addresses)) for plan in plans
    )


def releaser(plan: ReleasePlan) -> Callable[[BusPort], tuple[int, ...]]:
    """Return what lets go of the servos of a plan through a port of its path.

    It opens the port and returns the ids that did not confirm; it raises
    PortError where the port cannot be opened, BusLost where it
    went away. All that it needs is imported here, and of the drivers no more than one.
    """
    if plan.kind == "feetech":
        from gazerig.drivers.feetech.family import FEETECH
        from gazerig.drivers.servo_bus.release import disable_torque

        return lambda port: disable_torque(port, FEETECH, plan.baud, plan.ids)
    if plan.kind == "maestro":
        from gazerig.drivers.maestro import release as maestro

        params = MaestroParams(plan.baud, plan.protocol, plan.device, plan.crc, plan.channels)
        return lambda port: maestro.stop_pulses(port, params, plan.ids)
    if plan.kind == "pca9685":
        from gazerig.drivers.pca9685 import release as pca9685
        from gazerig.drivers.pca9685.params import Pca9685Params

        first, *more = plan.addresses
        boards = Pca9685Params(first, tuple(more))
        return lambda port: pca9685.stop_pulses(port, boards, plan.ids)
    from gazerig.drivers.dynamixel.family import DYNAMIXEL
    from gazerig.drivers.servo_bus.release import disable_torque

    return lambda port: disable_torque(port, DYNAMIXEL, plan.baud, plan.ids)


def describe(plan: ReleasePlan) -> str:
    """Return what letting go of a plan's servos means, e.g. "pulses off on 6 channels of PORT"."""
    count = len(plan.ids)
    if plan.kind in HOBBY_KINDS:
        return f"pulses off on {count} channel{'s' * (count != 1)} of {plan.port}"
    return f"torque off on {count} servo{'s' * (count != 1)} of {plan.port}"
