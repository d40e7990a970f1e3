"""The scene ``walks-past``: a person walks by, 1.5 m in front of the robot, at 1 m/s, and back.

The face is always turned to the robot, as of a person who looks while passing.
"""

from math import atan2

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Event, ScenePerson, Thing

WALK_M_S, FAR_M = 1.0, 1.5
HALF_WAY_M = 1.1

_UP_M = 0.42
_HEAD_AHEAD_M = 0.04
_TURN_S = 1.0  # standing time at each end
_SOON_S = 0.25  # time of acceleration to full speed, and of braking
_WAY_S = 2.0 * HALF_WAY_M / WALK_M_S + _SOON_S
_ROUND_S = 2.0 * (_WAY_S + _TURN_S)


def _along(phase_s: float) -> float:
    """Return the share of a path covered: constant speed between two short even accelerations."""
    speed = 1.0 / (_WAY_S - _SOON_S)
    if phase_s <= 0.0:
        return 0.0
    if phase_s >= _WAY_S:
        return 1.0
    if phase_s < _SOON_S:
        return 0.5 * speed * phase_s**2 / _SOON_S
    if phase_s > _WAY_S - _SOON_S:
        return 1.0 - 0.5 * speed * (_WAY_S - phase_s) ** 2 / _SOON_S
    return speed * (phase_s - 0.5 * _SOON_S)


class WalksPast:
    """The scene ``walks-past``."""

    name = "walks-past"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the one person, who stands, walks to the left, stands and walks back."""
        phase = t_s % _ROUND_S
        there = _along(phase - _TURN_S) - _along(phase - 2.0 * _TURN_S - _WAY_S)
        x, y = _HEAD_AHEAD_M + FAR_M, HALF_WAY_M * (2.0 * there - 1.0)
        return (ScenePerson((x, y, _UP_M), (atan2(-y, -x), 0.0), None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return nothing."""
        return ()

    def events(self) -> tuple[Event, ...]:
        """Expect the gaze on the face while it passes in front of the robot."""
        middle: Vec3 = (_HEAD_AHEAD_M + FAR_M, 0.0, _UP_M)
        first = _TURN_S + 0.5 * _WAY_S
        second = first + _WAY_S + _TURN_S
        return (
            Event("left", "look", "face", first - 0.3, first + 0.3, middle, 0.4),
            Event("right", "look", "face", second - 0.3, second + 0.3, middle, 0.4),
        )
