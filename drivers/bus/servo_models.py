"""Servo models that a joint can have, with their kind of bus and their steps."""

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING, NamedTuple

from gazerig.drivers.dynamixel.control_table import P_UNIT, PWM_FULL, DynamixelModel
from gazerig.drivers.dynamixel.control_table import STEPS_PER_TURN as STEPS_PER_TURN
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.errors import PluginError
from gazerig.drivers.feetech.family import FEETECH, FEETECH_SCS
from gazerig.drivers.feetech.memory_table import FACTORY_P_GAIN, P_FULL_STEPS, SCS_STEPS
from gazerig.drivers.servo_bus.family import Family, ServoModel

if TYPE_CHECKING:
    from gazerig.drivers.types import ServoConfig

BusKind = str
"""Name of a kind of bus: one of ``BUS_KINDS``, or one of a package."""
BUS_KINDS: tuple[BusKind, ...] = ("dynamixel", "feetech", "maestro", "pca9685")
HOBBY_KINDS: tuple[BusKind, ...] = ("maestro", "pca9685")
"""Our boards that send pulses to hobby servos; each moves every hobby servo."""


US_STEPS = 4
"""Steps of a hobby servo per microsecond: its pulse width is counted in quarter microseconds."""

HOBBY_STEPS_PER_TURN = 1000 * US_STEPS * 4.0
"""1000..2000 us are usually 90 deg."""

HOBBY = "hobby"
"""Name of a hobby servo as a model: its shaft turns with the pulse width, without feedback."""


class ServoModelInfo(NamedTuple):
    """Properties of a servo model.

    bus: its kind of bus; for a hobby servo one of the boards that move it
    steps_per_turn: steps per turn of its shaft; lowest, highest: first and last step of its range
    unit, unit_steps: unit in which its position is shown, "steps" or "us", and its size in steps
    middle: centre of its travel, in that unit
    family: family name of our smart servos; "" for hobby servos and those of packages
    measures_position: whether it measures its position; if not, it has no other feedback either
    hottest_c, lowest_v, highest_v: limits at which it switches itself off, if it has any
    stall_torque_nm: stall torque at its rated voltage; 0.2 for a small hobby servo with metal gears
    stall_current_a: current at that torque, 0 if unknown
    p_gain: its P gain as delivered
    full_steps: steps of error times P gain at which its drive is full, 0 if unknown
    """

    bus: BusKind
    steps_per_turn: float
    lowest: int
    highest: int
    unit: str = "steps"
    unit_steps: float = 1.0
    middle: int = STEPS_PER_TURN // 2
    measures_position: bool = True
    hottest_c: float = 70.0
    lowest_v: float = 0.0
    highest_v: float = inf
    family: str = ""
    stall_torque_nm: float = 0.2
    stall_current_a: float = 0.0
    p_gain: int = 0
    full_steps: float = 0.0

    def stiffness(self, gains: tuple[int, int, int] | None) -> float:
        """Return the share of full drive per step of error, 0 if unknown.

        Args:
            gains: P, I and D gain; None: as delivered. With an I gain no error remains.
        """
        if not self.full_steps or (gains is not None and gains[1]):
            return 0.0
        return (self.p_gain if gains is None else gains[0]) / self.full_steps

    def fits_bus(self, kind: str) -> bool:
        """Return whether it can be on a bus of this kind; any board moves a hobby servo."""
        return kind == self.bus or (self.bus in HOBBY_KINDS and kind in HOBBY_KINDS)


def _smart_servo(family: Family, model: ServoModel) -> ServoModelInfo:
    gain, full_steps = FACTORY_P_GAIN, P_FULL_STEPS * model.steps_per_turn / STEPS_PER_TURN
    if isinstance(model, DynamixelModel):
        gain, full_steps = model.gains[4], P_UNIT * PWM_FULL
    steps = SCS_STEPS if family is FEETECH_SCS else model.steps_per_turn
    return ServoModelInfo(
        family.name.partition(" ")[0],
        model.steps_per_turn,
        0,
        steps - 1,
        middle=steps // 2,
        hottest_c=float(model.temperature_limit),
        lowest_v=0.1 * model.min_voltage,
        highest_v=0.1 * model.max_voltage,
        family=family.name,
        stall_torque_nm=model.stall_torque_nm,
        stall_current_a=model.stall_current_a,
        p_gain=gain,
        full_steps=full_steps,
    )


FAMILIES: dict[str, Family] = {one.name: one for one in (DYNAMIXEL, FEETECH, FEETECH_SCS)}
"""Families of smart servos by name."""

FAMILY_OF: dict[str, Family] = {
    model: family for family in FAMILIES.values() for model in family.models
}
"""Families by the model name in a rig's YAML."""

SERVOS: dict[str, ServoModelInfo] = {
    **{name: _smart_servo(family, family.models[name]) for name, family in FAMILY_OF.items()},
    # 500 to 2500 us is what most servos accept.
    HOBBY: ServoModelInfo(
        "maestro",
        HOBBY_STEPS_PER_TURN,
        500 * US_STEPS,
        2500 * US_STEPS,
        "us",
        US_STEPS,
        1500,
        False,
    ),
}
"""Servo models by their name in a rig's YAML; those of a package are added when its bus is used."""


def add_models(kind: BusKind, models: Mapping[str, ServoModelInfo], label: str) -> None:
    """Add the servo models of a package's bus to ``SERVOS``; ``label`` names it in messages.

    Raises:
        PluginError: a model's name is taken.
    """
    own = {name: model._replace(bus=kind) for name, model in models.items()}
    for name, model in own.items():
        if SERVOS.get(name, model) != model:
            raise PluginError(f"{label}: another servo model is already named {name!r}")
    SERVOS.update(own)


def servo_label(setup: "ServoConfig") -> str:
    """Return a servo's label for messages: its joint and its id, or its channel."""
    return setup.label("channel" if setup.model == HOBBY else "servo")
