"""The scene ``sits-still``: a person who sits in front of the robot, faces it and does not move.

For all experiments that a person does with the robot rather than in front of it. No real person
sits as still: no sway, no glance aside, no blink.
"""

from math import atan2, hypot

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Event, ScenePerson, Thing

HEAD_M: Vec3 = (0.04, 0.0, 0.13)
FACE_M: Vec3 = (0.95, 0.06, 0.24)

_ROUND_S = 10.0


class SitsStill:
    """The scene ``sits-still``."""

    name = "sits-still"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the one person."""
        x, y, z = (a - b for a, b in zip(HEAD_M, FACE_M, strict=True))
        return (ScenePerson(FACE_M, (atan2(y, x), atan2(z, hypot(x, y))), None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return nothing."""
        return ()

    def events(self) -> tuple[Event, ...]:
        """Expect the gaze on the face, all the time."""
        return (Event("face", "look", "face", 0.0, _ROUND_S, FACE_M, 0.3),)
