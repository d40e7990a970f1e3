"""Events of gaze, people and tracks, found in consecutive ticks."""

from collections.abc import Iterator, Sequence
from typing import Literal, NamedTuple

from gazerig.gaze.track.track import FINISHED
from gazerig.gaze.types import ORDERED, Target
from gazerig.robot.loop.tick import Tick
from gazerig.robot.loop.tick_text import target_name
from gazerig.robot.model.client_control import GONE_S
from gazerig.robot.model.control_source import TrackState

EventKind = Literal[
    "message", "saccade_start", "saccade_landing", "blink", "target", "person_arrived",
    "person_left", "track_finished", "cue",
]  # fmt: skip
"""message: of the bus, the camera or a program's request; all others are found in the ticks."""


class GazeChange(NamedTuple):
    """An event of a tick.

    Attributes:
        text: Description in one line.
        kind: Kind of event.
        subject: Number of the person, name of the target, of the track or of the cue.
    """

    text: str
    kind: EventKind
    subject: int | str


class GazeEvents:
    """Compares each tick with the previous one."""

    def __init__(self) -> None:
        self._last: Tick | None = None
        self._seen_s: dict[int, float] = {}

    def update(self, tick: Tick) -> list[GazeChange]:
        """Return the events of a tick; those of parking are not events."""
        last, self._last = self._last, tick
        if last is None or tick.parking:
            return self._people(tick)
        found: list[GazeChange] = []
        gaze, target = tick.gaze, tick.target
        ballistic = last.gaze.phase == "saccade", gaze.phase == "saccade"
        other = gaze.saccades != last.gaze.saccades
        if ballistic[0] and (other or not ballistic[1]):
            found.append(_target_change("the eyes land at", "saccade_landing", last.target))
        if target is not last.target and _identity(target) != _identity(last.target):
            found.append(_target_change("the target is", "target", target))
        if ballistic[1] and (other or not ballistic[0]):
            found.append(_target_change("saccade to", "saccade_start", target))
        if gaze.blink and not last.gaze.blink:
            found.append(GazeChange("blink", "blink", ""))
        if tick.tracks is not last.tracks:
            found += _track_changes(last.tracks, tick.tracks)
        return found + self._people(tick)

    def _people(self, tick: Tick) -> list[GazeChange]:
        """Return arrivals, and departures of people who have not been seen for some time."""
        found: list[GazeChange] = []
        for face in tick.percept.faces if tick.percept is not None else ():
            if face.id not in self._seen_s:
                found.append(GazeChange(f"person {face.id} has arrived", "person_arrived", face.id))
            self._seen_s[face.id] = tick.t_s
        for person, seen_s in tuple(self._seen_s.items()):
            if tick.t_s - seen_s > GONE_S:
                del self._seen_s[person]
                found.append(GazeChange(f"person {person} has left", "person_left", person))
        return found


def _track_changes(
    last: Sequence[TrackState], tracks: Sequence[TrackState]
) -> Iterator[GazeChange]:
    """Yield the cues that tracks have passed, and the ends of tracks."""
    before = {track.number: track for track in last}
    for now in tracks:
        was = before.get(now.number)
        if now.cues > (was.cues if was is not None else 0):
            yield GazeChange(f"{now.name} passes the cue {now.cue}", "cue", now.cue)
        if not now.is_playing and was is not None and was.is_playing:
            reason = now.end_reason
            text = (
                f"{now.name} has finished" if reason == FINISHED else f"{now.name} ended: {reason}"
            )
            yield GazeChange(text, "track_finished", now.name)


def _identity(target: Target) -> tuple[str, int, str | None]:
    return target.kind, target.id, target.part


def _target_change(text: str, kind: EventKind, target: Target) -> GazeChange:
    name = target_name(target)
    shown = "the chosen point" if target.kind == ORDERED else name
    return GazeChange(f"{text} {shown}", kind, name)
