"""One STS servo as found, for the rules that judge it."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass

from drivers.feetech.memory_table import MODELS, FeetechModel
from drivers.servo_models import servo_label
from drivers.types import ServoSetup
from robot.bringup.doctor.subject import Verdict
from robot.bringup.servo_kind import Found


@dataclass(frozen=True, slots=True)
class StsPatient:
    """One servo as found.

    values: registers by name; those that gave no good answer are missing
    garbled: how many of six answers came in pieces
    """

    setup: ServoSetup
    found: Found
    values: Mapping[str, int]
    garbled: int = 0

    @property
    def model(self) -> FeetechModel:
        """Give the model that it should be."""
        return MODELS[self.setup.model]

    @property
    def where(self) -> str:
        """Name the joint and the servo."""
        return servo_label(self.setup)

    @property
    def whole(self) -> bool:
        """Tell whether both halves of the table were read."""
        return "id" in self.values and "present_position" in self.values


StsRule = Callable[[StsPatient], Iterator[Verdict]]
