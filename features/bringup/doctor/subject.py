"""One servo as found, what a rule may say of it, and what rules must know of its kind."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import servo_label
from gazerig.drivers.servo_bus.discovery import FoundServo
from gazerig.drivers.servo_bus.family import Model
from gazerig.drivers.types import ServoConfig
from gazerig.features.bringup.doctor.diagnostics import Level
from gazerig.features.bringup.servo_family import ServoKind

FIX = "gazerig doctor --fix"


class RuleResult(NamedTuple):
    """What a rule says of a servo."""

    level: Level
    what: str
    remedy: str = ""
    fixes: tuple[tuple[str, int], ...] = ()


class WantedSetting(NamedTuple):
    """A register that should have one value.

    text: says what a value means
    remedy: where it is not ``FIX`` no fix is offered; {joint} stands for the joint
    mask: chooses its bits
    least, most: other values within them are as good
    """

    register: str
    value: int
    level: Level
    text: Callable[[int], str]
    remedy: str = FIX
    mask: int = ~0
    least: int | None = None
    most: int | None = None

    def met_by(self, value: int) -> bool:
        """Return whether a register with this value is as it should be."""
        if self.least is None and self.most is None:
            return value & self.mask == self.value
        above = self.least is None or value >= self.least
        return above and (self.most is None or value <= self.most)


class FirmwareNote(NamedTuple):
    """What is to be said of firmware below a number."""

    below: int
    level: Level
    text: str
    remedy: str = ""


class Protection(NamedTuple):
    """The register by which a servo protects motor and gears.

    errors: those that it must heed, by the bits of the register
    text: with {errors} and {value}
    by_hand: what to do, by the model; None: bits that are missing may be set
    """

    register: str
    errors: Mapping[int, str]
    text: str
    by_hand: Callable[[str], str] | None = None


@dataclass(frozen=True)
class ServoChecks:
    """What rules must know of a kind of servo.

    program: of the maker's, for what cannot be set here
    manual: of the maker's
    registers: those that rules ask for
    ping_only: Status Return Level 0 means that nothing but pings is answered
    out_of_voltage: what comes of a supply outside the limits
    error_remedies: by the error; {id} stands for the servo's; errors that are found by their
        measured value alone have ""
    unlimited_at_zero: both position limits 0 mean none at all
    firmware_notes: of a model, the first that applies is said
    """

    kind: ServoKind
    program: str
    manual: str
    registers: tuple[str, ...]
    ping_only: bool
    out_of_voltage: str
    error_remedies: Mapping[str, str]
    unlimited_at_zero: bool
    wanted: tuple[WantedSetting, ...]
    protection: Protection
    firmware_notes: Callable[[str], tuple[FirmwareNote, ...]]


@dataclass(frozen=True, slots=True)
class ServoState:
    """One servo as found.

    values: registers by name, None where the servo gave no good answer
    corrupt: how many of six answers came in pieces
    """

    checks: ServoChecks
    setup: ServoConfig
    found: FoundServo
    values: Mapping[str, int | None]
    corrupt: int = 0

    @property
    def model(self) -> Model:
        """Return the model that it should be."""
        return self.checks.kind.family.models[self.setup.model]

    @property
    def where(self) -> str:
        """Return the joint and the servo."""
        return servo_label(self.setup)

    @property
    def silent(self) -> bool:
        """Return whether none of its registers was read."""
        return all(value is None for value in self.values.values())


Rule = Callable[[ServoState], Iterator[RuleResult]]
