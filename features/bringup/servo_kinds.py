"""The kinds of smart servos, one value per kind. Only this module of bring-up names makes.

Boards of hobby servos, whose channels do not answer, are not included.
"""

from collections.abc import Callable
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import SERVOS, BusKind
from gazerig.drivers.dynamixel import control_table as dynamixel
from gazerig.drivers.dynamixel.family import DYNAMIXEL as DYNAMIXEL_FAMILY
from gazerig.drivers.errors import SetupError
from gazerig.drivers.feetech import memory_table as feetech
from gazerig.drivers.feetech.family import FEETECH as FEETECH_FAMILY
from gazerig.drivers.feetech.family import FEETECH_SCS
from gazerig.drivers.servo_bus.family import Family

Tell = Callable[[str], None]
"""Receives a short text about the present step."""


class CalibrationRegisters(NamedTuple):
    """Registers for the calibration and gentle motion of one servo of a kind.

    full_drive: a register, and the register of its largest value, which is restored
    gentle_drive: returns the register values for a share of full drive and a speed in steps/s;
        reads registers by name
    load: present current as a fraction of the stall current, by the name of the model
    """

    full_drive: tuple[str, str] | None
    gentle_drive: Callable[[Callable[[str], int], float, float], dict[str, int]]
    load: Callable[[str, int], float]


class ServoKind(NamedTuple):
    """Kind of smart servo; ports are open at the given or detected baud rate.

    title: common name
    family: properties for the engine
    calibration: None if this program does not move a single servo of the kind
    set_middle: value of Torque Enable that makes the present position the middle, None if the kind
        does not support it
    """

    name: BusKind
    title: str
    family: Family
    calibration: CalibrationRegisters | None
    set_middle: int | None = None


GENTLE_ACCELERATION = 10
"""1000 steps/s2, so that a search is at full speed within a tenth of a second."""


def _gentle_dynamixel(
    value: Callable[[str], int], strength: float, speed_steps_s: float
) -> dict[str, int]:
    return {
        "goal_pwm": max(1, round(value("pwm_limit") * strength)),
        "profile_acceleration": 0,
        "profile_velocity": max(1, round(speed_steps_s / dynamixel.VELOCITY_UNIT_STEPS_S)),
    }


def _gentle_feetech(
    value: Callable[[str], int], strength: float, speed_steps_s: float
) -> dict[str, int]:
    return {
        "torque_limit": max(1, round(feetech.TORQUE_FULL * strength)),
        "goal_time": 0,
        "goal_speed": FEETECH_FAMILY.speed_units(speed_steps_s),
        "acceleration": GENTLE_ACCELERATION,
    }


DYNAMIXEL = ServoKind(
    name="dynamixel",
    title="Dynamixel",
    family=DYNAMIXEL_FAMILY,
    calibration=CalibrationRegisters(
        full_drive=("goal_pwm", "pwm_limit"),
        gentle_drive=_gentle_dynamixel,
        # Present Current, or Present Load for a model with that register.
        load=lambda model, current: current * dynamixel.MODELS[model].load_unit,
    ),
)

FEETECH = ServoKind(
    name="feetech",
    title="Feetech STS",
    family=FEETECH_FAMILY,
    calibration=CalibrationRegisters(
        full_drive=None,
        gentle_drive=_gentle_feetech,
        load=lambda model, current: (
            current * feetech.CURRENT_UNIT_MA / 1000.0 / feetech.MODELS[model].stall_current_a
        ),
    ),
    set_middle=feetech.SET_MIDDLE,
)

SCS = FEETECH._replace(
    title="Feetech SCS",
    family=FEETECH_SCS,
    calibration=None,
    set_middle=None,
)

KINDS: dict[str, ServoKind] = {kind.name: kind for kind in (DYNAMIXEL, FEETECH)}
"""Kinds by the name of a bus kind in a rig's YAML."""

_KIND_OF = {kind.family.name: kind for kind in (*KINDS.values(), SCS)}


def servo_kind(model: str) -> ServoKind:
    """Return the kind of a servo by its model.

    Raises:
        SetupError: the model is not a smart servo.
    """
    kind = _KIND_OF.get(SERVOS[model].family)
    if kind is None:
        raise SetupError(f"{model} is no servo that answers: name a joint with a smart servo")
    return kind
