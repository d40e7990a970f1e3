"""A script without a room as a scene: faces and hands that move smoothly through the air.

People who look at a person turn the head about two thirds of the angle and the eyes the rest, so
that the robot still sees a face that is turned to a neighbour. They face the robot fully. Gloved
fists are on guard close in front of the chin, where a step aside moves their image hardly more than
the face's; a punch ends a forearm's length in front of the robot's head, which is assumed to be at
``HEAD_M`` and to look straight ahead along the world's x.
"""

from collections.abc import Iterator, Sequence
from math import atan2, dist, hypot, pi, radians, sin
from typing import NamedTuple

from gazerig.gaze.angles import add, sub, wrap
from gazerig.gaze.types import Angles2, Vec3
from gazerig.sim_mock.scenes.scene import Event, ScenePerson, Thing, min_jerk, there_and_back
from gazerig.sim_mock.scenes.script import BASE, HEAD, Act, Fault, SceneScript, ThingScript
from gazerig.sim_mock.scenes.timeline import (
    HALF_FIELD_RAD,
    LASTS_S,
    WALKS_TO_PLACES,
    TimedAct,
    events_of,
    name_faults,
    timed_acts,
)

HEAD_M: Vec3 = (0.04, 0.0, 0.13)
"""Gaze target of people who look at the robot."""

_SIDES = {"left": -1.0, "right": 1.0}
"""The sign of the world's y of a hand of a person who faces the robot."""
_SPEEDS_UP_S = 0.25  # time of a walk's acceleration to full speed, and of braking
_HEAD_SHARE = 0.65
_FARTHEST_RAD = radians(48.0)
_TURN_S = 0.6
_WAVES_HZ, _BECKONS_HZ = 1.5, 2.0
_FIST_M, _PINWHEEL_M = 0.06, 0.06
_SPIN_RAD_S = 11.0
_STEP_S = 1e-4
_PUNCH_TURN_RAD = 0.5 * pi  # the back of the hand turns up
_OUT_BACK_S = {
    "punch": (0.25, 0.30),
    "open_guard": (0.4, 0.3),
    "wave": (0.4, 0.4),
    "feint": (0.15, 0.15),
    "reach": (0.7, 0.5),
}
"""Times that the hand of an act needs to its target, and back."""
_FREES_M = {"face": (0.05, 0.04, -0.32), "chest": (0.0, 0.10, 0.15)}
"""Displacement of both fists in an open guard; y is to the fist's own side."""
_PERSON_ACTS = ("walk", "step", "look_at", "glance", "speak", "wave")
_ACTS: dict[str, tuple[str, ...]] = {
    "person": _PERSON_ACTS,
    "boxer": (*_PERSON_ACTS, "punch", "feint", "open_guard"),
    "pinwheel": ("spin",),
    "hand": ("reach",),
}
"""What people and things can do without a room."""


class _Change(NamedTuple):
    """A smooth change of a value; at ``steady_s``: with constant speed between accelerations."""

    start_s: float
    end_s: float
    goal: tuple[float, ...]
    is_at_constant_speed: bool = False


