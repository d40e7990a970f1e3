"""The right of a client to control a part of the head until it is no longer renewed."""

from gazerig.robot.model.commands import HEARTBEAT_S


class Lease:
    """A right that ends after ``HEARTBEAT_S`` without a heartbeat, unless it stays.

    Attributes:
        who: Name of the client, "" without one.
        stay: Whether it needs no heartbeat.
    """

    def __init__(self) -> None:
        self.who = ""
        self.stay = False
        self._renewed_s = 0.0

    def start(self, who: str, stay: bool, t_s: float) -> None:
        """Give the right to a client."""
        self.who, self.stay, self._renewed_s = who, stay, t_s

    def renew(self, who: str, t_s: float) -> bool:
        """Record a heartbeat; return whether it came from the present client."""
        if who != self.who:
            return False
        self._renewed_s = t_s
        return True

    def has_lapsed(self, t_s: float) -> bool:
        """Return whether the heartbeat is missing."""
        return not self.stay and t_s - self._renewed_s > HEARTBEAT_S
