"""What the experimenter's page needs of the head that is shown."""

from dataclasses import dataclass
from typing import Literal, Protocol

HeadHealth = Literal["none", "alive", "late", "fault", "stopped"]
"""none: films are shown; late: it does not answer; stopped: its torque is off."""


@dataclass(frozen=True)
class HeadReport:
    """How the head is; says: what is wrong or who stopped it, "" for nothing."""

    state: HeadHealth
    says: str = ""


class HeadLink(Protocol):
    """A head in another process; its methods are called from any thread, and wait for it."""

    def report(self) -> HeadReport:
        """Return how the head is, at once."""
        ...

    def stop(self, why: str) -> str:
        """Switch its torque off; return why that was not done, "" where it was.

        Raises:
            OSError: the head is gone, or does not answer.
        """
        ...

    def resume(self) -> str:
        """Put its torque on again; return why that was not done, "" where it was.

        Raises:
            OSError: the head is gone, or does not answer.
        """
        ...


class NoHead:
    """Films are shown: there is nothing to stop."""

    def report(self) -> HeadReport:
        """Return that there is no head."""
        return HeadReport("none")

    def stop(self, why: str) -> str:
        """Return why nothing is stopped."""
        return "no head is shown"

    def resume(self) -> str:
        """Return why nothing goes on."""
        return "no head is shown"
