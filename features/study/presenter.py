"""What shows a condition to a participant: the head in the room, or films in the browser."""

from dataclasses import dataclass
from math import nan
from typing import Protocol

from gazerig.features.study.session import ShownTrial


class HeadLost(Exception):
    """The head cannot show anything any more; the message says why."""


@dataclass(frozen=True)
class Presented:
    """What is known of a presentation that has ended; see records.TrialEnded."""

    recording: str = ""
    span_s: tuple[float, float] = (nan, nan)


class Presenter(Protocol):
    """Shows conditions; its calls come from one thread at a time."""

    def begin(self, shown: ShownTrial) -> None:
        """Show a condition from now on.

        Raises:
            HeadLost: it cannot.
        """

    def end(self) -> Presented:
        """Return what is known of the presentation that ends now."""

    def fault(self) -> str:
        """Return why nothing can be shown, "" while all is well."""

    def restart(self) -> None:
        """Try to have the head again after a fault; what is wrong then ``fault`` says."""


class FilmPresenter:
    """Films are shown by the browser: nothing is to be done here."""

    def begin(self, shown: ShownTrial) -> None:
        """Do nothing."""

    def end(self) -> Presented:
        """Return that nothing was recorded."""
        return Presented()

    def fault(self) -> str:
        """Return that all is well."""
        return ""

    def restart(self) -> None:
        """Do nothing."""
