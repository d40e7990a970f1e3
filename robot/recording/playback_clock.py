"""Where a recording is being looked at: play, pause, speed, seek, step. Time is an argument.

``now_s`` is the watcher's clock, ``at_s`` seconds since the recording's first tick.
"""

from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from math import isfinite
from typing import NamedTuple

from gazerig.robot.dashboard.feed.page_process import MARK_KINDS, SPEEDS

_SAME_S = 1e-6


class Mark(NamedTuple):
    """Something to step to: kind is "saccade", "blink" or "event", words say what."""

    at_s: float
    kind: str
    words: str


STEPS = tuple(f"{way} {kind}" for kind in MARK_KINDS for way in ("previous", "next"))


class PlaybackState(NamedTuple):
    """Where a player stands.

    sought_s: the place that was last asked for, None before
    """

    at_s: float
    duration_s: float
    playing: bool
    speed: float
    sought_s: float | None


class PlaybackClock:
    """Plays one recording; begins at its beginning, standing still."""

    def __init__(self, duration_s: float, marks: Sequence[Mark] = ()) -> None:
        self._duration_s = duration_s
        self._marks = {kind: tuple(m.at_s for m in marks if m.kind == kind) for kind in MARK_KINDS}
        self._from_s, self._since_s = 0.0, 0.0
        self._playing, self._speed = False, 1.0
        self._sought_s: float | None = None

    def state(self, now_s: float) -> PlaybackState:
        """Return where it stands; at the end it stops."""
        at_s = self._from_s
        if self._playing:
            at_s += (now_s - self._since_s) * self._speed
            if at_s >= self._duration_s:
                self._stand(self._duration_s, now_s)
                self._playing, at_s = False, self._duration_s
        return PlaybackState(at_s, self._duration_s, self._playing, self._speed, self._sought_s)

    def play(self, now_s: float) -> None:
        """Go on; from the end it starts again."""
        at_s = self.state(now_s).at_s
        self._stand(0.0 if at_s >= self._duration_s - _SAME_S else at_s, now_s)
        self._playing = True

    def pause(self, now_s: float) -> None:
        """Stand still."""
        self._stand(self.state(now_s).at_s, now_s)
        self._playing = False

    def seek(self, at_s: float, now_s: float) -> None:
        """Go to a place, the nearer end where it is outside; playing goes on from there."""
        self.state(now_s)  # at the end it has stopped
        self._sought_s = at_s
        self._stand(min(max(at_s, 0.0), self._duration_s), now_s)

    def go_at(self, speed: float, now_s: float) -> None:
        """Play at another speed from now on.

        Raises:
            ValueError: it is outside of what there is.
        """
        if not SPEEDS[0] <= speed <= SPEEDS[-1]:
            raise ValueError(f"speed {speed:g} is not between {SPEEDS[0]:g} and {SPEEDS[-1]:g}")
        self._stand(self.state(now_s).at_s, now_s)
        self._speed = speed

    def step(self, where: str, now_s: float) -> None:
        """Stand still at the next or previous saccade, blink or event.

        Raises:
            ValueError: there is none, or no such step; the message lists what there is.
        """
        if where not in STEPS:
            raise ValueError(f"no step {where!r}; there is {', '.join(STEPS)}")
        way, kind = where.split()
        at_s, times = self.state(now_s).at_s, self._marks[kind]
        if way == "next":
            i = bisect_right(times, at_s + _SAME_S)
        else:
            i = bisect_left(times, at_s - _SAME_S) - 1
        if not 0 <= i < len(times):
            raise ValueError(f"there is no {where}")
        self._stand(times[i], now_s)
        self._playing = False

    def obey(self, asked: object, now_s: float) -> None:
        """Do what the page asks for: play (true or false), seek_s, speed or step.

        Raises:
            ValueError: it cannot be done; the message says why.
        """
        match asked:
            case {"play": bool(play), **rest} if not rest:
                (self.play if play else self.pause)(now_s)
            case {"seek_s": int() | float() as at_s, **rest} if not rest and _real(at_s):
                self.seek(float(at_s), now_s)
            case {"speed": int() | float() as speed, **rest} if not rest and _real(speed):
                self.go_at(float(speed), now_s)
            case {"step": str(where), **rest} if not rest:
                self.step(where, now_s)
            case _:
                raise ValueError(
                    f"{asked!r:.80} cannot be meant: a replay takes one of play (true or false), "
                    "seek_s (seconds), speed and step"
                )

    def _stand(self, at_s: float, now_s: float) -> None:
        """Count from this place and this time on."""
        self._from_s, self._since_s = at_s, now_s


def _real(value: float) -> bool:
    return not isinstance(value, bool) and isfinite(value)
