"""Acts of people in a room: their durations by its paths, and their targets."""

from gazerig.features.world.room import (
    places_for,
    places_of,
    standing_point,
    walk_s,
    way_points,
)
from gazerig.gaze.types import Vec3
from gazerig.sim_mock.scenes import timeline
from gazerig.sim_mock.scenes.script import HEAD, Act, SceneScript
from gazerig.sim_mock.scenes.timeline import LASTS_S, TimedAct

HEAD_M: Vec3 = (0.05, 0.0, 0.125)
"""Gaze target of people who look at the robot: between the eyes of a head on its neck base."""


def floor_m(script: SceneScript) -> float:
    """Return the height of the floor in the world, below zero."""
    return -script.neck_height_m


def place_m(script: SceneScript, name: str) -> Vec3:
    """Return what is looked or pointed at in a place."""
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
