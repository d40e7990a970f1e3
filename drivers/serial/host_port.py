"""What all ports of this computer have in common."""

import time
from collections.abc import Callable

from gazerig.drivers.errors import BusLost


class HostPort:
    """A port of this computer.

    Args:
        port_name: Its path.
        exclusive: Whether to open it for this program alone; otherwise it is shared with the
            program that has it open.
        on_traffic: Called whenever bytes are sent or waited for; None if not needed.

    now_s: returns host monotonic seconds
    """

    now_s = staticmethod(time.monotonic)

    def __init__(
        self,
        port_name: str,
        exclusive: bool = True,
        on_traffic: Callable[[], None] | None = None,
    ) -> None:
        self.port_name = port_name
        self._exclusive, self._on_traffic = exclusive, on_traffic or (lambda: None)

    def _lost(self, reason: object) -> BusLost:
        return BusLost(f"{self.port_name} is gone ({reason}): check USB cable and servo power")
