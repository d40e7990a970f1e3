"""Playback position of a recording: play, pause, speed, seek, step.

``now_s`` is the viewer's clock and always an argument; ``at_s`` are seconds since the
recording's first tick.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from math import isfinite
from typing import NamedTuple

from gazerig.robot.dashboard.feed.page_process import MARK_KINDS, SPEEDS

_SAME_S = 1e-6


class Mark(NamedTuple):
    """A position to step to: kind is "saccade", "blink" or "event", words describe it."""

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
            raise ValueError(f"no step {where!r}; choose from {', '.join(STEPS)}")
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
            case {"seek_s": int() | float() as at_s, **rest} if not rest and _real(at_s):
                self.seek(float(at_s), now_s)
            case {"speed": int() | float() as speed, **rest} if not rest and _real(speed):
                self.set_speed(float(speed), now_s)
            case {"step": str(where), **rest} if not rest:
                self.step(where, now_s)
            case _:
                raise ValueError(
                    f"{request!r:.80} is invalid: a replay takes one of play (true or false), "
                    "seek_s (seconds), speed and step"
                )

    def _set_position(self, at_s: float, now_s: float) -> None:
        """Set the position at a time."""
        self._from_s, self._since_s = at_s, now_s


def _real(value: float) -> bool:
    return not isinstance(value, bool) and isfinite(value)
