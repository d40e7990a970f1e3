"""Deadlines of several heads, from the figures of their runs."""

from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from gazerig.robot.control.loop_timing import BUSY_SHARE

_SHORTEST_S = 3.0
"""A shorter run gives no statistics."""
_ENOUGH = 0.7
"""With a smaller share of the pictures a head reacts visibly later."""


class DeadlineStats(NamedTuple):
    """Missed deadlines of a head.

    Attributes:
        late: share of its ticks that came late.
        pictures_hz: processed pictures a second.
    """

    late: float
    pictures_hz: float

    @classmethod
    def of(cls, figures: Mapping[str, Any]) -> "DeadlineStats | None":
        """Return the statistics from the figures of a run, None for a short run."""
        ticks, overruns, seconds = figures["ticks"], figures["overruns"], figures["seconds"]
        if seconds < _SHORTEST_S:
            return None
        return cls(overruns / max(1, ticks + overruns), figures["pictures"] / seconds)

    def is_behind(self, pictures_hz: float) -> bool:
        """Return whether ticks or pictures fell behind; pictures_hz: requested rate."""
        return self.late >= BUSY_SHARE or self.pictures_hz < _ENOUGH * pictures_hz

    def text(self, pictures_hz: float) -> str:
        """Return a description."""
        return (
            f"{self.late:.0%} of ticks late, {self.pictures_hz:.0f} of {pictures_hz:.0f} pictures "
            "a second"
        )


def overload_message(
    runs: Iterable[tuple[str, Mapping[str, Any] | None]], pictures_hz: float, rendered: bool
) -> str:
    """Return a line with the heads that could not keep up in real time, "" if all did.

    Args:
        runs: name of each head and the figures of its run, None if it did not begin.
        pictures_hz: requested pictures a second.
        rendered: whether pictures were rendered, so that the user can disable them.
    """
    kept = [(name, DeadlineStats.of(figures)) for name, figures in runs if figures is not None]
    slow = [
        f"{name}: {one.text(pictures_hz)}"
        for name, one in kept
        if one is not None and one.is_behind(pictures_hz)
    ]
    if not slow:
        return ""
    less = "; --no-pictures reduces the load" if rendered else ""
    return f"the computer is too busy for these heads ({'; '.join(slow)}){less}"
