"""Replay of a recording on the page: snapshots, frames and a slider at the player's position.

About 50 snapshots per second are stored, each as the compressed message to the page. The camera's
frames are in a temporary file without a name. ``now_s`` is the viewer's clock and always an
argument; ``at_s`` are seconds since the recording's first tick.
"""

import json
import tempfile
import threading
import zlib
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from math import isfinite
from typing import NamedTuple, Protocol

from gazerig.drivers.errors import SetupError
from gazerig.robot.control.event_text import group_events
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_text import guard_text, perception_text
from gazerig.robot.dashboard.feed.page_process import (
    FRAME,
    MARK_KINDS,
    REPLAY,
    SPEEDS,
    decode_snapshot,
    encode_snapshot,
)
from gazerig.robot.dashboard.feed.snapshot import ShownRig, SnapshotBuilder, SnapshotTexts
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import REPEATED, Ask
from gazerig.robot.model.types import SeenEvent, Trail
from gazerig.robot.perception.egomotion_residual import ResidualFigures
from gazerig.robot.recording.gaze_angles import command_text

_SAME_S = 1e-6


class Mark(NamedTuple):
    """A position to step to: kind is "saccade", "blink" or "event", words describes it."""

    at_s: float
    kind: str
    words: str


STEPS = tuple(f"{way} {kind}" for kind in MARK_KINDS for way in ("previous", "next"))


class PlaybackState(NamedTuple):
    """The state of a player.

    Attributes:
        sought_s: Last requested position, None before the first request.
    """

    at_s: float
    duration_s: float
    playing: bool
    speed: float
    sought_s: float | None


class PlaybackClock:
    """The clock of one recording's playback; it starts paused at the beginning."""

    def __init__(self, duration_s: float, marks: Sequence[Mark] = ()) -> None:
        self._duration_s = duration_s
        self._marks = {kind: tuple(m.at_s for m in marks if m.kind == kind) for kind in MARK_KINDS}
        self._from_s, self._since_s = 0.0, 0.0
        self._playing, self._speed = False, 1.0
        self._sought_s: float | None = None

    def state(self, now_s: float) -> PlaybackState:
        """Return the present state; playback pauses at the end."""
        at_s = self._from_s
        if self._playing:
            at_s += (now_s - self._since_s) * self._speed
            if at_s >= self._duration_s:
                self._set_position(self._duration_s, now_s)
                self._playing, at_s = False, self._duration_s
        return PlaybackState(at_s, self._duration_s, self._playing, self._speed, self._sought_s)

    def play(self, now_s: float) -> None:
        """Play; at the end, start again from the beginning."""
        at_s = self.state(now_s).at_s
        self._set_position(0.0 if at_s >= self._duration_s - _SAME_S else at_s, now_s)
        self._playing = True

    def pause(self, now_s: float) -> None:
        """Pause at the present position."""
        self._set_position(self.state(now_s).at_s, now_s)
        self._playing = False

    def seek(self, at_s: float, now_s: float) -> None:
        """Move to a position, limited to the recording; playback continues from there."""
        self.state(now_s)  # pauses a playback that has reached the end
        self._sought_s = at_s
        self._set_position(min(max(at_s, 0.0), self._duration_s), now_s)

    def set_speed(self, speed: float, now_s: float) -> None:
        """Set the playback speed.

        Raises:
            ValueError: The speed is outside of SPEEDS.
        """
        if not SPEEDS[0] <= speed <= SPEEDS[-1]:
            raise ValueError(f"speed {speed:g} is not between {SPEEDS[0]:g} and {SPEEDS[-1]:g}")
        self._set_position(self.state(now_s).at_s, now_s)
        self._speed = speed

    def step(self, where: str, now_s: float) -> None:
        """Pause at the next or previous saccade, blink or event.

        Raises:
            ValueError: There is no further one, or ``where`` is not in STEPS.
        """
        if where not in STEPS:
            raise ValueError(f"unknown step {where!r}; available: {', '.join(STEPS)}")
        way, kind = where.split()
        at_s, times = self.state(now_s).at_s, self._marks[kind]
        if way == "next":
            i = bisect_right(times, at_s + _SAME_S)
        else:
            i = bisect_left(times, at_s - _SAME_S) - 1
        if not 0 <= i < len(times):
            raise ValueError(f"there is no {where}")
        self._set_position(times[i], now_s)
        self._playing = False

    def handle_request(self, request: object, now_s: float) -> None:
        """Apply a request of the page: play (true or false), seek_s, speed or step.

        Raises:
            ValueError: The request is invalid; the message gives the reason.
        """
        match request:
            case {"play": bool(play), **rest} if not rest:
                (self.play if play else self.pause)(now_s)
            case {"seek_s": int() | float() as at_s, **rest} if not rest and _is_real(at_s):
                self.seek(float(at_s), now_s)
            case {"speed": int() | float() as speed, **rest} if not rest and _is_real(speed):
                self.set_speed(float(speed), now_s)
            case {"step": str(where), **rest} if not rest:
                self.step(where, now_s)
            case _:
                raise ValueError(
                    f"{request!r:.80} is invalid: a replay accepts one of play (true or false), "
                    "seek_s (seconds), speed and step"
                )

    def _set_position(self, at_s: float, now_s: float) -> None:
        """Set the position at a time."""
        self._from_s, self._since_s = at_s, now_s


