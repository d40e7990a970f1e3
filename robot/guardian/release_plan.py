"""Data to release the servos of one port, short enough for a command line."""

import base64
import json
import pickle
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import HOBBY_KINDS, BusKind


class ReleasePlan(NamedTuple):
    """Servos of one port and the parameters of its line.

    port: path of the serial port
    baud: bit/s
    ids: ids of the servos; channels of a Maestro
    crc, channels: settings of a Maestro, as in gazerig.drivers.maestro.board
    address: address of a PCA9685
    family: name of the family of smart servos
    settings: parameters of a package's bus, from ``pickle_params``
    """

    kind: BusKind
    port: str
    baud: int
    ids: tuple[int, ...]
    crc: bool = False
    channels: int = 12
    address: int = 0x40
    family: str = ""
    settings: str = ""


def pickle_params(params: object) -> str:
    """Return the parameters of a package's bus as text."""
    return base64.b85encode(pickle.dumps(params)).decode()


def encode(plans: tuple[ReleasePlan, ...]) -> str:
    """Return plans as one word of a command line."""
    return json.dumps(plans)


def decode(text: str) -> tuple[ReleasePlan, ...]:
    """Return the plans from the text of ``encode``."""
    plans = [ReleasePlan(*fields) for fields in json.loads(text)]
    return tuple(plan._replace(ids=tuple(plan.ids)) for plan in plans)


def describe(plan: ReleasePlan) -> str:
    """Return a plan's release as text, e.g. "pulses off on 6 channels of PORT"."""
    count = len(plan.ids)
    if plan.kind in HOBBY_KINDS:
        return f"pulses off on {count} channel{'s' * (count != 1)} of {plan.port}"
    return f"torque off on {count} servo{'s' * (count != 1)} of {plan.port}"
