"""How well several heads kept their time together, from the figures of their runs."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from gazerig.robot.control.loop_timing import BUSY_SHARE

_TELLING_S = 3.0
"""A shorter run tells nothing."""
_ENOUGH = 0.7
"""With a smaller share of the pictures a head reacts visibly later."""


class KeptTime(NamedTuple):
    """How well a head kept its time.

    Attributes:
        late: share of its ticks that came late.
        pictures_hz: how many pictures it saw a second.
    """

    late: float
    pictures_hz: float

    @classmethod
    def of(cls, figures: Mapping[str, Any]) -> "KeptTime | None":
        """Return it of the figures of a run, None of one that was too short to tell."""
        ticks, overruns, seconds = figures["ticks"], figures["overruns"], figures["seconds"]
        if seconds < _TELLING_S:
            return None
        return cls(overruns / max(1, ticks + overruns), figures["pictures"] / seconds)

    def is_behind(self, pictures_hz: float) -> bool:
        """Return whether ticks or pictures fell behind; pictures_hz: as many were asked for."""
        return self.late >= BUSY_SHARE or self.pictures_hz < _ENOUGH * pictures_hz

    def text(self, pictures_hz: float) -> str:
        """Return it in words."""
        return (
            f"{self.late:.0%} of ticks late, {self.pictures_hz:.0f} of {pictures_hz:.0f} pictures "
            "a second"
        )


def fell_behind(
    runs: Iterable[tuple[str, Mapping[str, Any] | None]], pictures_hz: float, rendered: bool
) -> str:
    """Return in one line which heads could not keep up in real time, "" where all did.

    Args:
        runs: name of each head and the figures of its run, None where it did not begin.
        pictures_hz: as many pictures a second were asked for.
        rendered: pictures were, so that there is something to leave out.
    """
    kept = [(name, KeptTime.of(figures)) for name, figures in runs if figures is not None]
    slow = [
        f"{name}: {one.text(pictures_hz)}"
        for name, one in kept
        if one is not None and one.is_behind(pictures_hz)
    ]
    if not slow:
        return ""
    less = "; --no-pictures asks less of it" if rendered else ""
    return f"the computer is too busy for these heads ({'; '.join(slow)}){less}"
