"""A recording as the page shows it: snapshots made once, packed small, found by their time.

Some 50 snapshots a second are kept, each as the message that goes to the page, compressed;
the camera's frames lie in a file without a name that goes with the program.
"""

import tempfile
import zlib
from array import array
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable
from dataclasses import replace

from gazerig.drivers.errors import SetupError
from gazerig.robot.control.event_text import drawn_together
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
"""How far back the joints are recalled: the last seconds of it closely, the rest thinned."""

_CLOSELY_S, _THINNED = 1.5, 2
_MOST_EVENTS = 1000  # with the joints some 150 kB: they fit in one message
_GRAVE = ("hold", "torque_off")
_TELL_EVERY = 50


class SnapshotIndex:
    """The snapshots and images of one recording.

    duration_s: from the first tick to the last; marks: what can be stepped to
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
        """Read everything.

        rate_hz, character: of the run; rig: how it was built, where that is known
        progress: takes how many seconds are read

        Raises:
            SetupError: there is no tick.
        """
        self._times, self._packed = array("d"), list[bytes]()
        self.marks: list[Mark] = []
        self._events: list[SeenEvent] = []
        self._events_at = array("l")  # the number of the snapshot that brings each
        self._start_s, self.duration_s = 0.0, 0.0
        self._read_ticks(ticks, SnapshotBuilder(rate_hz, rig), character, progress)
        if not self._packed:
            raise SetupError("the recording holds no tick: there is nothing to show")
        self._frame_times, self._places = array("d"), array("Q", (0,))
        self._frames = tempfile.TemporaryFile()  # noqa: SIM115  # open as long as the frames are
        for t_s, jpeg in frames:
            self._frame_times.append(t_s - self._start_s)
            self._frames.write(jpeg)
            self._places.append(self._places[-1] + len(jpeg))

    def __len__(self) -> int:
        """Count the snapshots."""
        return len(self._packed)

    @property
    def packed_bytes(self) -> int:
        """Return how much memory the snapshots take."""
        return sum(map(len, self._packed))

    def at(self, at_s: float) -> int:
        """Return the number of the snapshot that shows a time: the last that is not later."""
        return max(bisect_right(self._times, at_s + 1e-9) - 1, 0)

    def message(self, number: int) -> bytes:
        """Return a snapshot as the message that goes to the page."""
        return zlib.decompress(self._packed[number])

    def bare(self, number: int) -> bytes:
        """Return a snapshot's message without what happened before it, which is shown but once."""
        return pack(replace(unpack(self.message(number)), trail=(), events=()))

    def recalled(self, first: int, number: int) -> bytes:
        """Return a snapshot's message with the joints and events of those from ``first`` on."""
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
        """Return the number of the frame in force at a time, None before the first."""
        number = bisect_right(self._frame_times, at_s + 1e-9) - 1
        return number if number >= 0 else None

    def frame(self, number: int) -> bytes:
        """Return a frame as JPEG."""
        self._frames.seek(self._places[number])
        return self._frames.read(self._places[number + 1] - self._places[number])

    def close(self) -> None:
        """Free the frames."""
        self._frames.close()

    def _read_ticks(
        self,
        ticks: Iterable[Tick],
        snapshots: SnapshotBuilder,
        character: str,
        progress: Callable[[float], None],
    ) -> None:
        noticing, due_s = Noticing(), 0.0
        for number, tick in enumerate(ticks):
            self._start_s = tick.t_s if number == 0 else self._start_s
            at_s = tick.t_s - self._start_s
            self.marks += noticing.update(tick, at_s)
            self.duration_s = at_s
            snapshots.update(tick)
            if at_s < due_s - 1e-9:
                continue
            due_s = max(due_s + SNAPSHOT_EVERY_S, at_s)
            perception = perception_text(tick, _NO_RESIDUAL)
            said = SnapshotTexts(
                "recorded", noticing.behaviour, perception, character, noticing.conversation
            )
            if (shown := snapshots.take(said)) is not None:
                self._events += shown.events
                self._events_at.extend([len(self._packed)] * len(shown.events))
                self._times.append(at_s)
                self._packed.append(zlib.compress(pack(shown), 1))
            if len(self._packed) % _TELL_EVERY == 0:
                progress(at_s)


class Noticing:
    """Notices what a person would step to, tick by tick.

    behaviour, conversation: those asked for last
    """

    def __init__(self) -> None:
        self.behaviour = self.conversation = ""
        self._saccades, self._blinks = 0, 0
        self._grave = ""

    def update(self, tick: Tick, at_s: float) -> list[Mark]:
        """Return what begins in this tick."""
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
            if isinstance(command, Ask):
                self._heed(command)
        found += [Mark(at_s, "event", text) for text in drawn_together(tick.events)]
        grave = tick.guard_result.level if tick.guard_result.level in _GRAVE else ""
        if grave and grave != self._grave:
            found.append(Mark(at_s, "event", f"guard: {guard_text(tick.guard_result)}"))
        self._grave = grave
        return found

    def _heed(self, command: Ask) -> None:
        if command.menu == "behaviour":
            self.behaviour = command.choice
        elif command.menu == "conversation":
            self.conversation = command.choice
