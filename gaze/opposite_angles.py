"""Eyes by the rules of Nakamoto & Tsuruno 3.3 and 3.4: shifts, and opposite angles between them.

An eye turns in a shift alone. While it stands, a turn of the head by (x, y, z) turns it by
(-x, -y, -z), the paper's vestibulo-ocular reflex. An eye that would have to turn beyond its
largest angle, 20 deg, is not turned at all; the reflex goes on meanwhile, so that it does not freeze.

Opposite angles are the inverse of a turn about one axis only. What they leave of a turn about two,
0.7 deg after 20 deg of yaw and 10 of pitch, is closed by the next shift.
"""

from gazerig.gaze.types import Angles2, Angles3

Eyes = tuple[Angles2, Angles2]
"""(yaw, pitch) of left and right eye in the head, rad."""


class OppositeAngles:
    """Angles of both eyes, tick by tick."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget where eyes and head were."""
        self._eyes: Eyes | None = None
        self._head_rad: Angles3 = (0.0, 0.0, 0.0)

    def step(self, wanted: Eyes, shifting: bool, within: bool, head_rad: Angles3) -> Eyes:
        """Return the angles of left and right eye for this tick.

        Args:
            wanted: angles that bring both eyes onto the gaze point of a shift.
            shifting: whether a shift is under way.
            within: whether those angles are within the eyes' range.
            head_rad: (yaw, pitch, roll) of the head now.
        """
        before, self._head_rad = self._head_rad, head_rad
        if self._eyes is None:
            self._eyes = wanted if within else ((0.0, 0.0), (0.0, 0.0))
        elif shifting and within:
            self._eyes = wanted
        else:
            left, right = self._eyes
            self._eyes = negated(left, before, head_rad), negated(right, before, head_rad)
        return self._eyes


def negated(eye_rad: Angles2, head_before_rad: Angles3, head_rad: Angles3) -> Angles2:
    """Return the eye angles of the rule (-x, -y, -z), literally."""
    return (
        eye_rad[0] - (head_rad[0] - head_before_rad[0]),
        eye_rad[1] - (head_rad[1] - head_before_rad[1]),
    )
