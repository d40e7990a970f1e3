"""A scene: one thing after the other at angles to both sides, at the height of the eyes."""

from collections.abc import Sequence
from math import cos, radians, sin

from fakes.scenes import EmptyScene

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Thing

EYES_M: Vec3 = (0.04, 0.0, 0.13)


def at_yaw(yaw_deg: float) -> Vec3:
    """Return a place 1.5 m from the eyes."""
    x, y, z = EYES_M
    return (x + 1.5 * cos(radians(yaw_deg)), y + 1.5 * sin(radians(yaw_deg)), z)


class Lights(EmptyScene):
    """Things that are there for equal times, one after the other."""

    def __init__(self, name: str, yaws_deg: Sequence[float], each_s: float) -> None:
        self.name, self.round_s = name, each_s * len(yaws_deg)
        self._yaws_deg, self._each_s = yaws_deg, each_s

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the lit one."""
        number = int(t_s / self._each_s)
        yaw_deg = self._yaws_deg[number % len(self._yaws_deg)]
        return (Thing(number, "light", at_yaw(yaw_deg), 0.05),)
