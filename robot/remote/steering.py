"""Manual control of the head by keys, sticks and buttons; pure functions of time.

A deflected stick controls the gaze. A terminal reports only key presses, so control by keys ends
some time after the last one.
"""

from dataclasses import dataclass
from math import hypot, radians

from gazerig.gaze.angles import Angles2

TRACKS = ("nod", "shake", "wink", "surprised", "sleepy")
"""Tracks of the buttons, in the order of the page's buttons."""

STOP = "stop"
"""Action of the button that switches the torque off."""

KEYS_LET_GO_S = 1.0
"""Time after the last key at which the gaze models take over, s."""
_KEY_DEG = 4.0
_DEAD = 0.15
"""Largest deflection of a stick at rest."""
_WIDEST_DEG = (50.0, 30.0)


@dataclass(frozen=True)
class Stick:
    """Position of a stick: x -1..1 to the right, y -1..1 up."""

    x: float = 0.0
    y: float = 0.0


class Steering:
    """Gaze direction that a person steers.

    Args:
        behind: Whether the person is behind the head, so that both have the same right. In front of
            it, as on the page, the person's right is the head's left.
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
        """Press an arrow key: -1, 0 or 1 on each axis."""
        yaw, pitch = self._keys_deg if self._is_key_held(now_s) else (0.0, 0.0)
        wide, high = _WIDEST_DEG
        self._keys_deg = (
            max(-wide, min(wide, yaw + _KEY_DEG * right)),
            max(-high, min(high, pitch + _KEY_DEG * up)),
        )
        self._key_s = now_s

    def direction_rad(self, now_s: float) -> Angles2 | None:
        """Return (yaw, pitch), rad, yaw + left, pitch + up; None if the gaze models decide."""
        held = hypot(self._stick.x, self._stick.y)
        if held > _DEAD:
            share = min(1.0, (held - _DEAD) / (1.0 - _DEAD)) / held
            aside, up = (share * self._stick.x, share * self._stick.y)
            degrees = aside * _WIDEST_DEG[0], up * _WIDEST_DEG[1]
        elif self._is_key_held(now_s):
            degrees = self._keys_deg
        else:
            return None
        return radians(self._sign * degrees[0]), radians(degrees[1])

    def _is_key_held(self, now_s: float) -> bool:
        return self._key_s is not None and now_s - self._key_s < KEYS_LET_GO_S
