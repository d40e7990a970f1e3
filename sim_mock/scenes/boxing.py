"""The scene ``boxing``: an opponent in front of the robot, for the five gazes of Mitake et al. 1.

(a) The opponent punches and the robot guards: the gaze is on the hand. (b) The opponent opens the
guard, which the robot attacks: before the blow arrives, the gaze is on its target. (c) Otherwise
the gaze is on the opponent's face, also while the opponent steps left and right (section 4). (d)
The opponent waves a hand: the gaze is on the hand. (e) A hand reaches in from outside the field
of view: it is detected as it enters, and the head turns. In addition, two feints draw the gaze
off the face for an instant (section 4: boxers return to the face immediately).

The robot's action planner (gazerig.gaze.attention.action_planner) decides how it reacts, from
the camera's view.

The robot's eyes are assumed to be at ``HEAD_M`` and to look straight ahead along the world's x;
both hold for the desk rig within the neck's turns after the opponent.
"""

from math import atan2, pi, sin, tan
from typing import NamedTuple

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Event, Key, ScenePerson, Thing, between, there_and_back

HEAD_M: Vec3 = (0.04, 0.0, 0.13)
HALF_FIELD_RAD = 34.5 / 180.0 * pi
"""Half of the camera's horizontal field: a hand farther to the side cannot be detected."""

_ROUND_S = 44.0
_CORNER: Vec3 = (1.0, 0.0, 0.24)
_LEFT, _RIGHT = 1.0, -1.0  # as seen by the robot: the sign of the world's y

# Steps to the left, to the right and back, as slow as a boxer who looks for an opening.
_STEPS_S = ((7.8, 9.6), (10.1, 13.4), (13.9, 15.7))
_KEYS = (
    Key(0.0, _CORNER),
    Key(_STEPS_S[0][0], _CORNER),
    Key(_STEPS_S[0][1], (1.0, 0.22, 0.24)),
    Key(_STEPS_S[1][0], (1.0, 0.22, 0.24)),
    Key(_STEPS_S[1][1], (1.0, -0.22, 0.24)),
    Key(_STEPS_S[2][0], (1.0, -0.22, 0.24)),
    Key(_STEPS_S[2][1], _CORNER),
    Key(_ROUND_S, _CORNER),
)

# Fists close in front of the chin, where a step aside moves their image hardly more than the
# face's; a punch stops a forearm's length in front of the robot.
_FIST_M = 0.06
_PUNCH_OUT_S, _PUNCH_HOLD_S, _PUNCH_BACK_S = 0.25, 0.05, 0.30
_PUNCH_ENDS_M = 0.35
_STEP_S = 1e-4
_PUNCH_TURN_RAD = 0.5 * pi  # the back of the hand turns up
_WAVE_S = 2.2
_FEINT_S = 0.3
_RETURN_S = 1.3
_REACH_IN_S, _REACH_STAY_S, _REACH_OUT_S = 0.7, 1.6, 0.5
_REACH_S = _REACH_IN_S + _REACH_STAY_S + _REACH_OUT_S


class _ArmMotion(NamedTuple):
    """A motion that begins at ``start_s`` on one side."""

    start_s: float
    side: float


_PUNCHES = (
    _ArmMotion(2.0, _RIGHT),
    _ArmMotion(4.2, _LEFT),
    _ArmMotion(20.9, _RIGHT),
    _ArmMotion(40.0, _LEFT),
)
_WAVES = (_ArmMotion(16.5, _RIGHT), _ArmMotion(31.2, _LEFT))
_FEINTS = (_ArmMotion(27.6, _RIGHT), _ArmMotion(41.8, _LEFT))
_REACHES = (_ArmMotion(22.9, _LEFT), _ArmMotion(35.4, _RIGHT))


class _Opening(NamedTuple):
    """Both fists leave their position by ``way_m``; y is mirrored for the left one."""

    start_s: float
    way_m: Vec3


