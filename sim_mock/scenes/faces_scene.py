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
from gazerig.sim_mock.scenes.script import (
    BASE,
    HEAD,
    Act,
    Fault,
    PersonScript,
    SceneScript,
    ThingScript,
)
from gazerig.sim_mock.scenes.timeline import (
    HALF_FIELD_RAD,
    LASTS_S,
    TimedAct,
    events_of,
    name_faults,
    overlap_faults,
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
_BOXER_ACTS = (*_PERSON_ACTS, "punch", "feint", "open_guard")
_THING_ACTS = {"pinwheel": ("spin",), "hand": ("reach",)}


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
        self._steps = {
            name: [
                _Change(one.start_s, one.end_s, self.place(one.act.to), one.act.do == "walk")
                for one in self._acts[name]
                if one.act.do in ("walk", "step")
            ]
            for name in script.people
        }
        self._glances = {
            name: [
                _Change(one.start_s, one.end_s, (one.act.yaw_deg, one.act.pitch_deg))
                for one in self._acts[name]
                if one.act.do == "glance"
            ]
            for name in script.people
        }

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
        found = [
            Thing(
                2 * n + k, "hand", self.hand(name, side, t_s), _FIST_M,
                *self._fist_turn(name, side, phase_s), person=number,
            )
            for n, (number, name) in enumerate(self._iterate_boxers())
            for k, side in enumerate(_SIDES)
        ]  # fmt: skip
        first = 2 * len(list(self._iterate_boxers()))
        for number, (name, thing) in enumerate(self._script.things.items(), first):
            acts = self._acts[name]
            if thing.kind == "hand":
                if any(one.start_s <= phase_s < one.end_s for one in acts):
                    found.append(Thing(number, "hand", self.hand(name, thing.side, t_s), _FIST_M))
                continue
            speed, turned = 0.0, 0.0
            for one in acts:
                lasts_s = one.end_s - one.start_s
                share = min(1.0, max(0.0, (phase_s - one.start_s) / lasts_s))
                # A gust: the speed is a sine squared in time, the angle its integral.
                speed += _SPIN_RAD_S * sin(pi * share) ** 2
                turned += _SPIN_RAD_S * lasts_s * (0.5 * share - sin(2 * pi * share) / (4 * pi))
            found.append(
                Thing(number, thing.kind, self.place(thing.at), _PINWHEEL_M, speed, turned)
            )
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

    def _iterate_boxers(self) -> Iterator[tuple[int, str]]:
        for number, (name, person) in enumerate(self._script.people.items()):
            if person.gloves:
                yield number, name

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
        if before:
            old_yaw, old_pitch = self._facing(name, before, phase_s, faces)
            share = min_jerk(min(1.0, (phase_s - last_s) / _TURN_S))
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
            since_s, left_s = phase_s - one.start_s, one.end_s - phase_s
            if one.act.do == "wave" and not person.gloves and since_s >= 0.0 and left_s >= 0.0:
                up = min(1.0, since_s / wave.raise_s, left_s / wave.raise_s)
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
    found = list(name_faults(script, script.places, (HEAD, BASE)))
    for name, thing in script.things.items():
        found += _thing_faults(script, name, thing)
    for name, person in script.people.items():
        found += _person_faults(script, name, person)
    yield from found
    if found:
        return
    for name, person in script.people.items():
        acts = _acts_of(script, name, 0)
        yield from overlap_faults(script, f"people.{name}", acts)
        at, looks_at, glance = person.start, person.looks_at, (0.0, 0.0)
        for act in person.acts:
            at = act.to if act.do in ("walk", "step") else at
            looks_at = act.to if act.do == "look_at" else looks_at
            glance = (act.yaw_deg, act.pitch_deg) if act.do == "glance" else glance
        if (at, looks_at, glance) != (person.start, person.looks_at, (0.0, 0.0)):
            yield (
                f"people.{name}.acts",
                f"the round ends at {at}, looking at {looks_at}, with a glance of {glance} deg; "
                f"it must end as it began: at {person.start}, looking at {person.looks_at}",
            )
    for name, thing in script.things.items():
        yield from overlap_faults(script, f"things.{name}", _acts_of_thing(thing))


def _person_faults(script: SceneScript, name: str, person: PersonScript) -> Iterator[Fault]:
    known = _BOXER_ACTS if person.gloves else _PERSON_ACTS
    before_s = 0.0
    for i, act in enumerate(person.acts):
        key = f"people.{name}.acts.{i}"
        if act.do not in known:
            yield f"{key}.do", f"without a room a person can only {', '.join(known)}"
        elif act.do in ("walk", "step") and act.to not in script.places:
            yield f"{key}.to", f"unknown place; known places: {', '.join(script.places)}"
        elif act.do == "punch" and act.to != HEAD:
            yield f"{key}.to", "without a room a punch goes to head"
        elif (
            act.do in _OUT_BACK_S and act.for_s is not None and act.for_s < sum(_OUT_BACK_S[act.do])
        ):
            yield f"{key}.for_s", f"{act.do} takes at least {sum(_OUT_BACK_S[act.do]):g} s"
        if act.at_s < before_s:
            yield f"{key}.at_s", "acts are in the order of time"
        before_s = act.at_s


def _thing_faults(script: SceneScript, name: str, thing: ThingScript) -> Iterator[Fault]:
    key = f"things.{name}"
    if thing.kind not in _THING_ACTS:
        yield f"{key}.kind", f"without a room there are {', '.join(_THING_ACTS)}"
        return
    if thing.at not in script.places:
        yield f"{key}.at", f"no place {thing.at!r}; there are {', '.join(script.places)}"
    for i, act in enumerate(thing.acts):
        if act.do not in _THING_ACTS[thing.kind]:
            yield (
                f"{key}.acts.{i}.do",
                f"a {thing.kind} can only {', '.join(_THING_ACTS[thing.kind])}",
            )
        for place in (*act.via, *([act.to] if act.do == "reach" else ())):
            if place not in script.places:
                yield f"{key}.acts.{i}", f"no place {place!r}; there are {', '.join(script.places)}"