class FacesScene:
    """The people and things of a script without a room."""

    def __init__(self, name: str, script: SceneScript, seed: int = 0) -> None:
        self.name, self.round_s, self.agent = name, script.round_s, script.agent
        boxes = any(person.gloves for person in script.people.values())
        self.behaviours: tuple[str, ...] = ("wait", "guard", "attack") if boxes else ()
        self._script = script
        self._acts = {name: _acts_of(script, name, seed) for name in script.people}
        self._acts |= {name: _acts_of_thing(one) for name, one in script.things.items()}
        self._steps = {name: self._changes(name, ("walk", "step")) for name in script.people}
        self._glances = {name: self._changes(name, ("glance",)) for name in script.people}

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return all people in the script's order, who may be outside every field of view."""
        faces = {name: self.face(name, t_s) for name in self._script.people}
        phase_s = t_s % self.round_s
        return tuple(
            ScenePerson(
                face,
                self._direction(name, phase_s, faces),
                self._raised_hand(name, t_s),
                self._speaks(name, phase_s),
            )
            for name, face in faces.items()
        )

    def things(self, t_s: float) -> tuple[Thing, ...]:
        """Return the fists, then the script's things; a hand is included while it reaches."""
        phase_s = t_s % self.round_s
        found: list[Thing] = []
        for number, (name, person) in enumerate(self._script.people.items()):
            for side in _SIDES if person.gloves else ():
                fist, turn = self.hand(name, side, t_s), self._fist_turn(name, side, phase_s)
                found.append(Thing(len(found), "hand", fist, _FIST_M, *turn, person=number))
        for id_, (name, thing) in enumerate(self._script.things.items(), len(found)):
            acts = self._acts[name]
            if thing.kind == "pinwheel":
                turn = _spin_of(acts, phase_s)
                found.append(Thing(id_, thing.kind, self.place(thing.at), _PINWHEEL_M, *turn))
            elif any(one.start_s <= phase_s < one.end_s for one in acts):
                found.append(Thing(id_, "hand", self.hand(name, thing.side, t_s), _FIST_M))
        return tuple(found)

    def events(self) -> tuple[Event, ...]:
        """Return the events of a round and the expected response of a person's gaze."""
        return events_of(self._script, self._acts, self)

    def place(self, name: str) -> Vec3:
        """Return a place of the script."""
        return _place(self._script, name)

    def face(self, name: str, t_s: float) -> Vec3:
        """Return a face, which may sway."""
        x, y, z = self._position_without_sway(name, t_s % self.round_s)
        sway = self._script.people[name].sway
        if sway is None:
            return x, y, z
        dx, dy, dz = (
            m * sin(2 * pi * hz * t_s + rad)
            for m, hz, rad in zip(sway.m, sway.hz, sway.rad, strict=True)
        )
        return x + dx, y + dy, z + dz

    def hand(self, name: str, side: str, t_s: float) -> Vec3:
        """Return a fist, a hand that waves, or one that reaches in from the side and beckons."""
        phase_s = t_s % self.round_s
        person = self._script.people.get(name)
        if person is not None and person.gloves:
            return self._fist(name, side, phase_s, self.face(name, t_s))
        if person is not None:
            return self._raised_hand(name, t_s) or self.face(name, t_s)
        here = self.place(self._script.things[name].at)
        for one in self._acts[name]:
            into = there_and_back(phase_s - one.start_s, *_out_hold_back_s(one))
            beckon = 0.03 * sin(2 * pi * _BECKONS_HZ * (phase_s - one.start_s)) * into
            if one.start_s <= phase_s < one.end_s:
                at = self.place(one.act.via[0]) if one.act.via else here
                return _towards(at, add(self.place(one.act.to), (0.0, 0.0, beckon)), into)
        return here

    def reach_times_s(self, one: TimedAct) -> tuple[float, float]:
        """Return the times that a hand needs to its target, and back."""
        return _OUT_BACK_S[one.act.do]

    def is_before_head(self, p_m: Vec3) -> bool:
        """Return whether a point is in the field of view of a camera that points ahead."""
        return abs(atan2(p_m[1] - HEAD_M[1], p_m[0] - HEAD_M[0])) < HALF_FIELD_RAD

    def _changes(self, name: str, kinds: tuple[str, ...]) -> list[_Change]:
        """Return the moves of a face, or its glances in degrees."""
        return [
            _Change(
                one.start_s,
                one.end_s,
                (one.act.yaw_deg, one.act.pitch_deg)
                if one.act.do == "glance"
                else self.place(one.act.to),
                one.act.do == "walk",
            )
            for one in self._acts[name]
            if one.act.do in kinds
        ]

    def _position_without_sway(self, name: str, phase_s: float) -> Vec3:
        """Return the place of a face without sway."""
        x, y, z = _position_after_moves(
            self.place(self._script.people[name].start), self._steps[name], phase_s
        )
        return x, y, z

    def _direction(self, name: str, phase_s: float, faces: dict[str, Vec3]) -> Angles2:
        """Return yaw and pitch of a face that turns from one target to the next, and glances."""
        last_s, last, before = 0.0, self._script.people[name].looks_at, ""
        for one in self._acts[name]:
            if one.act.do == "look_at" and one.start_s <= phase_s:
                last_s, last, before = one.start_s, one.act.to, last
        yaw, pitch = self._facing(name, last, phase_s, faces)
        if before and phase_s < last_s + _TURN_S:
            old_yaw, old_pitch = self._facing(name, before, phase_s, faces)
            share = min_jerk((phase_s - last_s) / _TURN_S)
            yaw = old_yaw + share * wrap(yaw - old_yaw)
            pitch = old_pitch + share * (pitch - old_pitch)
        turn, nod = _position_after_moves((0.0, 0.0), self._glances[name], phase_s)
        return yaw + radians(turn), radians(nod) + pitch

    def _facing(self, name: str, at: str, phase_s: float, faces: dict[str, Vec3]) -> Angles2:
        """Return yaw and pitch of a face that looks at the robot, a person or a place."""
        yaw, pitch = _yaw_pitch(sub(HEAD_M, faces[name]))
        if at == BASE:
            x, y, _ = self._position_without_sway(name, phase_s)
            yaw = atan2(-y, -x)
        elif at != HEAD:
            target = faces[at] if at in faces else self.place(at)
            other_yaw, other_pitch = _yaw_pitch(sub(target, faces[name]))
            turn = _HEAD_SHARE * wrap(other_yaw - yaw)
            yaw += min(_FARTHEST_RAD, max(-_FARTHEST_RAD, turn))
            pitch += _HEAD_SHARE * (other_pitch - pitch)
        return yaw, 0.0 if self._script.people[name].level else pitch

    def _raised_hand(self, name: str, t_s: float) -> Vec3 | None:
        """Return the hand that waves next to the head, None while it is not raised."""
        person, phase_s = self._script.people[name], t_s % self.round_s
        wave = person.wave
        for one in self._acts[name]:
            if one.act.do == "wave" and one.start_s <= phase_s <= one.end_s and not person.gloves:
                since_s = phase_s - one.start_s
                up = min(1.0, min(since_s, one.end_s - phase_s) / wave.raise_s)
                up = min_jerk(up) if wave.smooth else up
                swing = wave.swing_m * sin(2 * pi * _WAVES_HZ * since_s) * up
                aside = _SIDES[one.act.side] * wave.aside_m + swing
                return add(self.face(name, t_s), (-0.12, aside, -0.30 + 0.28 * up))
        return None

    def _speaks(self, name: str, phase_s: float) -> bool:
        return any(
            one.act.do == "speak" and one.start_s <= phase_s < one.end_s for one in self._acts[name]
        )

    def _fist(self, name: str, own: str, phase_s: float, face: Vec3) -> Vec3:
        """Return a fist: on guard in front of the chin, punching, waving, feinting or lowered."""
        side = _SIDES[own]
        place = add(face, (-0.12, side * 0.12, -0.13))
        for one in self._acts[name]:
            do, since_s = one.act.do, phase_s - one.start_s
            if do not in _OUT_BACK_S or (do != "open_guard" and one.act.side != own):
                continue
            out = there_and_back(since_s, *_out_hold_back_s(one))
            if do == "punch":
                place = _towards(place, add(HEAD_M, (0.35, side * 0.03, -0.02)), out)
            elif do == "open_guard":
                x, y, z = _FREES_M[one.act.frees]
                place = add(place, (x * out, side * y * out, z * out))
            elif do == "wave":
                swing = 0.12 * sin(2 * pi * _WAVES_HZ * since_s) * out
                place = add(place, (-0.10 * out, swing + side * 0.06 * out, 0.15 * out))
            else:
                place = add(place, (-0.05 * out, side * 0.15 * out, 0.05 * out))
        return place

    def _fist_turn(self, name: str, own: str, phase_s: float) -> tuple[float, float]:
        """Return speed and angle of a fist's rotation about the line of sight."""
        punches = [one for one in self._acts[name] if one.act.do == "punch" and one.act.side == own]

        def turned_rad(at_s: float) -> float:
            out = [there_and_back(at_s - one.start_s, *_out_hold_back_s(one)) for one in punches]
            return _SIDES[own] * _PUNCH_TURN_RAD * sum(out)

        spin = (turned_rad(phase_s + _STEP_S) - turned_rad(phase_s - _STEP_S)) / (2.0 * _STEP_S)
        return spin, turned_rad(phase_s)


