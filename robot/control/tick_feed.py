"""The newest tick and the last events, left by the loop for other threads to read."""

from collections import deque
from collections.abc import Callable

from gazerig.robot.control.head_state import HeadEvent
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.lead import LeadState

_MOST_EVENTS = 1000


class TickFeed:
    """One slot and one ring: the loop rebinds a name and appends, and waits for nobody.

    newest: the newest tick, None before the first
    ticks: counts them
    """

    def __init__(self) -> None:
        self.newest: Tick | None = None
        self.ticks = 0
        self._events: deque[HeadEvent] = deque(maxlen=_MOST_EVENTS)
        self._number = 0
        self._joining: deque[Callable[[LeadState], bool]] = deque()
        self._followers: list[Callable[[LeadState], bool]] = []

    def update(self, tick: Tick) -> None:
        """Leave the newest tick; called by the loop."""
        self.newest = tick
        self.ticks += 1
        for event in tick.events:
            self._number += 1
            self._events.append(HeadEvent(self._number, tick.t_s, event))
        while self._joining:
            self._followers.append(self._joining.popleft())
        if self._followers:
            self._followers = [one for one in self._followers if not one(tick.lead)]

    def follow(self, follower: Callable[[LeadState], bool]) -> None:
        """Call a function with the lead of every tick until it returns True."""
        self._joining.append(follower)

    def events(self, after: int = 0) -> tuple[HeadEvent, ...]:
        """Return the events kept whose numbers are above ``after``, oldest first."""
        return tuple([one for one in list(self._events) if one.number > after])