def _is_real(value: float) -> bool:
    return not isinstance(value, bool) and isfinite(value)


SNAPSHOT_EVERY_S = 0.02
_NO_RESIDUAL = ResidualFigures(None, None, 0)
RECALL_S = 10.0
"""Time before a position for which joints are sent again: the newest part closely, the rest
thinned."""

_CLOSELY_S, _THINNED = 1.5, 2
_MOST_KEPT_EVENTS = 1000  # with the joints about 150 kB: they fit in one message
_GRAVE = ("hold", "torque_off")
_PROGRESS_EVERY = 50


class SnapshotIndex:
    """The snapshots and images of one recording.

    Attributes:
        duration_s: Time from the first tick to the last.
        marks: Positions to step to.
    """

    def __init__(
        self,
        ticks: Iterable[Tick],
        frames: Iterable[tuple[float, bytes]],
        rate_hz: float,
        character: str = "",
        rig: ShownRig | None = None,
        progress: Callable[[float], None] = lambda at_s: None,
    ) -> None:
        """Read the recording.

        Args:
            ticks: Ticks of the run.
            frames: Camera frames: time of the exposure in s and JPEG.
            rate_hz: Control rate of the run.
            character: Character of the run.
            rig: Description of the rig, None if unknown.
            progress: Called with the time in s up to which the recording is read.

        Raises:
            SetupError: There is no tick.
        """
        self._times, self._packed = array("d"), list[bytes]()
        self.marks: list[Mark] = []
        self._events: list[SeenEvent] = []
        self._events_at = array("l")  # number of each event's snapshot
        self._start_s, self.duration_s = 0.0, 0.0
        snapshots = SnapshotBuilder(rate_hz, rig)
        detector, due_s = MarkDetector(), 0.0
        for number, tick in enumerate(ticks):
            self._start_s = tick.t_s if number == 0 else self._start_s
            at_s = tick.t_s - self._start_s
            self.marks += detector.update(tick, at_s)
            self.duration_s = at_s
            snapshots.update(tick)
            if at_s < due_s - 1e-9:
                continue
            due_s = max(due_s + SNAPSHOT_EVERY_S, at_s)
            perception = perception_text(tick, _NO_RESIDUAL)
            said = SnapshotTexts(
                "recorded", detector.behaviour, perception, character, detector.conversation
            )
            if (shown := snapshots.build(said)) is not None:
                self._events += shown.events
                self._events_at.extend([len(self._packed)] * len(shown.events))
                self._times.append(at_s)
                self._packed.append(zlib.compress(encode_snapshot(shown), 1))
            if len(self._packed) % _PROGRESS_EVERY == 0:
                progress(at_s)
        if not self._packed:
            raise SetupError("the recording contains no tick: there is nothing to show")
        self._frame_times, self._places = array("d"), array("Q", (0,))
        self._frames = tempfile.TemporaryFile()  # noqa: SIM115  # open as long as the frames are
        for t_s, jpeg in frames:
            self._frame_times.append(t_s - self._start_s)
            self._frames.write(jpeg)
            self._places.append(self._places[-1] + len(jpeg))

    def __len__(self) -> int:
        """Return the number of snapshots."""
        return len(self._packed)

    @property
    def packed_bytes(self) -> int:
        """Return the memory of the compressed snapshots in bytes."""
        return sum(map(len, self._packed))

    def at(self, at_s: float) -> int:
        """Return the number of the last snapshot that is not after a time."""
        return max(bisect_right(self._times, at_s + 1e-9) - 1, 0)

    def message(self, number: int) -> bytes:
        """Return a snapshot as a message to the page."""
        return zlib.decompress(self._packed[number])

    def message_without_history(self, number: int) -> bytes:
        """Return a snapshot's message without its trail and events, which are sent only once."""
        return encode_snapshot(replace(decode_snapshot(self.message(number)), trail=(), events=()))

    def message_with_history(self, first: int, number: int) -> bytes:
        """Return a snapshot's message with the joints and events since snapshot ``first``."""
        from_s = self._times[number] - RECALL_S
        closely = self.at(self._times[number] - _CLOSELY_S)
        trail: list[Trail] = []
        for past in range(max(first, self.at(from_s)), number + 1):
            if past >= closely:
                trail += decode_snapshot(self.message(past)).trail
            elif past % _THINNED == 0:
                trail += decode_snapshot(self.message(past)).trail[-1:]
        since, until = (bisect_left(self._events_at, n) for n in (first, number + 1))
        events = self._events[max(since, until - _MOST_KEPT_EVENTS) : until]
        shown = replace(
            decode_snapshot(self.message(number)), trail=tuple(trail), events=tuple(events)
        )
        return encode_snapshot(shown)

    @property
    def has_pictures(self) -> bool:
        """Return whether images of the camera were recorded."""
        return len(self._frame_times) > 0

    def frame_at(self, at_s: float) -> int | None:
        """Return the number of the newest frame at a time, None before the first."""
        number = bisect_right(self._frame_times, at_s + 1e-9) - 1
        return number if number >= 0 else None

    def frame(self, number: int) -> bytes:
        """Return a frame as JPEG."""
        self._frames.seek(self._places[number])
        return self._frames.read(self._places[number + 1] - self._places[number])

    def close(self) -> None:
        """Free the frames."""
        self._frames.close()


