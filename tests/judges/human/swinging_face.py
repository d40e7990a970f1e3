"""A scene: a face 1 m away that swings from side to side, seen from the robot's head."""

from math import atan2, cos, hypot, pi, radians, sin

from fakes.scenes import EmptyScene

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import ScenePerson

HEAD_M: Vec3 = (0.04, 0.0, 0.13)
_UP_M = 0.11


class SwingingFace(EmptyScene):
    """The face goes round the head, as a sine of the time; it looks at the head."""

    round_s = 3600.0

    def __init__(self, hz: float, deg: float = 5.0) -> None:
        self.name = f"a face swings by {deg} deg at {hz} Hz"
        self.hz, self._rad = hz, radians(deg)

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the one person."""
        yaw = self._rad * sin(2.0 * pi * self.hz * t_s)
        x, y, z = HEAD_M
        face = x + cos(yaw), y + sin(yaw), z + _UP_M
        ahead, aside, up = (a - b for a, b in zip(HEAD_M, face, strict=True))
        return (ScenePerson(face, (atan2(aside, ahead), atan2(up, hypot(ahead, aside))), None),)
