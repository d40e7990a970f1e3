"""What bring-up must know of a kind of smart servo: one value a kind.

The values stand in gazerig.features.bringup.servo_families; everything else in bring-up is written
once. A board of hobby servos, whose channels do not answer, is no such kind.
"""

from collections.abc import Callable
from typing import NamedTuple

from gazerig.drivers.bus.servo_models import BusKind
from gazerig.drivers.serial.port import BusPort
from gazerig.drivers.servo_bus.family import Family

Tell = Callable[[str], None]
"""Takes a few words on what is being done now."""


class Setting(NamedTuple):
    """A register that must have a value where it is calibrated; ``mask`` chooses its bits."""

    register: str
    value: int
    mask: int = ~0

    def of(self, now: int) -> int:
        """Return what the register should be, being this now."""
        return now & ~self.mask | self.value & self.mask


class Driving(NamedTuple):
    """How one servo of a kind is led gently by itself.

    settings: without which its steps do not mean what they should
    offset: register that shifts its position; offset_usable: it keeps to that
    full_drive: register and the one that holds its largest value, to which it is put back
    gentle: makes the registers of a share of full drive and a speed in steps/s; reads registers
        by name
    load: present current as a share of the stall current, of a model by its name
    """

    settings: tuple[Setting, ...]
    offset: str
    offset_usable: bool
    full_drive: tuple[str, str] | None
    gentle: Callable[[Callable[[str], int], float, float], dict[str, int]]
    load: Callable[[str, int], float]


class ServoKind(NamedTuple):
    """One kind of smart servo; ports are open at the baud rate that is given or was found.

    title: as people call it
    family: what the engine must know of it
    no_reply: what to look at where no servo answers
    notes: what must be known of all of them
    driving: None where this program does not drive one by itself
    set_middle: makes the present position the middle, None where a kind cannot
    """

    name: BusKind
    title: str
    family: Family
    no_reply: str
    notes: tuple[str, ...]
    driving: Driving | None
    set_middle: Callable[[BusPort, Family, int], int] | None = None