class MarkDetector:
    """A detector of the positions to step to, tick by tick.

    Attributes:
        behaviour, conversation: Choices of the newest command.
    """

    def __init__(self) -> None:
        self.behaviour = self.conversation = ""
        self._saccades, self._blinks = 0, 0
        self._grave = ""

    def update(self, tick: Tick, at_s: float) -> list[Mark]:
        """Return the marks of this tick."""
        found = []
        if tick.gaze.saccades > self._saccades:
            found.append(Mark(at_s, "saccade", f"saccade to {tick.target.kind}"))
        if tick.gaze.blinks > self._blinks:
            found.append(Mark(at_s, "blink", "blink"))
        self._saccades, self._blinks = tick.gaze.saccades, tick.gaze.blinks
        for command in tick.commands:
            if isinstance(command, REPEATED):
                continue
            found.append(Mark(at_s, "event", command_text(command)))
            match command:
                case Ask("behaviour", choice):
                    self.behaviour = choice
                case Ask("conversation", choice):
                    self.conversation = choice
        found += [Mark(at_s, "event", text) for text in group_events(tick.events)]
        grave = tick.guard_result.level if tick.guard_result.level in _GRAVE else ""
        if grave and grave != self._grave:
            found.append(Mark(at_s, "event", f"guard: {guard_text(tick.guard_result)}"))
        self._grave = grave
        return found


ROUND_S = 0.04
_SLIDE_S = 0.1  # interval of slider updates during playback
_BEAT_S = 0.2
"""Interval of updates while paused; after 1 s without one the page shows the rig as silent."""
_MOST_FRAMES = 20  # per round: eightfold speed needs 16, a late round more
_REST_ROUNDS = 5
_DRAWN_ROUNDS = 35  # the page's slowest panels wait 25 rounds
_MARKS = 170
_MOST_EVENTS = 800  # with 150 characters each they fit in one message
_MOST_WORDS = 150


class Screen(Protocol):
    """A receiver of messages, such as gazerig.robot.dashboard.feed.page_process.PageProcess."""

    def send(self, message: bytes) -> bool:
        """Send a message; return False if it is not accepted now."""
        ...