def _place(script: SceneScript, name: str) -> Vec3:
    one = script.places[name]
    return one.x_m, one.y_m, one.height_m - script.neck_height_m


def _acts_of(script: SceneScript, name: str, seed: int) -> tuple[TimedAct, ...]:
    def lasts_s(act: Act, at: str) -> float:
        if act.for_s is None and act.do == "walk":
            way_m = dist(_place(script, at), _place(script, act.to))
            return way_m / act.speed_m_s + _SPEEDS_UP_S
        return LASTS_S[act.do] if act.for_s is None else act.for_s

    return timed_acts(script, name, seed, lasts_s, lambda act: None)


def _acts_of_thing(thing: ThingScript) -> tuple[TimedAct, ...]:
    return tuple(
        TimedAct(act, act.at_s, act.at_s + (act.for_s or LASTS_S[act.do])) for act in thing.acts
    )


def _spin_of(acts: Sequence[TimedAct], phase_s: float) -> tuple[float, float]:
    """Return speed and angle of a pinwheel in gusts."""
    speed, turned = 0.0, 0.0
    for one in acts:
        lasts_s = one.end_s - one.start_s
        share = min(1.0, max(0.0, (phase_s - one.start_s) / lasts_s))
        # The speed of a gust is a sine squared in time, the angle its integral.
        speed += _SPIN_RAD_S * sin(pi * share) ** 2
        turned += _SPIN_RAD_S * lasts_s * (0.5 * share - sin(2 * pi * share) / (4 * pi))
    return speed, turned


