"""Newest tick and last events, for other threads."""

from collections import deque
from collections.abc import Callable
from itertools import takewhile

from gazerig.robot.loop.gaze_events import GazeEvents
from gazerig.robot.loop.head_state import HeadEvent
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.outcome import Progress

_MOST_EVENTS = 1000


class TickFeed:
    """One slot for the newest tick and rings of events; the loop never waits for readers.

    Attributes:
        newest: The newest tick, None before the first.
        ticks: Number of ticks.
        number: Number of the newest event, 0 before the first.
    """

    def __init__(self) -> None:
        self.newest: Tick | None = None
        self.ticks = 0
        self._messages: deque[HeadEvent] = deque(maxlen=_MOST_EVENTS)
        # Separate, because they are many and would displace messages.
        self._others: deque[HeadEvent] = deque(maxlen=_MOST_EVENTS)
        self._changes = GazeEvents()
        self.number = 0
        self._joining: deque[Callable[[Progress], bool]] = deque()
        self._followers: list[Callable[[Progress], bool]] = []

    def update(self, tick: Tick) -> None:
        """Store the newest tick; called by the loop."""
        self.newest = tick
        self.ticks += 1
        for text in tick.events:
            self.number += 1
            self._messages.append(HeadEvent(self.number, tick.t_s, text))
        for change in self._changes.update(tick):
            self.number += 1
            self._others.append(HeadEvent(self.number, tick.t_s, *change))
        while self._joining:
            self._followers.append(self._joining.popleft())
        if self._followers:
            now = self.progress()
            self._followers = [one for one in self._followers if not one(now)]

    def follow(self, follower: Callable[[Progress], bool]) -> None:
        """Call a function with the progress of every tick until it returns True."""
        self._joining.append(follower)

    def progress(self) -> Progress:
        """Return the states of control and tracks in the newest tick."""
        tick = self.newest
        return (
            Progress(tick.client_control, tick.tracks, tick.controlled_by)
            if tick is not None
            else Progress()
        )

    def events(self, after: int = 0) -> tuple[HeadEvent, ...]:
        """Return the stored events with numbers above ``after``, the oldest first."""
        newest = self.number  # an event added meanwhile must not hide an earlier one
        found = [*_events_after(self._messages, after), *_events_after(self._others, after)]
        found = [event for event in found if event.number <= newest]
        return tuple(sorted(found, key=lambda event: event.number))

    def messages(self) -> tuple[HeadEvent, ...]:
        """Return the stored events of the bus, the camera and programs, the oldest first."""
        return tuple(self._messages)


def _events_after(events: deque[HeadEvent], after: int) -> list[HeadEvent]:
    newest_first = reversed(list(events))  # a copy, because the loop may append meanwhile
    return list(takewhile(lambda event: event.number > after, newest_first))
