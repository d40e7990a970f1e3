"""What keys, sticks and buttons mean to a head that is steered by hand. Pure.

A stick that is held leads; at rest it lets go. Keys of a terminal are only ever pressed, so they
let go when none has come for a while.
"""

from dataclasses import dataclass
from math import hypot, radians

from gazerig.gaze.angles import Angles2

GESTURES = ("nod", "shake", "wink", "surprised", "sleepy")
"""What the buttons play, in the order of the page's."""

STOP = "stop"
"""What a button does that is no gesture: torque off."""

KEYS_LET_GO_S = 1.0
"""Without a key for so long the gaze is free again."""
_KEY_DEG = 4.0
_DEAD = 0.15
"""A stick that is let go rests within this of its middle."""
_WIDEST_DEG = (50.0, 30.0)


@dataclass(frozen=True)
class Stick:
    """Where a stick is: x -1..1 to the right, y -1..1 up."""

    x: float = 0.0
    y: float = 0.0


class Steering:
    """Where a person wants the head to look; None while nothing is held.

    Args:
        behind: the person stands behind the head, whose right is then theirs; in front of it, as
            on the page, what they push to their right the head sees on its left.
    """

    def __init__(self, behind: bool = False) -> None:
        self._sign = -1.0 if behind else 1.0
        self._stick = Stick()
        self._keys_deg = (0.0, 0.0)
        self._key_s: float | None = None

    def stick(self, at: Stick) -> None:
        """Move the stick."""
        self._stick = at

    def key(self, right: int, up: int, now_s: float) -> None:
        """Press an arrow key: -1, 0 or 1 each way."""
        yaw, pitch = self._keys_deg if self._held(now_s) else (0.0, 0.0)
        wide, high = _WIDEST_DEG
        self._keys_deg = (
            max(-wide, min(wide, yaw + _KEY_DEG * right)),
            max(-high, min(high, pitch + _KEY_DEG * up)),
        )
        self._key_s = now_s

    def direction_rad(self, now_s: float) -> Angles2 | None:
        """Return (yaw, pitch) to look in, yaw + left, pitch + up; None: the gaze is free."""
        held = hypot(self._stick.x, self._stick.y)
        if held > _DEAD:
            share = min(1.0, (held - _DEAD) / (1.0 - _DEAD)) / held
            aside, up = (share * self._stick.x, share * self._stick.y)
            degrees = aside * _WIDEST_DEG[0], up * _WIDEST_DEG[1]
        elif self._held(now_s):
            degrees = self._keys_deg
        else:
            return None
        return radians(self._sign * degrees[0]), radians(degrees[1])

    def _held(self, now_s: float) -> bool:
        return self._key_s is not None and now_s - self._key_s < KEYS_LET_GO_S