# Dropped fists leave the face open, raised and parted fists the chest.
_DROPPED, _PARTED = (0.05, 0.04, -0.32), (0.0, 0.10, 0.15)
_OPENINGS = (
    _Opening(6.1, _PARTED),
    _Opening(19.2, _DROPPED),
    _Opening(29.3, _PARTED),
)
_OPEN_OUT_S, _OPEN_HOLD_S, _OPEN_BACK_S = 0.4, 0.7, 0.3
_OPEN_S = _OPEN_OUT_S + _OPEN_HOLD_S + _OPEN_BACK_S


class Boxing:
    """The scene ``boxing``."""

    name = "boxing"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ("wait", "guard", "attack")

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the opponent, whose hands are separate things."""
        face, turn = _opponent(t_s)
        return (ScenePerson(face, turn, None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return both fists, and the hand from the side while it is present."""
        phase_s = t_s % _ROUND_S
        face, _ = _opponent(t_s)
        things = [
            Thing(i, "hand", _fist(side, face, phase_s), _FIST_M, *_turn(side, phase_s), person=0)
            for i, side in enumerate((_RIGHT, _LEFT))
        ]
        for reach in _REACHES:
            if reach.start_s <= phase_s < reach.start_s + _REACH_S:
                things.append(Thing(2, "hand", _reaching_hand(reach, phase_s), _FIST_M))
        return tuple(things)

    def events(self) -> tuple[Event, ...]:
        """Return the five behaviours, the steps and the feints; otherwise the face is expected."""
        chin = _plus(_CORNER, (-0.3, 0.0, -0.1))
        events = [
            *(_punch_event(punch) for punch in _PUNCHES),
            *(_opening_event(opening) for opening in _OPENINGS),
            *(
                Event("wave", "look", "hand", wave.start_s, wave.start_s + _WAVE_S, chin, 0.5)
                for wave in _WAVES
            ),
            *(_reach_event(reach) for reach in _REACHES),
            *(Event("step", "look", "face", a, b, _CORNER, 0.6) for a, b in _STEPS_S),
            *(
                Event("return", "return", "face", f.start_s, f.start_s + _RETURN_S, _CORNER, 0.6)
                for f in _FEINTS
            ),
        ]
        return tuple(sorted((*events, *_add_face_events(events)), key=lambda event: event.start_s))


def _opponent(t_s: float) -> tuple[Vec3, tuple[float, float]]:
    """Return the opponent's face, which bobs slightly, and its direction."""
    face, turn = between(_KEYS, t_s % _ROUND_S)
    bob = (0.008 * sin(2 * pi * 0.5 * t_s), 0.008 * sin(2 * pi * 0.75 * t_s + 1.0))
    return (face[0] + bob[0], face[1] + bob[1], face[2]), turn


def _fist(side: float, face: Vec3, phase_s: float) -> Vec3:
    """Return one fist: on guard in front of the chin, punching, waving or feinting."""
    place = _plus(face, (-0.12, side * 0.12, -0.13))
    for punch in _PUNCHES:
        if punch.side == side:
            out = there_and_back(
                phase_s - punch.start_s, _PUNCH_OUT_S, _PUNCH_HOLD_S, _PUNCH_BACK_S
            )
            place = _towards(place, _punch_end(side), out)
    for opening in _OPENINGS:
        x, y, z = opening.way_m
        since_s = phase_s - opening.start_s
        out = there_and_back(since_s, _OPEN_OUT_S, _OPEN_HOLD_S, _OPEN_BACK_S)
        place = _plus(place, (x * out, side * y * out, z * out))
    for wave in _WAVES:
        if wave.side == side:
            since_s = phase_s - wave.start_s
            up = there_and_back(since_s, 0.4, _WAVE_S - 0.8, 0.4)
            swing = 0.12 * sin(2 * pi * 1.5 * since_s) * up
            place = _plus(place, (-0.10 * up, swing + side * 0.06 * up, 0.15 * up))
    for feint in _FEINTS:
        if feint.side == side:
            aside = there_and_back(phase_s - feint.start_s, _FEINT_S / 2, 0.0, _FEINT_S / 2)
            place = _plus(place, (-0.05 * aside, side * 0.15 * aside, 0.05 * aside))
    return place


