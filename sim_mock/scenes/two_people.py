"""The scene ``two-people``: two people before the robot who talk in turns, to it and to each other.

A pinwheel is in front of them; twice in a round the wind turns it. The person on the robot's right
waves, the one on its left comes near and goes back.
"""

from math import pi, sin

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.group import ROBOT, Look, Member, Wave, people_of
from gazerig.sim_mock.scenes.scene import Event, Key, ScenePerson, Thing

PINWHEEL: Vec3 = (0.75, 0.0, 0.06)
SPINS_S = ((4.0, 7.0), (34.0, 37.0))
"""Times in which the wind turns the pinwheel."""

_ROUND_S = 48.0
_PINWHEEL_M = 0.06
_SPIN_RAD_S = 11.0
_LEFT: Vec3 = (1.20, 0.33, 0.20)
_RIGHT: Vec3 = (1.25, -0.35, 0.26)
_NEAR: Vec3 = (0.72, 0.18, 0.20)
_LEFT_ONE = Member(
    (
        Key(0.0, _LEFT), Key(26.0, _LEFT), Key(28.0, _NEAR), Key(32.5, _NEAR), Key(35.0, _LEFT),
        Key(_ROUND_S, _LEFT),
    ),
    (
        Look(0.0, ROBOT), Look(8.0, 1), Look(11.5, ROBOT), Look(14.0, 1), Look(18.2, ROBOT),
        Look(20.0, 1), Look(23.0, ROBOT), Look(33.0, 1), Look(39.0, ROBOT), Look(41.5, 1),
        Look(45.0, ROBOT),
    ),
    side=1.0,
    sway=0.4,
)  # fmt: skip
_RIGHT_ONE = Member(
    (Key(0.0, _RIGHT), Key(_ROUND_S, _RIGHT)),
    (
        Look(0.0, ROBOT), Look(9.0, 0), Look(14.4, ROBOT), Look(23.4, 0), Look(27.0, ROBOT),
        Look(29.5, 0), Look(38.0, ROBOT), Look(40.5, 0), Look(44.0, ROBOT),
    ),
    (Wave(16.0, 19.5),),
    side=1.0,
    sway=1.9,
)  # fmt: skip


class TwoPeople:
    """The scene ``two-people``."""

    name = "two-people"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ()

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the person on the robot's left, then the person on its right."""
        return people_of((_LEFT_ONE, _RIGHT_ONE), t_s, _ROUND_S)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the pinwheel."""
        phase_s = t_s % _ROUND_S
        speed, turned = 0.0, 0.0
        for start_s, end_s in SPINS_S:
            lasts_s = end_s - start_s
            share = min(1.0, max(0.0, (phase_s - start_s) / lasts_s))
            # A gust: the speed is a sine squared in time, the angle its integral.
            speed += _SPIN_RAD_S * sin(pi * share) ** 2
            turned += _SPIN_RAD_S * lasts_s * (0.5 * share - sin(2 * pi * share) / (4 * pi))
        return (Thing(0, "pinwheel", PINWHEEL, _PINWHEEL_M, speed, turned),)

    def events(self) -> tuple[Event, ...]:
        """Expect the gaze on the turning pinwheel, on the waving hand, and otherwise on a face."""
        face = (1.0, 0.0, 0.2)
        return (
            Event("spin", "look", "pinwheel", *SPINS_S[0], PINWHEEL, 0.2),
            Event("face", "look", "face", 8.0, 16.0, face, 0.8),
            Event("wave", "look", "hand", 16.0, 19.5, _RIGHT, 0.6),
            Event("near", "look", "face", 27.0, 33.0, _NEAR, 0.3),
            Event("spin", "look", "pinwheel", *SPINS_S[1], PINWHEEL, 0.2),
            Event("face", "look", "face", 38.0, 46.0, face, 0.8),
        )
