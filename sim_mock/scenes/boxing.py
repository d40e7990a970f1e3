"""The scene ``boxing``: an opponent before the robot, for the five gazes of Mitake et al. 1.

(a) the opponent punches and the robot guards: the hand is looked at; (b) the robot attacks:
before the blow lands, the place to be hit is looked at; (c) otherwise the opponent's face,
also while the opponent steps left and right (section 4); (d) a hand is waved: the hand;
(e) a hand reaches in from outside the field of view: it is noticed as it enters, and the
head turns. Besides, two feints that draw the gaze off the face for an instant (section 4:
boxers return to the face at once).

The planner that chooses attack, guard and wait belongs to the scene, as the paper's
belongs to the boxing game. It guards when a punch has been on its way for a reaction
time, and its guard target is the fist that comes: so the first look at the fist is owed
to the fist's motion alone, as the paper's list of bottom-up gazes has it (3.1), and the
rule only keeps it there.

The robot's eyes are taken to be at ``HEAD_M`` and to look straight ahead along the
world's x; both hold for the desk rig within what the neck turns to follow the opponent.
"""

from math import atan2, pi, sin, tan
from typing import NamedTuple

from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes.scene import Event, Key, ScenePerson, Thing, between, there_and_back

HEAD_M: Vec3 = (0.04, 0.0, 0.13)
HALF_FIELD_RAD = 34.5 / 180.0 * pi
"""Half of the horizontal field of the camera: a hand farther aside cannot be noticed."""

_ROUND_S = 44.0
_CORNER: Vec3 = (1.0, 0.0, 0.24)
_LEFT, _RIGHT = 1.0, -1.0  # as the robot sees it: the sign of the world's y

# Steps to the left, to the right and back, as slow as a boxer who seeks an opening.
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

# A planner's target is there, for a camera that sees it late, before its behaviour is.
_AIM_S = 0.1

# Fists close before the chin, where stepping aside moves their image hardly more than the
# face's; a punch stops a forearm's length before the robot.
_FIST_M = 0.06
_PUNCH_OUT_S, _PUNCH_HOLD_S, _PUNCH_BACK_S = 0.25, 0.05, 0.30
_PUNCH_ENDS_M = 0.35
_REACTION_S = 0.3
_GUARD_S = 0.3

_ATTACK_S = 0.6
_WAVE_S = 2.2
_FEINT_S = 0.3
_RETURN_S = 1.3
_REACH_IN_S, _REACH_STAY_S, _REACH_OUT_S = 0.7, 1.6, 0.5
_REACH_S = _REACH_IN_S + _REACH_STAY_S + _REACH_OUT_S


class _ArmMotion(NamedTuple):
    """Something that begins at ``start_s`` on one side."""

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
# Blows at the chest and at the side of the face, as offsets from the opponent's face.
_ATTACKS: tuple[tuple[float, Vec3], ...] = (
    (6.2, (-0.10, 0.0, -0.30)),
    (19.4, (-0.03, 0.09, -0.02)),
    (29.6, (-0.10, 0.0, -0.30)),
)


