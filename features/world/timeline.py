"""Acts of people in a room: durations from its paths, targets, and faults of the script."""

from collections.abc import Iterable, Iterator

from gazerig.features.world.object_handover import handover_faults
from gazerig.features.world.room import (
    places_for,
    places_of,
    standing_point,
    walk_s,
    way_points,
)
from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes import timeline
from gazerig.sim_mock.scenes.script import HEAD, Act, Fault, PersonScript, SceneScript
from gazerig.sim_mock.scenes.timeline import LASTS_S, TimedAct, name_faults

HEAD_M: Vec3 = (0.05, 0.0, 0.125)
"""Gaze target of people who look at the robot: between the eyes of a head on its neck base."""


def floor_m(script: SceneScript) -> float:
    """Return the height of the floor in the world, below zero."""
    return -script.neck_height_m


def place_m(script: SceneScript, name: str) -> Vec3:
    """Return the target of a look or a pointing gesture at a place."""
    place = places_of(script)[name]
    return (place.x_m, place.y_m, floor_m(script) + place.height_m)


def timed_acts(script: SceneScript, name: str, seed: int) -> tuple[TimedAct, ...]:
    """Return the acts of a person, in the script's order, with random times from the seed."""
    places = places_for(script, name)

    def lasts_s(act: Act, at: str) -> float:
        if act.for_s is not None:
            return act.for_s
        if act.do == "walk":
            here, via = places[at], [places[one] for one in act.via]
            points = way_points(here, places[act.to], via, standing_point(here))
            return walk_s(points, act.speed_m_s)
        return script.round_s - act.at_s if act.do == "guard" else LASTS_S[act.do]

    def target(act: Act) -> Vec3 | None:
        if act.to in ("", HEAD):
            return HEAD_M
        return None if act.to in script.people else place_m(script, act.to)

    return timeline.timed_acts(script, name, seed, lasts_s, target)


"""Smallest distance of two necks."""


def script_faults(script: SceneScript) -> Iterable[Fault]:
    """Yield the faults of a script, each with its key."""
    if script.room == "none":
        yield "room", "a world needs one: play the script with --scene, or name a room"
        return
    found = [*_space_faults(script), *name_faults(script, places_of(script))]
    yield from found
    if found:
        return
    timelines = {name: timed_acts(script, name, 0) for name in script.people}
    yield from handover_faults(script, timelines)
    for name, person in script.people.items():
        yield from _walk_paths(script, name, person)
    yield from _crowding_faults(script)


def _space_faults(script: SceneScript) -> Iterator[Fault]:
    """Find entries that only a script without a room may have, and things that no one holds."""
    people = ", ".join(script.people)
    for name, person in script.people.items():
        for i, act in enumerate(person.acts):
            if act.do in ("glance", "spin") or act.frees != "face":
                yield f"people.{name}.acts.{i}.do", f"{act.do} of this kind needs room: none"
        for key in ("level", "sway", "wave"):
            if getattr(person, key) != getattr(PersonScript(""), key):
                yield f"people.{name}.{key}", "needs room: none"
    for name, thing in script.things.items():
        if thing.held_by not in script.people:
            yield f"things.{name}.held_by", f"no person {thing.held_by!r}; there are {people}"
        if thing.at or thing.acts or thing.kind not in ("cup", "ball"):
            yield f"things.{name}", "at, acts, and kinds other than cup and ball need room: none"


def _walk_paths(script: SceneScript, name: str, person: PersonScript) -> Iterator[Fault]:
    """Find walks of a seated person, sitting without a seat, and rounds that end elsewhere."""
    places = places_of(script)
    at = person.start
    seated = places[at].seat_m is not None
    for i, act in enumerate(person.acts):
        key = f"people.{name}.acts.{i}.do"
        if act.do in ("walk", "step", "turn"):
            if seated:
                yield key, f"the person is seated on {at}; add `stand` before {act.do}"
            if act.do != "turn":
                at = act.to or "away"
            seated = False
        elif act.do == "sit":
            if seated:
                yield key, f"is already seated on {at}"
            elif at not in places or places[at].seat_m is None:
                yield key, f"there is no seat at {at}; walk to one before it"
            seated = True
        elif act.do == "stand":
            if not seated:
                yield key, "is already standing"
            seated = False
    if any(act.do in ("walk", "sit", "stand") for act in person.acts) and (
        at != person.start or seated != (places[at].seat_m is not None)
    ):
        yield (
            f"people.{name}.acts",
            f"ends the round {'on' if seated else 'at'} {at}, began it at {person.start}; "
            "let it end there",
        )


def _crowding_faults(script: SceneScript) -> Iterator[Fault]:
    """Find two people at one place at the same time."""
    stays: dict[str, list[tuple[float, float, str, str]]] = {}
    for name, person in script.people.items():
        at, since_s, key = person.start, 0.0, f"people.{name}.start"
        for i, one in enumerate(timed_acts(script, name, 0)):
            if one.act.do == "walk" and one.act.to != at:
                stays.setdefault(at, []).append((since_s, one.start_s, name, key))
                at, since_s, key = one.act.to, one.end_s, f"people.{name}.acts.{i}.to"
        stays.setdefault(at, []).append((since_s, script.round_s, name, key))
    for at, found in stays.items():
        if places_of(script)[at].outside:
            continue
        for k, (start_s, end_s, name, key) in enumerate(found):
            for other_start_s, other_end_s, other, _ in found[:k]:
                if name != other and max(start_s, other_start_s) < min(end_s, other_end_s) - 1e-9:
                    yield key, f"{other} is at {at} then; choose another place or time"


CHECKS = (script_faults,)
"""Rules between several fields, for ``gazerig.config.load.load`` of a SceneScript."""
