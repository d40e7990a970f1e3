"""Every servo model that a joint can have: on which kind of bus, and in which steps it counts."""

from collections.abc import Mapping, Sequence
from math import inf
from typing import TYPE_CHECKING, NamedTuple

from gazerig.drivers.dynamixel.control_table import MODELS as DYNAMIXEL
from gazerig.drivers.dynamixel.control_table import STEPS_PER_TURN as STEPS_PER_TURN
from gazerig.drivers.dynamixel.control_table import DynamixelModel
from gazerig.drivers.errors import PluginError
from gazerig.drivers.feetech.memory_table import MODELS as FEETECH
from gazerig.drivers.feetech.memory_table import SCS_MODELS, SCS_STEPS, FeetechModel
from gazerig.drivers.hobby_board.models import HOBBY, US_STEPS

if TYPE_CHECKING:
    from gazerig.drivers.types import ServoConfig

BusKind = str
"""Name of a kind of bus: one of ``BUS_KINDS``, or one that a package brings."""
BUS_KINDS: tuple[BusKind, ...] = ("dynamixel", "feetech", "maestro", "pca9685")
HOBBY_KINDS: tuple[BusKind, ...] = ("maestro", "pca9685")
"""Our boards that send pulses to hobby servos: any of them moves any."""


SmartModel = DynamixelModel | FeetechModel


class ServoModelInfo(NamedTuple):
    """What is known of a servo model.

    bus: kind of bus it is on; of a hobby servo one of the boards that move it
    steps_per_turn: of its shaft; lowest, highest: first and last step it can be sent to
    unit, unit_steps: unit in which its position is shown, "steps" or "us", and how many
        steps that is
    middle: of its travel, in that unit
    family: of a smart servo of ours, by its name; "" for hobby servos and those of packages
    measured: whether it measures its position; without that it has no other feedback either
    hottest_c, lowest_v, highest_v: limits at which it switches itself off, if it does
    stall_torque_nm: at its rated voltage; 0.2 of a small hobby servo with metal gears
    """

    bus: BusKind
    steps_per_turn: float
    lowest: int
    highest: int
    unit: str = "steps"
    unit_steps: float = 1.0
    middle: int = STEPS_PER_TURN // 2
    measured: bool = True
    hottest_c: float = 70.0
    lowest_v: float = 0.0
    highest_v: float = inf
    family: str = ""
    stall_torque_nm: float = 0.2

    def fits(self, kind: str) -> bool:
        """Return whether it can be on a bus of this kind: any board moves a hobby servo."""
        if kind == self.bus or self.bus in _ALSO_MOVED.get(kind, ()):
            return True
        return self.bus in HOBBY_KINDS and kind in HOBBY_KINDS


def _smart(bus: BusKind, family: str, model: SmartModel, steps: int) -> ServoModelInfo:
    """Return the model information of a smart servo with so many steps."""
    return ServoModelInfo(
        bus,
        model.steps_per_turn,
        0,
        steps - 1,
        middle=steps // 2,
        hottest_c=float(model.temperature_limit),
        lowest_v=0.1 * model.min_voltage,
        highest_v=0.1 * model.max_voltage,
        family=family,
        stall_torque_nm=model.stall_torque_nm,
    )


SERVOS: dict[str, ServoModelInfo] = {
    **{n: _smart("dynamixel", "dynamixel", m, STEPS_PER_TURN) for n, m in DYNAMIXEL.items()},
    **{n: _smart("feetech", "feetech", m, m.steps_per_turn) for n, m in FEETECH.items()},
    **{n: _smart("feetech", "feetech scs", m, SCS_STEPS) for n, m in SCS_MODELS.items()},
    **{
        name: ServoModelInfo(
            "maestro",
            model.steps_per_turn,
            model.lowest,
            model.highest,
            "us",
            US_STEPS,
            1500,
            False,
        )
        for name, model in HOBBY.items()
    },
}
"""By the model name in a rig's YAML; those of a package are added as its bus is used."""

_ALSO_MOVED: dict[BusKind, tuple[BusKind, ...]] = {}
"""Kind of a package -> kinds of which it moves the servos too."""


def add_models(
    kind: BusKind, models: Mapping[str, ServoModelInfo], moves: Sequence[str], label: str
) -> None:
    """Make the servo models of a package's bus known.

    Args:
        kind: of the bus.
        models: by name.
        moves: names of models of others that it moves too.
        label: of the package in messages.

    Raises:
        PluginError: a model has a name that is taken, or is no model.
    """
    for name, model in models.items():
        if not isinstance(model, ServoModelInfo):
            raise PluginError(f"{label}: its servo model {name!r} is no ServoModelInfo")
        if SERVOS.get(name, model._replace(bus=kind)) != model._replace(bus=kind):
            raise PluginError(f"{label}: there is another servo model {name!r} already")
    for name in moves:
        if name not in SERVOS:
            raise PluginError(f"{label}: there is no servo model {name!r} that it could move too")
    SERVOS.update({name: m._replace(bus=kind) for name, m in models.items()})
    _ALSO_MOVED[kind] = tuple(SERVOS[name].bus for name in moves)


def servo_label(setup: "ServoConfig") -> str:
    """Return a servo's label for messages: its joint and its id, or its channel."""
    return setup.label("channel" if setup.model in HOBBY else "servo")
