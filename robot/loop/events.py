"""Events of a run: found in consecutive ticks, kept for other threads, and grouped as text."""

import re
import threading
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from itertools import takewhile

from gazerig.gaze.presence import Presence
from gazerig.gaze.types import ORDERED, Target
from gazerig.robot.loop.head_state import EventKind, HeadEvent, HeadReport, head_state
from gazerig.robot.loop.tick import Tick, target_name
from gazerig.robot.model.reply import FINISHED, Progress

_MOST_EVENTS, _MOST_MESSAGES = 2000, 100
"""Number of stored events, and of messages besides."""
_LOOK_S = 0.002
_INSTANT_S = 1e-6
_REGISTER = re.compile(r": .+ (-?\d+ -> -?\d+|set)$")

_Change = tuple[str, EventKind, int | str]
"""Text, kind and subject of an event."""


class TickFeed:
    """One slot for the newest tick and rings of events; the loop never waits for readers.

    Attributes:
        newest: The newest tick, None before the first.
        ticks: Number of ticks.
        number: Number of the newest event, 0 before the first.
    """

    def __init__(self) -> None:
        self.newest: Tick | None = None
        self.ticks = self.number = 0
        self._events: deque[HeadEvent] = deque(maxlen=_MOST_EVENTS)
        # Separate, because the others are many and would displace messages.
        self._messages: deque[HeadEvent] = deque(maxlen=_MOST_MESSAGES)
        self._people = Presence()
        self._joining: deque[Callable[[Progress], bool]] = deque()
        self._never = threading.Event()
        self._followers: list[Callable[[Progress], bool]] = []

    def update(self, tick: Tick) -> None:
        """Store the newest tick and its events; called by the loop.

        Those of parking are not events.
        """
        last, self.newest = self.newest, tick
        self.ticks += 1
        for text in tick.events:
            self._messages.append(self._add(tick, (text, "message", "")))
        if last is not None and not tick.parking:
            for change in (
                *_gaze_changes(last, tick),
                *_track_changes(last, tick),
                *_addressed_change(last, tick),
            ):
                self._add(tick, change)
        for change in self._people_changes(tick):
            self._add(tick, change)
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
        return Progress(tick.client_control, tick.tracks) if tick is not None else Progress()

    def events(self, after: int = 0) -> tuple[HeadEvent, ...]:
        """Return the stored events with numbers above ``after``, the oldest first."""
        newest_first = reversed(list(self._events))  # a copy, because the loop may append meanwhile
        return (*takewhile(lambda event: event.number > after, newest_first),)[::-1]

    def report(self, after: int) -> HeadReport:
        """Return the newest tick, None before the first, and events numbered above ``after``."""
        state = head_state(self.newest) if self.newest is not None else None
        return HeadReport(state, self.events(after), self.number)

    def wait_for_ticks(self, ticks: int, within_s: float) -> bool:
        """Wait for a number of ticks; return whether they have come in time."""
        wanted, waits = self.ticks + ticks, int(within_s / _LOOK_S)
        while self.ticks < wanted and waits > 0:
            self._never.wait(_LOOK_S)
            waits -= 1
        return self.ticks >= wanted

    def messages(self) -> tuple[HeadEvent, ...]:
        """Return the last events of the bus, the camera and programs, the oldest first."""
        return tuple(self._messages)

    def _add(self, tick: Tick, change: _Change) -> HeadEvent:
        self.number += 1
        event = HeadEvent(self.number, tick.t_s, *change)
        self._events.append(event)
        return event

    def _people_changes(self, tick: Tick) -> Iterator[_Change]:
        """Yield arrivals, and departures of people who have not been seen for some time."""
        visible = [face.id for face in tick.percept.faces] if tick.percept is not None else []
        for change, person in self._people.update(visible, tick.t_s):
            if change == "arrival":
                yield f"person {person} has arrived", "person_arrived", person
            else:
                yield f"person {person} has left", "person_left", person


def _gaze_changes(last: Tick, tick: Tick) -> Iterator[_Change]:
    """Yield starts and ends of saccades, new targets and blinks."""
    was, now = last.gaze, tick.gaze
    another = now.saccades != was.saccades
    if was.phase == "saccade" and (another or now.phase != "saccade"):
        yield _target_change("the eyes land at", "saccade_landing", last.target)
    before, after = last.target, tick.target
    if (after.kind, after.id, after.part) != (before.kind, before.id, before.part):
        yield _target_change("the target is", "target", after)
    if now.phase == "saccade" and (another or was.phase != "saccade"):
        yield _target_change("saccade to", "saccade_start", after)
    if now.blink and not was.blink:
        yield "blink", "blink", ""


def _track_changes(last: Tick, tick: Tick) -> Iterator[_Change]:
    """Yield the cues that tracks have passed, and the ends of tracks."""
    if tick.tracks is last.tracks:
        return
    before = {track.number: track for track in last.tracks}
    for now in tick.tracks:
        was = before.get(now.number)
        before_s = was.position_s if was is not None else now.position_s - _INSTANT_S
        for cue, at_s in now.cues:
            passed = before_s < at_s <= now.position_s
            if now.position_s < before_s:  # it has begun again
                passed = at_s > before_s or at_s <= now.position_s
            if passed:
                yield f"{now.name} passes the cue {cue}", "cue", cue
        if not now.is_playing and was is not None and was.is_playing:
            finished = now.end_reason == FINISHED
            text = "has finished" if finished else f"ended: {now.end_reason}"
            yield f"{now.name} {text}", "track_finished", now.name


def _addressed_change(last: Tick, tick: Tick) -> Iterator[_Change]:
    """Yield a change of the person who addresses the head; its subject is "" for nobody."""
    before, now = last.addressed_by, tick.addressed_by
    if now is not None and now != before:
        yield f"person {now} addresses the head", "addressed", now
    elif now != before:
        yield f"person {before} no longer addresses the head", "addressed", ""


def _target_change(text: str, kind: EventKind, target: Target) -> _Change:
    name = target_name(target)
    return f"{text} {'the chosen point' if target.kind == ORDERED else name}", kind, name


def group_events(events: Iterable[str]) -> list[str]:
    """Join events that differ only in their servo: "jaw (servo 1), brow (servo 2): what"."""
    whose: dict[str, list[str]] = {}
    for event in events:
        who, colon, what = event.partition(": ")
        whose.setdefault(what if colon else event, []).append(who if colon else "")
    lines = []
    for what, names in whose.items():
        who = ", ".join(filter(None, names))
        lines.append(f"{who}: {what}" if who else what)
    return lines


def is_register_change(event: str) -> bool:
    """Return whether an event only reports that a register of a servo was set."""
    return _REGISTER.search(event) is not None
