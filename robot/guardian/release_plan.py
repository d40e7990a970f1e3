"""Data to release the servos of one port."""

from typing import Any, NamedTuple

from gazerig.drivers.bus.servo_models import HOBBY_KINDS, BusKind


class ReleasePlan(NamedTuple):
    """Servos of one port and the parameters of its line.

    port: path of the serial port
    ids: ids of the servos; channels of a board of hobby servos
    params: parameters of the kind of bus, as in the rig's file
    family: name of the family of smart servos
    """

    kind: BusKind
    port: str
    ids: tuple[int, ...]
    params: Any
    family: str = ""


def describe(plan: ReleasePlan) -> str:
    """Return a plan's release as text, e.g. "pulses off on 6 channels of PORT"."""
    count = len(plan.ids)
    if plan.kind in HOBBY_KINDS:
        return f"pulses off on {count} channel{'s' * (count != 1)} of {plan.port}"
    return f"torque off on {count} servo{'s' * (count != 1)} of {plan.port}"
