"""How to speak with the servos of one bus, whatever their make."""

from typing import Protocol


class BusParams(Protocol):
    """What a rig file chooses for a bus of any family."""

    @property
    def baud(self) -> int:
        """Bit/s."""

    @property
    def reply_timeout_ms(self) -> float:
        """Longest time-out of an answer beyond its time on the wire."""

    @property
    def prompt_timeout_ms(self) -> float:
        """Shortest time-out of an answer."""

    @property
    def give_up_s(self) -> float:
        """How long port or servos may be gone."""

    @property
    def watchdog_ms(self) -> int:
        """Silence after which servos stop by themselves, 0 for never."""