class Replay:
    """A player of recorded frames on a screen."""

    def __init__(self, frames: SnapshotIndex, clock: Clock) -> None:
        """Start at the beginning, paused."""
        self._frames = frames
        self._clock = clock
        self._player = PlaybackClock(frames.duration_s, frames.marks)
        self._lock = threading.Lock()
        self._number, self._frame = -1, -1
        self._still = 0
        self._missing: int | None = None
        self._sent: PlaybackState | None = None
        self._sent_s, self._introduced = 0.0, False

    def handle_request(self, data: Mapping[str, object]) -> str | None:
        """Apply a request of the page; return the refusal if it is invalid. Thread-safe."""
        if "replay" not in data:
            return "this is a recording: it cannot move a head"
        try:
            self.ask(data["replay"])
        except ValueError as error:
            return str(error)
        return None

    def ask(self, request: object) -> None:
        """Apply a request to the player. Thread-safe.

        Raises:
            ValueError: The request is invalid; the message gives the reason.
        """
        with self._lock:
            self._player.handle_request(request, self._clock.now_s())

    def run(self, screen: Screen, over: Callable[[PlaybackState], bool]) -> None:
        """Update the screen every 40 ms until ``over`` returns True."""
        while True:
            now_s = self._clock.now_s()
            state = self.show(screen, now_s)
            if over(state):
                return
            self._clock.sleep_until(now_s + ROUND_S)

    def show(self, screen: Screen, now_s: float) -> PlaybackState:
        """Send the changes since the last call; return the player's state."""
        with self._lock:
            state = self._player.state(now_s)
        self._show_frames(screen, self._frames.at(state.at_s))
        number = self._frames.frame_at(state.at_s)
        if (
            number is not None
            and number != self._frame
            and screen.send(FRAME + self._frames.frame(number))
        ):
            self._frame = number
        if self._due(state, now_s):
            more = {} if self._introduced else introduction(self._frames)
            message = REPLAY + json.dumps({**state._asdict(), **more}).encode()
            if screen.send(message):
                self._sent, self._sent_s, self._introduced = state, now_s, True
        return state

    def _show_frames(self, screen: Screen, number: int) -> None:
        """Send the frames up to this one; after a jump only this one."""
        passed = number - self._number
        if passed == 0:
            self._repeat_frame(screen)
        elif 0 < passed <= 4 * _MOST_FRAMES:
            step = max(1, -(-passed // _MOST_FRAMES))
            for between in range(self._number + 1, number, step):
                screen.send(self._frames.message(between))
            if screen.send(self._frames.message(number)):
                self._number, self._still, self._missing = number, 0, None
        elif screen.send(self._frames.message_without_history(number)):
            # After a backward jump the page starts again without its history.
            first = self._number + 1 if passed > 0 else 0
            self._missing = first if self._missing is None else min(first, self._missing)
            self._number, self._still = number, 0

    def _repeat_frame(self, screen: Screen) -> None:
        """Send the same frame again for some rounds, because a page draws its panels in turns.

        When the slider is at rest, also send the frames that a jump has skipped, so that traces
        and figures show the time before the position.
        """
        self._still += 1
        if self._still > _DRAWN_ROUNDS:
            return
        if self._missing is None or self._still < _REST_ROUNDS:
            screen.send(self._frames.message_without_history(self._number))
        elif screen.send(self._frames.message_with_history(self._missing, self._number)):
            self._missing = None

    def _due(self, state: PlaybackState, now_s: float) -> bool:
        """Return whether to send the state: changes immediately, otherwise at intervals."""
        sent = self._sent
        if sent is None or state._replace(at_s=sent.at_s) != sent:
            return True
        leapt = state.at_s != sent.at_s and not state.playing
        return leapt or now_s - self._sent_s >= (_SLIDE_S if state.playing else _BEAT_S)

    def send_introduction_again(self) -> None:
        """Send the introduction again, to a new page process."""
        self._introduced = False


def introduction(frames: SnapshotIndex) -> dict[str, object]:
    """Return the data that a page needs once: marks, events, whether there are pictures."""
    events = [m for m in frames.marks if m.kind == "event"]
    return {
        "marks": {
            kind: count_marks([m for m in frames.marks if m.kind == kind], frames.duration_s)
            for kind in MARK_KINDS
        },
        "events": [(round(m.at_s, 3), m.words[:_MOST_WORDS]) for m in events[:_MOST_EVENTS]],
        "pictures": frames.has_pictures,
    }


def count_marks(marks: Sequence[Mark], duration_s: float) -> list[int]:
    """Count the marks in equal parts of the recording."""
    found = [0] * _MARKS
    for mark in marks:
        share = mark.at_s / duration_s if duration_s > 0.0 else 0.0
        found[min(int(share * _MARKS), _MARKS - 1)] += 1
    return found
