"""The scene ``steps-aside``: a person in front of the robot who steps 40 deg aside.

The case in which a head that turns to the person's previous position overshoots. One step to the
left and back in a round, each in 0.7 s: over 0.75 m that takes 0.9 g sideways, about the limit of
shoes on a floor. Peak speed 2.0 m/s, 105 deg/s as seen by the robot.
"""

from math import cos, radians, sin

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Event, Key, ScenePerson, Thing, between

HEAD_M: Vec3 = (0.04, 0.0, 0.13)
STEP_AT_S, STEP_BACK_AT_S, STEP_S = 2.0, 6.0, 0.7

_ROUND_S = 10.0
_FAR_M, _UP_M = 1.1, 0.26


def _at(yaw_deg: float) -> Vec3:
    yaw = radians(yaw_deg)
    return (HEAD_M[0] + _FAR_M * cos(yaw), HEAD_M[1] + _FAR_M * sin(yaw), _UP_M)


_RIGHT, _LEFT = _at(-15.0), _at(25.0)
_KEYS = (
    Key(0.0, _RIGHT),
    Key(STEP_AT_S, _RIGHT),
    Key(STEP_AT_S + STEP_S, _LEFT),
    Key(STEP_BACK_AT_S, _LEFT),
    Key(STEP_BACK_AT_S + STEP_S, _RIGHT),
    Key(_ROUND_S, _RIGHT),
)


class StepsAside:
    """The scene ``steps-aside``."""

    name = "steps-aside"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the one person."""
        face, turn = between(_KEYS, t_s % _ROUND_S)
        return (ScenePerson(face, turn, None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return nothing."""
        return ()

    def events(self) -> tuple[Event, ...]:
        """Expect the gaze on the face after its steps."""
        return (
            Event("left", "look", "face", STEP_AT_S + STEP_S, STEP_BACK_AT_S, _LEFT, 0.3),
            Event("right", "look", "face", STEP_BACK_AT_S + STEP_S, _ROUND_S, _RIGHT, 0.3),
        )
