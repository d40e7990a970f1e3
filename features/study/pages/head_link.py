"""Interface of the experimenter's page to the head."""

from dataclasses import dataclass
from typing import Literal, Protocol

HeadHealth = Literal["none", "alive", "late", "fault", "stopped"]
"""none: films are shown; late: it does not answer; stopped: its torque is off."""


@dataclass(frozen=True)
class HeadReport:
    """Health of the head; says: the fault or the reason of a stop, "" without one."""

    state: HeadHealth
    says: str = ""


class HeadLink(Protocol):
    """A head in another process; its methods are called from any thread, and block."""

    def report(self) -> HeadReport:
        """Return the head's health immediately."""
        ...

    def stop(self, why: str) -> str:
        """Switch its torque off; return the reason of a failure, "" on success.

        Raises:
            OSError: the head has ended, or does not answer.
        """
        ...

    def resume(self) -> str:
        """Switch its torque on again; return the reason of a failure, "" on success.

        Raises:
            OSError: the head has ended, or does not answer.
        """
        ...


class NoHead:
    """Replaces the head for films, with nothing to stop."""

    def report(self) -> HeadReport:
        """Report that there is no head."""
        return HeadReport("none")

    def stop(self, why: str) -> str:
        """Return the reason of the failure: no head is shown."""
        return "no head is shown"

    def resume(self) -> str:
        """Return the reason of the failure: no head is shown."""
        return "no head is shown"
