"""Presentation of conditions: the head in the room, or films in the browser."""

from dataclasses import dataclass
from math import nan
from typing import Protocol

from gazerig.features.study.session import ShownTrial


class HeadLost(Exception):
    """The head cannot show conditions any more; the message gives the reason."""


@dataclass(frozen=True)
class PresentationData:
    """Data of a presentation that has ended; see records.TrialEnded."""

    recording: str = ""
    span_s: tuple[float, float] = (nan, nan)


class Presenter(Protocol):
    """Shows conditions; it is called from one thread at a time."""

    def begin(self, shown: ShownTrial) -> None:
        """Start to show a condition.

        Raises:
            HeadLost: it cannot be shown.
        """

    def end(self) -> PresentationData:
        """End the presentation; return its data."""

    def fault(self) -> str:
        """Return why conditions cannot be shown, "" without a fault."""

    def restart(self) -> None:
        """Try to restart the head after a fault; ``fault`` reports the result."""


class FilmPresenter:
    """Does nothing, because the browser shows the films."""

    def begin(self, shown: ShownTrial) -> None:
        """Do nothing."""

    def end(self) -> PresentationData:
        """Report that nothing was recorded."""
        return PresentationData()

    def fault(self) -> str:
        """Report no fault."""
        return ""

    def restart(self) -> None:
        """Do nothing."""
