"""Reactions: saccades to something that has just come into view, found tick by tick."""

from math import inf
from typing import NamedTuple

from gazerig.robot.control.tick import Tick

_LONGEST_S = 1.0
"""A later saccade is a choice, not a reaction."""


class MeasuredReaction(NamedTuple):
    """A saccade to something that has just come into view.

    seen_s: exposure of the first frame with it; onset_s: the saccade's command; kind: of the thing
    """

    seen_s: float
    onset_s: float
    kind: str

    @property
    def latency_s(self) -> float:
        """Return the time from the frame to the command."""
        return self.onset_s - self.seen_s


class ReactionFinder:
    """Finds reactions in ticks as they arrive."""

    def __init__(self) -> None:
        self._seen: dict[tuple[str, int], float] = {}
        self._captured_s: float | None = None
        self._saccades = -1

    def update(self, tick: Tick) -> MeasuredReaction | None:
        """Add a tick; return the reaction that begins in it, if any."""
        percept = tick.percept
        if percept is not None and percept.captured_s != self._captured_s:
            # A thing in the first percept has not come into view.
            since_s = -inf if self._captured_s is None else percept.captured_s
            self._captured_s = percept.captured_s
            for number, kind in zip(percept.bodies.ids, percept.bodies.kinds, strict=True):
                self._seen.setdefault((kind, number), since_s)
        began = 0 <= self._saccades < tick.gaze.saccades
        self._saccades = tick.gaze.saccades
        name = (tick.target.kind, tick.target.id)
        if not began or tick.stopped or name not in self._seen:
            return None
        seen_s, self._seen[name] = self._seen[name], -inf
        late = tick.t_s - seen_s > _LONGEST_S
        return None if late else MeasuredReaction(seen_s, tick.t_s, tick.target.kind)