class Boxing:
    """The scene ``boxing``."""

    name = "boxing"
    round_s = _ROUND_S
    behaviours: tuple[str, ...] = ("wait", "guard", "attack")

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the opponent, whose hands are things of their own."""
        face, turn = _opponent(t_s)
        return (ScenePerson(face, turn, None),)

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return both fists, and the hand from aside and the planner's targets while they last."""
        phase_s = t_s % _ROUND_S
        face, _ = _opponent(t_s)
        fists = (_fist(_RIGHT, face, phase_s), _fist(_LEFT, face, phase_s))
        things = [Thing(i, "hand", fist, _FIST_M, person=0) for i, fist in enumerate(fists)]
        for reach in _REACHES:
            if reach.start_s <= phase_s < reach.start_s + _REACH_S:
                things.append(Thing(2, "hand", _reaching(reach, phase_s), _FIST_M))
        for start_s, offset in _ATTACKS:
            if start_s - _AIM_S <= phase_s < start_s + _ATTACK_S:
                things.append(Thing(3, "attack_target", _plus(face, offset), 0.05))
        for punch in _PUNCHES:
            if _guards(punch, phase_s) or _guards(punch, phase_s + _AIM_S):
                fist = fists[0 if punch.side == _RIGHT else 1]
                things.append(Thing(4, "guard_target", fist, _FIST_M))
        return tuple(things)

    def behaviour(self, t_s: float) -> str | None:
        """Return what the robot's planner has chosen: attack, guard or wait."""
        phase_s = t_s % _ROUND_S
        if any(start_s <= phase_s < start_s + _ATTACK_S for start_s, _ in _ATTACKS):
            return "attack"
        if any(_guards(punch, phase_s) for punch in _PUNCHES):
            return "guard"
        return "wait"

    def events(self) -> tuple[Event, ...]:
        """Return the five behaviours, the steps and the feints; the rest is for the face."""
        chin = _plus(_CORNER, (-0.3, 0.0, -0.1))
        events = [
            *(_punch_event(punch) for punch in _PUNCHES),
            *(
                Event("attack", "look", "attack_target", s, s + _ATTACK_S, _CORNER, 0.6)
                for s, _ in _ATTACKS
            ),
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
        return tuple(sorted((*events, *_quiet(events)), key=lambda event: event.start_s))


def _opponent(t_s: float) -> tuple[Vec3, tuple[float, float]]:
    """Return the opponent's face, which bobs a little, and where it points."""
    face, turn = between(_KEYS, t_s % _ROUND_S)
    bob = (0.008 * sin(2 * pi * 0.5 * t_s), 0.008 * sin(2 * pi * 0.75 * t_s + 1.0))
    return (face[0] + bob[0], face[1] + bob[1], face[2]), turn


def _fist(side: float, face: Vec3, phase_s: float) -> Vec3:
    """Return one fist: on guard before the chin, in a punch, waving or feinting."""
    place = _plus(face, (-0.12, side * 0.12, -0.13))
    for punch in _PUNCHES:
        if punch.side == side:
            out = there_and_back(
                phase_s - punch.start_s, _PUNCH_OUT_S, _PUNCH_HOLD_S, _PUNCH_BACK_S
            )
            place = _towards(place, _punch_end(side), out)
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
    """Return where a punch ends: before the robot's face, a little to its side."""
    return _plus(HEAD_M, (_PUNCH_ENDS_M, side * 0.03, -0.02))


def _guards(punch: _ArmMotion, phase_s: float) -> bool:
    begin_s = punch.start_s + _REACTION_S
    return begin_s <= phase_s < begin_s + _GUARD_S


def _reaching(reach: _ArmMotion, phase_s: float) -> Vec3:
    """Return the hand that comes in from aside, beckons and goes."""
    since_s = phase_s - reach.start_s
    into = there_and_back(since_s, _REACH_IN_S, _REACH_STAY_S, _REACH_OUT_S)
    beckon = 0.03 * sin(2 * pi * 2.0 * since_s) * into
    return _towards(
        _plus(HEAD_M, (0.46, reach.side * 0.95, -0.05)),
        _plus(HEAD_M, (0.46, reach.side * 0.20, -0.03 + beckon)),
        into,
    )


def _punch_event(punch: _ArmMotion) -> Event:
    """Ask for the hand from the punch's beginning until it is back."""
    end_s = punch.start_s + _PUNCH_OUT_S + _PUNCH_HOLD_S + _PUNCH_BACK_S
    middle = _towards(_plus(_CORNER, (0.0, 0.0, -0.1)), _punch_end(punch.side), 0.5)
    return Event("punch", "look", "hand", punch.start_s, end_s, middle, 0.5)


def _reach_event(reach: _ArmMotion) -> Event:
    """Ask for the hand while it is nearer to straight ahead than half the field."""
    inside = [
        ms / 1e3
        for ms in range(round(_REACH_S * 1e3))
        if abs(_aside_rad(_reaching(reach, reach.start_s + ms / 1e3))) < HALF_FIELD_RAD
    ]
    start_s, end_s = reach.start_s + inside[0], reach.start_s + inside[-1]
    place = _plus(HEAD_M, (0.46, reach.side * 0.46 * tan(HALF_FIELD_RAD), 0.0))
    return Event("reach", "look", "hand", start_s, end_s, place, 0.25)


def _aside_rad(p_world_m: Vec3) -> float:
    """Return how far to the side of straight ahead a place is, from the robot's eyes."""
    return atan2(p_world_m[1] - HEAD_M[1], p_world_m[0] - HEAD_M[0])


def _quiet(events: list[Event]) -> list[Event]:
    """Ask for the face wherever nothing else happens for a while."""
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
