"""One servo as found, and what a rule may say of it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from drivers.dynamixel.control_table import MODELS, Model
from drivers.servo_models import servo_label
from drivers.types import ServoSetup
from robot.bringup.doctor.findings import Level
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
        return servo_label(self.setup)


class Verdict(NamedTuple):
    """What a rule says of a patient."""

    level: Level
    what: str
    cure: str = ""
    fixes: tuple[tuple[str, int], ...] = ()


Rule = Callable[[Patient], Iterator[Verdict]]
