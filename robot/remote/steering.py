"""Manual control of the head by keys; pure functions of time.

A terminal reports only key presses, so control ends some time after the last one.
"""

from math import radians

from gazerig.gaze.angles import Angles2

TRACKS = ("nod", "shake", "wink", "surprised", "sleepy")
"""Tracks of the keys 1 to 5, in the order of the page's buttons."""

STOP = "stop"
"""Action of the key that switches the torque off."""

KEYS_LET_GO_S = 1.0
"""Time after the last key at which the gaze models take over, s."""
_KEY_DEG = 4.0
_WIDEST_DEG = (50.0, 30.0)


class Steering:
    """Gaze direction that a person steers.

    Args:
        behind: Whether the person is behind the head, so that both have the same right. In front of
            it, as on the page, the person's right is the head's left.
    """

    def __init__(self, behind: bool = False) -> None:
        self._sign = -1.0 if behind else 1.0
        self._keys_deg = (0.0, 0.0)
        self._key_s: float | None = None

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
        if not self._is_key_held(now_s):
            return None
        right, up = self._keys_deg
        return radians(self._sign * right), radians(up)

    def _is_key_held(self, now_s: float) -> bool:
        return self._key_s is not None and now_s - self._key_s < KEYS_LET_GO_S