def _position_after_moves(
    at: tuple[float, ...], moves: Sequence[_Change], phase_s: float
) -> tuple[float, ...]:
    """Return a value that goes from goal to goal."""
    for one in moves:
        if phase_s < one.start_s:
            break
        if phase_s >= one.end_s:
            at = one.goal
            continue
        lasts_s, since_s = one.end_s - one.start_s, phase_s - one.start_s
        share = (
            _walk_share(since_s, lasts_s)
            if one.is_at_constant_speed
            else min_jerk(since_s / lasts_s)
        )
        at = tuple(a + share * (b - a) for a, b in zip(at, one.goal, strict=True))
    return at


def _walk_share(since_s: float, lasts_s: float) -> float:
    """Return the share of a path covered: constant speed between two short even accelerations."""
    soon_s = min(_SPEEDS_UP_S, 0.5 * lasts_s)
    speed = 1.0 / (lasts_s - soon_s)
    if since_s < soon_s:
        return 0.5 * speed * since_s**2 / soon_s
    if since_s > lasts_s - soon_s:
        return 1.0 - 0.5 * speed * (lasts_s - since_s) ** 2 / soon_s
    return speed * (since_s - 0.5 * soon_s)


def _out_hold_back_s(one: TimedAct) -> tuple[float, float, float]:
    out_s, back_s = _OUT_BACK_S[one.act.do]
    return out_s, one.end_s - one.start_s - out_s - back_s, back_s


def _towards(a: Vec3, b: Vec3, share: float) -> Vec3:
    x, y, z = (p + share * (q - p) for p, q in zip(a, b, strict=True))
    return x, y, z


def _yaw_pitch(way: Vec3) -> Angles2:
    return atan2(way[1], way[0]), atan2(way[2], hypot(way[0], way[1]))


def faults(script: SceneScript) -> Iterator[Fault]:
    """Yield the faults of a script that ``--scene`` cannot play, each with its key."""
    if script.room != "none":
        yield "room", "--scene cannot have any: use --world, or write room: none"
        return
    yield from name_faults(script, script.places, (HEAD, BASE))
    owners = [
        *((f"people.{name}", "boxer" if person.gloves else "person", person.acts)
          for name, person in script.people.items()),
        *((f"things.{name}", thing.kind, thing.acts) for name, thing in script.things.items()),
    ]  # fmt: skip
    for owner, kind, acts in owners:
        can = _ACTS.get(kind, ())
        for i, act in enumerate(acts):
            if act.do not in can or (act.do in WALKS_TO_PLACES and not act.to):
                yield f"{owner}.acts.{i}.do", f"without a room a {kind} can only {', '.join(can)}"
    for name, thing in script.things.items():
        reached = [place for act in thing.acts if act.do == "reach" for place in (*act.via, act.to)]
        for place in (thing.at, *reached):
            if place not in script.places:
                yield f"things.{name}", f"no place {place!r}; it has {', '.join(script.places)}"
