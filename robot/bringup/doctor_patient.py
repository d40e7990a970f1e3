"""One servo as found, and what a rule may say of it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from drivers.dynamixel_table import MODELS, Model
from drivers.servo_models import SERVOS
from drivers.types import ServoSetup
from robot.bringup.findings import Level
from robot.bringup.servo_kind import Found


@dataclass(frozen=True, slots=True)
class Patient:
    """One servo as found.

    values: registers by name, None where the servo gave no good answer
    garbled: how many of six answers came in pieces
    """

    setup: ServoSetup
    found: Found
    values: Mapping[str, int | None]
    garbled: int = 0

    @property
    def model(self) -> Model:
        """Give the model that it should be."""
        return MODELS[self.setup.model]

    @property
    def where(self) -> str:
        """Name the joint and the servo."""
        return name_servo(self.setup)


class Verdict(NamedTuple):
    """What a rule says of a patient."""

    level: Level
    what: str
    cure: str = ""
    fixes: tuple[tuple[str, int], ...] = ()


Rule = Callable[[Patient], Iterator[Verdict]]


def name_servo(setup: ServoSetup) -> str:
    """Name a joint with its servo, or with its channel where it is a hobby servo."""
    facts = SERVOS.get(setup.model)
    noun = "channel" if facts is not None and facts.bus == "maestro" else "servo"
    return f"{setup.name} ({noun} {setup.id})" if setup.name else f"{noun} {setup.id}"