def _punch_end(side: float) -> Vec3:
    """Return the end of a punch: in front of the robot's face, slightly to its side."""
    return _plus(HEAD_M, (_PUNCH_ENDS_M, side * 0.03, -0.02))


def _turn(side: float, phase_s: float) -> tuple[float, float]:
    """Return speed and angle of a fist's rotation about the line of sight."""

    def turned_rad(at_s: float) -> float:
        out = [
            there_and_back(at_s - punch.start_s, _PUNCH_OUT_S, _PUNCH_HOLD_S, _PUNCH_BACK_S)
            for punch in _PUNCHES
            if punch.side == side
        ]
        return side * _PUNCH_TURN_RAD * sum(out)

    spin_rad_s = (turned_rad(phase_s + _STEP_S) - turned_rad(phase_s - _STEP_S)) / (2.0 * _STEP_S)
    return spin_rad_s, turned_rad(phase_s)


def _reaching_hand(reach: _ArmMotion, phase_s: float) -> Vec3:
    """Return the hand that reaches in from the side, beckons and retreats."""
    since_s = phase_s - reach.start_s
    into = there_and_back(since_s, _REACH_IN_S, _REACH_STAY_S, _REACH_OUT_S)
    beckon = 0.03 * sin(2 * pi * 2.0 * since_s) * into
    return _towards(
        _plus(HEAD_M, (0.46, reach.side * 0.95, -0.05)),
        _plus(HEAD_M, (0.46, reach.side * 0.20, -0.03 + beckon)),
        into,
    )


def _punch_event(punch: _ArmMotion) -> Event:
    """Expect the gaze on the hand from the start of the punch to its return."""
    end_s = punch.start_s + _PUNCH_OUT_S + _PUNCH_HOLD_S + _PUNCH_BACK_S
    middle = _towards(_plus(_CORNER, (0.0, 0.0, -0.1)), _punch_end(punch.side), 0.5)
    arrives_s = punch.start_s + _PUNCH_OUT_S
    return Event("punch", "look", "hand", punch.start_s, end_s, middle, 0.5, arrives_s)


def _opening_event(opening: _Opening) -> Event:
    """Expect the gaze on the target while the fists are more than half-way out."""
    start_s = opening.start_s + 0.5 * _OPEN_OUT_S
    end_s = opening.start_s + _OPEN_S - 0.5 * _OPEN_BACK_S
    return Event("attack", "look", "attack_target", start_s, end_s, _CORNER, 0.6)


def _reach_event(reach: _ArmMotion) -> Event:
    """Expect the gaze on the hand while it is nearer to straight ahead than half the field."""
    inside = [
        ms / 1e3
        for ms in range(round(_REACH_S * 1e3))
        if abs(_side_angle_rad(_reaching_hand(reach, reach.start_s + ms / 1e3))) < HALF_FIELD_RAD
    ]
    start_s, end_s = reach.start_s + inside[0], reach.start_s + inside[-1]
    place = _plus(HEAD_M, (0.46, reach.side * 0.46 * tan(HALF_FIELD_RAD), 0.0))
    return Event("reach", "look", "hand", start_s, end_s, place, 0.25)


def _side_angle_rad(p_world_m: Vec3) -> float:
    """Return the horizontal angle of a point off straight ahead, from the robot's eyes."""
    return atan2(p_world_m[1] - HEAD_M[1], p_world_m[0] - HEAD_M[0])


def _add_face_events(events: list[Event]) -> list[Event]:
    """Expect the gaze on the face whenever nothing else happens for a while."""
    quiet, free_s = [], 0.0
    busy = sorted((event.start_s, event.end_s) for event in events)
    for start_s, end_s in (*busy, (_ROUND_S, _ROUND_S)):
        if start_s - free_s >= 0.5:
            quiet.append(Event("face", "look", "face", free_s, start_s, _CORNER, 0.6))
        free_s = max(free_s, end_s)
    return quiet


def _plus(a: Vec3, b: Vec3) -> Vec3:
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def _towards(a: Vec3, b: Vec3, share: float) -> Vec3:
    return (
        a[0] + share * (b[0] - a[0]),
        a[1] + share * (b[1] - a[1]),
        a[2] + share * (b[2] - a[2]),
    )
