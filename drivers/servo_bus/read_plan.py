"""Plan of the reads of a bus, created by the family once the servos' firmware is known."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

from gazerig.drivers.servo_bus.read_windows import ReadWindow, WindowSchedule
from gazerig.drivers.servo_bus.sync_packets import GroupRead


class AddressMap(NamedTuple):
    """Addresses that a servo's indirect block must contain, as bytes from ``address`` on."""

    address: int
    data: bytes


class ReadPlan(NamedTuple):
    """Read windows and packets.

    together, alone: windows for reads of all servos, and of servos that are read alone
    second: windows for confirming reads, of other lengths than the first reads
    packets: creates the read of some servos with a window, if it is not a plain sync read
    armed: window with torque and limits, to check that a servo is still armed
    covered: whether every read contains torque and faults
    block: required contents of indirect blocks, None if there are none
    """

    together: WindowSchedule
    alone: WindowSchedule
    second: WindowSchedule
    packets: Callable[[Sequence[int], ReadWindow], GroupRead] | None = None
    armed: ReadWindow | None = None
    covered: bool = True
    block: AddressMap | None = None
