"""The kinds of smart servos, one value per kind. Only this module of bring-up names makes.

Boards of hobby servos, whose channels do not answer, are not included.
"""

from collections.abc import Callable
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import SERVOS, BusKind
from gazerig.drivers.dynamixel.family import DYNAMIXEL as DYNAMIXEL_FAMILY
from gazerig.drivers.feetech.family import FEETECH as FEETECH_FAMILY
from gazerig.drivers.feetech.family import FEETECH_SCS
from gazerig.drivers.feetech.memory_table import SET_MIDDLE
from gazerig.drivers.servo_bus.family import Family

Tell = Callable[[str], None]
"""Receives a short text about the present step."""


class ServoKind(NamedTuple):
    """Kind of smart servo; ports are open at the given or detected baud rate.

    title: common name
    family: properties for the engine
    set_middle: value of Torque Enable that makes the present position the middle, None if the kind
        does not support it
    """

    name: BusKind
    title: str
    family: Family
    set_middle: int | None = None


DYNAMIXEL = ServoKind("dynamixel", "Dynamixel", DYNAMIXEL_FAMILY)
FEETECH = ServoKind("feetech", "Feetech STS", FEETECH_FAMILY, SET_MIDDLE)
SCS = ServoKind("feetech", "Feetech SCS", FEETECH_SCS)

KINDS: dict[str, ServoKind] = {kind.name: kind for kind in (DYNAMIXEL, FEETECH)}
"""Kinds by the name of a bus kind in a rig's YAML."""

_KIND_OF = {kind.family.name: kind for kind in (*KINDS.values(), SCS)}


def servo_kind(model: str) -> ServoKind:
    """Return the kind of a smart servo by its model."""
    return _KIND_OF[SERVOS[model].family]
