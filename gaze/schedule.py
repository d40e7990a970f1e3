"""Starts of tracks that no program orders: times of day, intervals, people who come and go."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, time
from typing import Annotated, Literal

from gazerig.gaze.presence import Presence
from gazerig.gaze.types import Percept
from gazerig.params import Bounds

DAY_S = 86400.0
_TIME = re.compile(r"([01]?\d|2[0-3]):([0-5]\d)")


@dataclass(frozen=True)
class TrackStart:
    """Starts of one track; each key that is given starts it."""

    # fmt: off
    at: Annotated[tuple[str, ...], 'times of day, as "18:30"'] = ()
    every_s: Annotated[float | None, Bounds(1, 86400), "interval, from the start of the run"] = None
    on: Annotated[Literal["arrival", "departure"] | None, "a person comes into view, or has left"] = None
    # fmt: on

    def __post_init__(self) -> None:
        """Check the times.

        Raises:
            ValueError: one is not a time of day.
        """
        for text in self.at:
            if not _TIME.fullmatch(text):
                raise ValueError(f'at: {text!r} is no time of day; write "00:00" to "23:59"')

    @property
    def times_s(self) -> list[float]:
        """Return the times of day in seconds since midnight."""
        found = [_TIME.fullmatch(text) for text in self.at]
        return [3600.0 * int(one[1]) + 60.0 * int(one[2]) for one in found if one is not None]


def seconds_of_day(now: datetime) -> float:
    """Return the time since midnight."""
    return (now - datetime.combine(now, time())).total_seconds()


class Schedule:
    """The starts of a rig's tracks.

    Args:
        starts: the starts by the name of the track.
    """

    def __init__(self, starts: Mapping[str, TrackStart]) -> None:
        self._starts = starts
        self._before: tuple[float, float] | None = None
        self._people = Presence()

    def due(self, percept: Percept | None, t_s: float, day_s: float) -> list[str]:
        """Return the tracks that start now.

        Args:
            percept: the people in view.
            t_s: present time of the run.
            day_s: time of day, in seconds since midnight.
        """
        if self._before is None:
            self._before, self._began_s = (t_s, day_s), t_s
        (before_s, since_s), self._before = self._before, (t_s, day_s)
        passed_s = (day_s - since_s) % DAY_S
        visible = self._visible(percept) if percept is not None else ()
        changes = {change for change, _ in self._people.update(visible, t_s)}
        return [
            name
            for name, start in self._starts.items()
            if start.on in changes
            or any((day_s - at_s) % DAY_S < passed_s for at_s in start.times_s)
            or self._rounds(start, t_s) > self._rounds(start, before_s)
        ]

    def _rounds(self, start: TrackStart, t_s: float) -> float:
        return 0.0 if start.every_s is None else (t_s - self._began_s) // start.every_s

    def _visible(self, percept: Percept) -> list[int]:
        """Return the living people in view, and those who sit so still that no life is seen."""
        lifeless = percept.bodies.lifeless
        return [
            face.id for face in percept.faces if face.id in self._people or face.id not in lifeless
        ]
