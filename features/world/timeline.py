"""A script's acts with their true start and end times.

The acts of a person are on tracks: legs, mouth, head, eyes, left arm, right arm. Acts on one track
follow each other; acts on different tracks may overlap.
"""

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from gazerig.features.world.room import (
    Place,
    places_for,
    places_of,
    standing_point,
    walk_s,
    way_points,
)
from gazerig.features.world.script import HEAD, Act, WorldScript
from gazerig.gaze.types import Vec3

HEAD_M: Vec3 = (0.05, 0.0, 0.125)
"""Gaze target of people who look at the robot: between the eyes of a head on its neck base."""

_ARMS = ("left arm", "right arm")
TRACKS: Mapping[str, tuple[str, ...]] = {
    "walk": ("legs",),
    "step": ("legs",),
    "turn": ("legs",),
    "sit": ("legs",),
    "stand": ("legs",),
    "look_at": ("eyes",),
    "speak": ("mouth",),
    "nod": ("head",),
    "shake": ("head",),
    "be_hit": ("head",),
    "guard": ("guard",),
    "open_guard": _ARMS,
    "gesture": _ARMS,
}
"""The tracks of an act; an act that is not listed is on the arm of its side."""
LASTS_S: Mapping[str, float] = {
    "step": 0.9,
    "turn": 1.2,
    "sit": 1.7,
    "stand": 1.7,
    "look_at": 0.0,
    "speak": 3.0,
    "nod": 1.2,
    "shake": 1.2,
    "be_hit": 0.7,
    "wave": 2.6,
    "gesture": 3.0,
    "point": 2.2,
    "reach": 2.8,
    "push": 2.0,
    "pass": 2.4,
    "punch": 0.6,
    "feint": 0.3,
    "open_guard": 1.4,
}
"""Default durations of acts; the duration of a walk follows from its path."""
NEEDS_TARGET = ("walk", "turn", "look_at", "point", "reach", "push", "pass", "punch")
WALKS_TO_PLACES = ("walk", "step")


class TimedAct(NamedTuple):
    """An act with its start and end; ``target``: a fixed point, None for a person."""

    act: Act
    start_s: float
    end_s: float
    target: Vec3 | None = None

    @property
    def tracks(self) -> tuple[str, ...]:
        """Return the tracks of the act."""
        return TRACKS.get(self.act.do, (f"{self.act.side} arm",))


def floor_m(script: WorldScript) -> float:
    """Return the height of the floor in the world, below zero."""
    return -script.neck_height_m


def timed_acts(script: WorldScript, name: str, seed: int) -> tuple[TimedAct, ...]:
    """Return the acts of a person, in the script's order, with random times from the seed."""
    person = script.people[name]
    rng = np.random.default_rng([seed, list(script.people).index(name)])
    places = places_for(script, name)
    at = places[person.start]
    found = []
    for act in person.acts:
        start_s = max(0.0, act.at_s + act.vary_s * float(rng.uniform(-1.0, 1.0)))
        found.append(
            TimedAct(
                act, start_s, start_s + _lasts_s(script, act, at, places), _target(script, act)
            )
        )
        if act.do in WALKS_TO_PLACES and act.to:
            at = places[act.to]
    return tuple(found)


def _lasts_s(script: WorldScript, act: Act, at: Place, places: Mapping[str, Place]) -> float:
    if act.for_s is not None:
        return act.for_s
    if act.do == "walk":
        via = [places[name] for name in act.via]
        return walk_s(way_points(at, places[act.to], via, standing_point(at)), act.speed_m_s)
    if act.do == "guard":
        return script.round_s - act.at_s
    return LASTS_S[act.do]


def _target(script: WorldScript, act: Act) -> Vec3 | None:
    """Return the fixed target of an act, None for a person."""
    if act.to in ("", HEAD):
        return HEAD_M
    if act.to in script.people:
        return None
    place = places_of(script)[act.to]
    return (place.x_m, place.y_m, floor_m(script) + place.height_m)
