"""Communication parameters of a bus of any family."""

from typing import Protocol


class BusParams(Protocol):
    """Parameters that a rig file sets for a bus of any family."""

    @property
    def baud(self) -> int:
        """Bit/s."""

    @property
    def reply_timeout_ms(self) -> float:
        """Longest time-out of an answer beyond its time on the wire, ms."""

    @property
    def prompt_timeout_ms(self) -> float:
        """Shortest time-out of an answer, ms."""

    @property
    def give_up_s(self) -> float:
        """Longest time without the port or any servo, seconds."""

    @property
    def watchdog_ms(self) -> int:
        """Silence after which the servos' own watchdog stops them, ms; 0 for never."""
