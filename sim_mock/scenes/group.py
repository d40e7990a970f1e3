"""A group of people in front of the robot: their positions, gaze targets and waves.

People who look at a person turn the head about two thirds of the angle and the eyes the rest, so
that the robot still sees a face that is turned to a neighbour. They face the robot fully.
"""

from collections.abc import Sequence
from math import atan2, hypot, pi, radians, sin
from typing import NamedTuple

from gazerig.gaze.angles import add, sub, wrap
from gazerig.gaze.types import Angles2, Vec3
from gazerig.sim_mock.scenes.scene import Key, ScenePerson, between, min_jerk

HEAD_M: Vec3 = (0.04, 0.0, 0.13)
ROBOT = -1

_HEAD_SHARE = 0.65
_FARTHEST_RAD = radians(48.0)
_TURN_S = 0.6
_RAISE_S = 0.4
_WAVES_HZ, _WAVE_M = 1.5, 0.11


class Look(NamedTuple):
    """From ``t_s`` on a member looks at person ``at``, or at the ``ROBOT``."""

    t_s: float
    at: int


class Wave(NamedTuple):
    """A member waves a hand at the robot between two times."""

    start_s: float
    end_s: float


class Member(NamedTuple):
    """One person of a group.

    keys: positions of the face, the turns of the keys being unused; looks: gaze targets; both from
        0 on, and equal at the start and the end of the round
    side: of the raised hand, 1 to the robot's left
    sway: phase of the small motion of a standing person, rad
    """

    keys: tuple[Key, ...]
    looks: tuple[Look, ...]
    waves: tuple[Wave, ...] = ()
    side: float = 1.0
    sway: float = 0.0


def people_of(members: Sequence[Member], t_s: float, round_s: float) -> tuple[ScenePerson, ...]:
    """Return all people of a group at a time."""
    phase_s = t_s % round_s
    places = [_place(member, t_s, phase_s) for member in members]
    found = []
    for member, place in zip(members, places, strict=True):
        way = _face_direction(member.looks, phase_s, place, places)
        found.append(ScenePerson(place, way, _hand(member, phase_s, place)))
    return tuple(found)


def _place(member: Member, t_s: float, phase_s: float) -> Vec3:
    """Return the position of a face that sways slightly."""
    face, _ = between(member.keys, phase_s)
    sway = (
        0.005 * sin(2 * pi * 0.21 * t_s + member.sway),
        0.009 * sin(2 * pi * 0.17 * t_s + 2.0 * member.sway),
        0.003 * sin(2 * pi * 0.29 * t_s + member.sway),
    )
    return add(face, sway)


def _face_direction(
    looks: tuple[Look, ...], phase_s: float, place: Vec3, places: Sequence[Vec3]
) -> Angles2:
    """Return yaw and pitch of a face that turns from one target to the next."""
    last = before = looks[0]
    for look in looks[1:]:
        if look.t_s > phase_s:
            break
        before, last = last, look
    new = _facing(last.at, place, places)
    if last is looks[0]:
        return new
    old = _facing(before.at, place, places)
    share = min_jerk(min(1.0, (phase_s - last.t_s) / _TURN_S))
    return old[0] + share * wrap(new[0] - old[0]), old[1] + share * (new[1] - old[1])


def _facing(at: int, place: Vec3, places: Sequence[Vec3]) -> Angles2:
    """Return yaw and pitch of a face that looks at a person or the robot."""
    yaw, pitch = _direction(sub(HEAD_M, place))
    if at == ROBOT:
        return yaw, pitch
    other_yaw, other_pitch = _direction(sub(places[at], place))
    turn = _HEAD_SHARE * wrap(other_yaw - yaw)
    turn = min(_FARTHEST_RAD, max(-_FARTHEST_RAD, turn))
    return yaw + turn, pitch + _HEAD_SHARE * (other_pitch - pitch)


def _direction(way: Vec3) -> Angles2:
    return atan2(way[1], way[0]), atan2(way[2], hypot(way[0], way[1]))


def _hand(member: Member, phase_s: float, face: Vec3) -> Vec3 | None:
    """Return the hand that waves next to the head, None while it is not raised."""
    for wave in member.waves:
        since_s, left_s = phase_s - wave.start_s, wave.end_s - phase_s
        if since_s >= 0.0 and left_s >= 0.0:
            up = min_jerk(min(1.0, since_s / _RAISE_S, left_s / _RAISE_S))
            swing = _WAVE_M * sin(2 * pi * _WAVES_HZ * since_s) * up
            beside = (-0.12, member.side * 0.25 + swing, -0.30 + 0.28 * up)
            return add(face, beside)
    return None
