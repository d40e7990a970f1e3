"""Arrivals and departures of people."""

from collections.abc import Iterable, Iterator

GONE_S = 2.0
"""A person who has not been visible for this time has left."""


class Presence:
    """The people who are there, by perception's numbers."""

    def __init__(self) -> None:
        self._seen_s: dict[int, float] = {}

    def __contains__(self, person: int) -> bool:
        """Return whether a person is there."""
        return person in self._seen_s

    def update(self, visible: Iterable[int], t_s: float) -> Iterator[tuple[str, int]]:
        """Yield "arrival" or "departure" with each person who has come or left.

        Args:
            visible: The people in view.
            t_s: Present time.
        """
        for person in visible:
            if person not in self._seen_s:
                yield "arrival", person
            self._seen_s[person] = t_s
        for person, seen_s in tuple(self._seen_s.items()):
            if t_s - seen_s > GONE_S:
                del self._seen_s[person]
                yield "departure", person
