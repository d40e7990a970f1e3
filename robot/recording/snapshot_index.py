"""Compressed snapshots of a recording for the page, indexed by time.

About 50 snapshots per second are stored, each as the compressed message to the page. The
camera's frames are in a temporary file without a name.
"""

import tempfile
import zlib
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable
from dataclasses import replace

from gazerig.drivers.errors import SetupError
from gazerig.robot.control.event_text import group_events
from gazerig.robot.control.tick import Tick
from gazerig.robot.control.tick_text import guard_text, perception_text
from gazerig.robot.dashboard.feed.page_process import pack, unpack
from gazerig.robot.dashboard.feed.snapshot import ShownRig, SnapshotBuilder, SnapshotTexts
from gazerig.robot.model.commands import REPEATED, Ask
from gazerig.robot.model.types import SeenEvent, Trail
from gazerig.robot.perception.egomotion_residual import ResidualFigures
from gazerig.robot.recording.gaze_angles import command_text
from gazerig.robot.recording.playback_clock import Mark

SNAPSHOT_EVERY_S = 0.02
_NO_RESIDUAL = ResidualFigures(None, None, 0)
RECALL_S = 10.0
"""Time before a position for which joints are sent again: the newest part closely, the rest
thinned."""

_CLOSELY_S, _THINNED = 1.5, 2
_MOST_EVENTS = 1000  # with the joints about 150 kB: they fit in one message
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
            if (shown := snapshots.take(said)) is not None:
                self._events += shown.events
                self._events_at.extend([len(self._packed)] * len(shown.events))
                self._times.append(at_s)
                self._packed.append(zlib.compress(pack(shown), 1))
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
        """Return a snapshot's message without its trail and events, which are shown only once."""
        return pack(replace(unpack(self.message(number)), trail=(), events=()))

    def message_with_history(self, first: int, number: int) -> bytes:
        """Return a snapshot's message with the joints and events since snapshot ``first``."""
        from_s = self._times[number] - RECALL_S
        closely = self.at(self._times[number] - _CLOSELY_S)
        trail: list[Trail] = []
        for past in range(max(first, self.at(from_s)), number + 1):
            if past >= closely:
                trail += unpack(self.message(past)).trail
            elif past % _THINNED == 0:
                trail += unpack(self.message(past)).trail[-1:]
        since, until = (bisect_left(self._events_at, n) for n in (first, number + 1))
        events = self._events[max(since, until - _MOST_EVENTS) : until]
        shown = replace(unpack(self.message(number)), trail=tuple(trail), events=tuple(events))
        return pack(shown)

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
        behaviour, conversation: Those of the newest command.
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
