"""Faults that prevent a script from being played: each with its key, the fault and the cure."""

from collections.abc import Iterable, Iterator, Mapping
from math import hypot

from gazerig.features.world.object_handover import handover_faults
from gazerig.features.world.room import Place, places_of
from gazerig.features.world.script import HEAD, Act, Fault, PersonScript, WorldScript
from gazerig.features.world.timeline import (
    NEEDS_TARGET,
    WALKS_TO_PLACES,
    TimedAct,
    timed_acts,
)

HEADS_APART_M = 0.4
"""Smallest distance of two necks."""


def faults(script: WorldScript) -> Iterable[Fault]:
    """Yield the faults of a script, each with its key."""
    yield from _misplaced_heads(script)
    yield from _unknown(script)
    if next(iter(_unknown(script)), None) is not None:
        return
    timelines = {name: timed_acts(script, name, 0) for name in script.people}
    yield from handover_faults(script, timelines)
    for name, person in script.people.items():
        yield from _overlaps(script, name, timelines[name])
        yield from _legs(script, name, person)
    yield from _crowded(script)


def _misplaced_heads(script: WorldScript) -> Iterator[Fault]:
    """Find heads with an invalid name or too close to another."""
    placed = [("", 0.0, 0.0)]
    for name, head in script.heads.items():
        key = f"heads.{name}"
        if not name.isidentifier() or name == HEAD or name in script.people:
            yield key, "a name has letters, digits and _, begins with a letter and is unique"
        for other, x_m, y_m in placed:
            if hypot(head.x_m - x_m, head.y_m - y_m) < HEADS_APART_M:
                beside = f"head {other}" if other else "the first head"
                yield key, f"it is less than {HEADS_APART_M} m from {beside}: move it away"
        placed.append((name, head.x_m, head.y_m))


def _unknown(script: WorldScript) -> Iterator[Fault]:
    """Find names of people, places and things that are not there."""
    places = places_of(script)
    seats = ", ".join(sorted(places))
    people = ", ".join(script.people)
    for name, person in script.people.items():
        key = f"people.{name}"
        if not name.isidentifier() or name == HEAD:
            yield key, "a name has letters, digits and _, begins with a letter and is not head"
        if person.start not in places:
            yield f"{key}.start", f"{script.room} has no place {person.start!r}; it has {seats}"
        targets = {HEAD, *script.people, *places}
        if person.looks_at not in targets:
            yield f"{key}.looks_at", f"no person, no place; there are head, {people}, {seats}"
        for i, act in enumerate(person.acts):
            for rule_key, rule in _unknown_of(script, name, act, places):
                yield f"{key}.acts.{i}{rule_key}", rule
    for name, thing in script.things.items():
        if thing.held_by not in script.people:
            yield f"things.{name}.held_by", f"no person {thing.held_by!r}; there are {people}"


def _unknown_of(
    script: WorldScript, name: str, act: Act, places: Mapping[str, Place]
) -> Iterator[Fault]:
    there = ", ".join(sorted(places))
    if act.do in NEEDS_TARGET and not act.to:
        yield "", f"{act.do} needs `to`: whom or what"
    elif act.do in WALKS_TO_PLACES:
        if act.to and act.to not in places:
            yield ".to", f"{script.room} has no place {act.to!r}; it has {there}"
    elif act.do == "pass":
        if act.to not in script.people or act.to == name:
            yield ".to", f"another person; there are {', '.join(script.people)}"
        if act.thing not in script.things:
            yield ".thing", f"none of the script's `things`: {', '.join(script.things) or 'none'}"
    elif act.to and act.to not in {HEAD, *script.people, *places}:
        yield ".to", f"no person, no place; there are head, {', '.join(script.people)}, {there}"
    for place in act.via:
        if place not in places:
            yield ".via", f"{script.room} has no place {place!r}; it has {there}"


def _overlaps(script: WorldScript, name: str, acts: tuple[TimedAct, ...]) -> Iterator[Fault]:
    """Find simultaneous acts on one track, and acts that last beyond the round."""
    busy: dict[str, tuple[float, int]] = {}
    for i, one in enumerate(acts):
        key, spare_s = f"people.{name}.acts.{i}", one.act.vary_s
        if one.end_s + spare_s > script.round_s + 1e-9:
            yield (
                f"{key}.at_s",
                f"{one.act.do} ends at {one.end_s + spare_s:.1f} s, the round at "
                f"{script.round_s:g} s; begin earlier or make round_s longer",
            )
        for track in one.tracks:
            until_s, other = busy.get(track, (0.0, -1))
            begins_s = one.act.at_s - spare_s
            if begins_s < until_s - 1e-9 and one.act.do != "look_at":
                yield (
                    f"{key}.at_s",
                    f"{one.act.do} begins while {acts[other].act.do} (acts.{other}) keeps the {track} "
                    f"busy until {until_s:.1f} s; begin then",
                )
            lasts_s = one.end_s - one.start_s
            busy[track] = (max(until_s, one.act.at_s + spare_s + lasts_s), i)


def _legs(script: WorldScript, name: str, person: PersonScript) -> Iterator[Fault]:
    """Find a walk of a seated person, a sitting without a seat, or an end of round elsewhere."""
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


def _crowded(script: WorldScript) -> Iterator[Fault]:
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


CHECKS = (faults,)
"""Rules between several fields, for ``gazerig.config.load.load`` of a WorldScript."""
