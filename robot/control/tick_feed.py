"""The newest tick and the last events for other threads."""

from collections import deque
from collections.abc import Callable
from typing import NamedTuple

from gazerig.robot.control.head_state import HeadEvent
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.leader import NO_GESTURE, NOBODY_LEADS, GestureState, LeadState

_MOST_EVENTS = 1000


class Progress(NamedTuple):
    """The progress of a client's command and of a gesture.

    Attributes:
        lead, gesture: The newest ones.
        led: Client that controls gaze or joints, and its command; "" without one.
    """

    lead: LeadState = NOBODY_LEADS
    gesture: GestureState = NO_GESTURE
    led: str = ""


class TickFeed:
    """One slot for the newest tick and a ring of events; the loop never waits for readers.

    Attributes:
        newest: The newest tick, None before the first.
        ticks: Number of ticks.
    """

    def __init__(self) -> None:
        self.newest: Tick | None = None
        self.ticks = 0
        self._events: deque[HeadEvent] = deque(maxlen=_MOST_EVENTS)
        self._number = 0
        self._joining: deque[Callable[[Progress], bool]] = deque()
        self._followers: list[Callable[[Progress], bool]] = []

    def update(self, tick: Tick) -> None:
        """Store the newest tick; called by the loop."""
        self.newest = tick
        self.ticks += 1
        for event in tick.events:
            self._number += 1
            self._events.append(HeadEvent(self._number, tick.t_s, event))
        while self._joining:
            self._followers.append(self._joining.popleft())
        if self._followers:
            now = self.progress()
            self._followers = [one for one in self._followers if not one(now)]

    def follow(self, follower: Callable[[Progress], bool]) -> None:
        """Call a function with the progress of every tick until it returns True."""
        self._joining.append(follower)

    def progress(self) -> Progress:
        """Return the states of control and gesture in the newest tick."""
        tick = self.newest
        return Progress(tick.lead, tick.gesture, tick.led) if tick is not None else Progress()

    def events(self, after: int = 0) -> tuple[HeadEvent, ...]:
        """Return the stored events with numbers above ``after``, the oldest first."""
        return tuple([one for one in list(self._events) if one.number > after])
