"""How all servos of a bus are read: made by the family once the servos' firmware is known."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gazerig.drivers.servo_bus.read_windows import ReadWindow, WindowSchedule
from gazerig.drivers.servo_bus.sync_packets import GroupRead


class AddressMap(NamedTuple):
    """Addresses that a servo's indirect block must hold, as bytes from ``address`` on."""

    address: int
    data: bytes


class ReadPlan(NamedTuple):
    """Windows and packets.

    together, alone: of the reading of all servos, and of servos that are asked alone
    second: of readings that confirm others, and have other lengths than they
    packets: makes the read of some servos with a window, where it is not a plain sync read
    armed: window with torque and limits, to check that a servo is still armed
    covered: every reading holds torque and faults
    block: what indirect blocks must hold, None where there are none
    """

    together: WindowSchedule
    alone: WindowSchedule
    second: WindowSchedule
    packets: Callable[[Sequence[int], ReadWindow], GroupRead] | None = None
    armed: ReadWindow | None = None
    covered: bool = True
    block: AddressMap | None = None
