"""The scene ``three-people``: two people before the robot, a third arrives; they talk in turns.

A speaker looks at the robot or at one of the others, a listener mostly at the speaker. The last
to arrive waves, the person in the middle comes near, and the third leaves before the round ends.
"""

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.group import ROBOT, Look, Member, Wave, people_of
from gazerig.sim_mock.scenes.scene import Event, Key, ScenePerson, Thing

ARRIVES_S, LEAVES_S = 6.0, 55.0
"""Arrival and departure of the third person."""

_ROUND_S = 64.0
_LEFT: Vec3 = (1.20, 0.42, 0.24)
_MIDDLE: Vec3 = (1.50, 0.02, 0.32)
_RIGHT: Vec3 = (1.15, -0.42, 0.18)
_NEAR: Vec3 = (0.80, -0.02, 0.24)
_OUTSIDE: Vec3 = (-1.20, -2.60, 0.30)
_LEFT_ONE = Member(
    (Key(0.0, _LEFT), Key(_ROUND_S, _LEFT)),
    (
        Look(0.0, ROBOT), Look(3.0, 1), Look(7.0, 2), Look(9.5, ROBOT), Look(14.0, 1),
        Look(18.0, ROBOT), Look(20.5, 2), Look(27.0, 1), Look(31.0, ROBOT), Look(36.0, 2),
        Look(40.0, ROBOT), Look(46.0, 1), Look(50.0, ROBOT), Look(58.0, 1), Look(61.0, ROBOT),
    ),
    side=1.0,
    sway=0.3,
)  # fmt: skip
_MIDDLE_ONE = Member(
    (
        Key(0.0, _MIDDLE), Key(29.0, _MIDDLE), Key(31.5, _NEAR), Key(36.0, _NEAR),
        Key(39.0, _MIDDLE), Key(_ROUND_S, _MIDDLE),
    ),
    (
        Look(0.0, ROBOT), Look(3.5, 0), Look(6.5, 2), Look(10.5, ROBOT), Look(12.0, 0),
        Look(16.0, ROBOT), Look(21.0, 2), Look(26.0, ROBOT), Look(38.5, 0), Look(43.0, ROBOT),
        Look(47.0, 2), Look(52.0, ROBOT), Look(57.0, 0), Look(62.0, ROBOT),
    ),
    side=1.0,
    sway=1.5,
)  # fmt: skip
_RIGHT_ONE = Member(
    (
        Key(0.0, _OUTSIDE), Key(2.5, _OUTSIDE), Key(ARRIVES_S, _RIGHT), Key(LEAVES_S, _RIGHT),
        Key(59.0, _OUTSIDE), Key(_ROUND_S, _OUTSIDE),
    ),
    (
        Look(0.0, ROBOT), Look(7.5, 0), Look(11.0, ROBOT), Look(14.5, 1), Look(17.0, ROBOT),
        Look(28.0, 1), Look(33.0, ROBOT), Look(37.0, 0), Look(41.0, ROBOT), Look(48.0, 1),
        Look(52.5, ROBOT),
    ),
    (Wave(21.5, 25.5),),
    side=1.0,
    sway=2.6,
)  # fmt: skip


class ThreePeople:
    """The scene ``three-people``."""

    name = "three-people"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the people from the robot's left to its right; the third may be outside."""
        return people_of((_LEFT_ONE, _MIDDLE_ONE, _RIGHT_ONE), t_s, _ROUND_S)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return nothing: the hands belong to the people."""
        return ()

    def events(self) -> tuple[Event, ...]:
        """Expect the gaze on each face, on the waving hand and on the person who comes near."""
        stands_s = (ARRIVES_S, LEAVES_S)
        return (
            Event("left", "look", "face", *stands_s, _LEFT, 0.2),
            Event("middle", "look", "face", *stands_s, _MIDDLE, 0.2),
            Event("right", "look", "face", *stands_s, _RIGHT, 0.2),
            Event("wave", "look", "hand", 21.5, 25.5, _RIGHT, 0.6),
            Event("near", "look", "face", 31.0, 36.0, _NEAR, 0.3),
        )
