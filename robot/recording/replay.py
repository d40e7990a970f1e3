"""Replay of a recording on the page: snapshots, frames and a slider at the player's position."""

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

from gazerig.robot.dashboard.feed.page_process import FRAME, MARK_KINDS, REPLAY
from gazerig.robot.model.clock import Clock
from gazerig.robot.recording.playback_clock import Mark, PlaybackClock, PlaybackState
from gazerig.robot.recording.snapshot_index import SnapshotIndex

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
            return "this is a recording: nothing moves here"
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
        """Send the same frame again for some rounds, as a page draws its panels alternately.

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
        """Return whether to send the state: changes immediately, else at intervals."""
        sent = self._sent
        if sent is None or state._replace(at_s=sent.at_s) != sent:
            return True
        leapt = state.at_s != sent.at_s and not state.playing
        return leapt or now_s - self._sent_s >= (_SLIDE_S if state.playing else _BEAT_S)

    def send_introduction_again(self) -> None:
        """Send the introduction again, to a new page process."""
        self._introduced = False


def introduction(frames: SnapshotIndex) -> dict[str, object]:
    """Return what a page needs once per recording: marks, events, whether it has pictures."""
    events = [m for m in frames.marks if m.kind == "event"]
    return {
        "marks": {
            kind: counts([m for m in frames.marks if m.kind == kind], frames.duration_s)
            for kind in MARK_KINDS
        },
        "events": [(round(m.at_s, 3), m.words[:_MOST_WORDS]) for m in events[:_MOST_EVENTS]],
        "pictures": frames.has_pictures,
    }


def counts(marks: Sequence[Mark], duration_s: float) -> list[int]:
    """Count the marks in equal parts of the recording."""
    found = [0] * _MARKS
    for mark in marks:
        share = mark.at_s / duration_s if duration_s > 0.0 else 0.0
        found[min(int(share * _MARKS), _MARKS - 1)] += 1
    return found
