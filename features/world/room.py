"""Rooms of a world: places to stand, sit and enter, and paths around the furniture.

Places are on the floor, in the world's axes: the neck base of the first head is above (0, 0).
"""

from collections.abc import Mapping, Sequence
from math import atan2, cos, pi, radians, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.script import SceneScript

HOME = Path(__file__).parent
"""The folder with ``worlds``, the shipped scripts."""

Point = tuple[float, float]


class Place(NamedTuple):
    """Place of a person: on the floor, or on a seat.

    x_m, y_m: position of the centre of the hips; facing_rad: direction of a person there
    seat_m: height of the seat above the floor, None without a seat
    approach: points that a walk from the room's middle passes before it
    outside: whether it is behind a door, where several people wait unseen
    height_m: height of a target of looking, pointing or reaching there
    """

    x_m: float
    y_m: float
    facing_rad: float
    seat_m: float | None = None
    approach: tuple[Point, ...] = ()
    outside: bool = False
    height_m: float = 1.3

    def ahead(self, by_m: float) -> Point:
        """Return the point at a distance ahead of the place."""
        return self.x_m + by_m * cos(self.facing_rad), self.y_m + by_m * sin(self.facing_rad)


def _to_head(x_m: float, y_m: float) -> float:
    return atan2(-y_m, -x_m)


def _chair(x_m: float, y_m: float, seat_m: float, *approach: Point) -> Place:
    return Place(x_m, y_m, _to_head(x_m, y_m), seat_m, approach)


_WAITING_M = 0.6
SEAT_AHEAD_M = 0.40
"""Distance in front of a seat's centre from which a person sits down."""
WALK_STARTS_S, WALK_ENDS_S = 0.6, 0.8
"""Durations of the turns before and after a walk."""
SEAT_M, SOFA_M = 0.45, 0.41
"""Seat heights of a chair and of the sofa under a seated person."""

LIVING_ROOM: Mapping[str, Place] = {
    "door": Place(0.75, 3.55, 0.0, None, ((1.55, 2.35), (1.55, 3.30)), True),
    "chair_left": _chair(1.16, 0.44, SEAT_M, (0.62, 1.0), (0.62, 0.55)),
    "chair_right": _chair(1.16, -0.44, SEAT_M, (0.62, -1.0), (0.62, -0.55)),
    "sofa_left": Place(2.62, 0.33, pi, SOFA_M, ((2.02, 0.95),)),
    "sofa_right": Place(2.62, -0.33, pi, SOFA_M, ((2.02, -0.95),)),
    "front": Place(0.95, 0.0, pi, None, ((0.80, 1.00),)),
    "behind": Place(1.74, 0.02, pi, None, ((2.0, 1.00),)),
    "window": Place(1.60, -1.90, radians(140.0), None, ((1.75, -1.2),)),
    "shelf": Place(2.30, 1.75, radians(215.0), None, ()),
}
GYM: Mapping[str, Place] = {
    "corner": Place(1.08, 0.0, pi),
    "left": Place(1.05, 0.30, _to_head(1.05, 0.30)),
    "right": Place(1.05, -0.30, _to_head(1.05, -0.30)),
    "rope": Place(2.60, 0.9, _to_head(2.60, 0.9)),
    "behind_left": Place(-0.75, 0.75, 0.0),
    "behind_right": Place(-0.75, -0.75, 0.0),
}
HALL: Mapping[str, Place] = {
    "entrance": Place(2.1, 4.3, 0.0, None, ((3.45, 3.0), (3.45, 4.2)), True),
    "exit": Place(2.1, -4.3, 0.0, None, ((3.45, -3.0), (3.45, -4.2)), True),
    "front": Place(1.05, 0.0, pi),
    "front_left": Place(1.15, 0.55, _to_head(1.15, 0.55)),
    "front_right": Place(1.15, -0.55, _to_head(1.15, -0.55)),
    "close": Place(0.56, 0.0, pi),
    "lane_left": Place(2.9, 1.3, -pi / 2),
    "lane_right": Place(2.9, -1.3, -pi / 2),
    "middle": Place(2.0, 0.05, pi),
    "far_right": Place(3.4, -1.3, 0.2),
    "poster": Place(5.5, -2.3, pi, height_m=1.75),
    "middle_left": Place(2.3, 1.0, _to_head(2.3, 1.0)),
    "middle_right": Place(2.3, -0.8, _to_head(2.3, -0.8)),
}
ROOMS: Mapping[str, Mapping[str, Place]] = {
    "living-room": LIVING_ROOM,
    "gym": GYM,
    "hall": HALL,
}
"""The places of each room by name."""


def places_of(script: SceneScript) -> dict[str, Place]:
    """Return all places of a world: those of its room, replaced or extended by its own."""
    own = {
        name: Place(one.x_m, one.y_m, radians(one.facing_deg), height_m=one.height_m)
        for name, one in script.places.items()
    }
    return {**ROOMS[script.room], **own}


def places_for(script: SceneScript, name: str) -> dict[str, Place]:
    """Return all places as one person uses them: people who wait outside form a row."""
    row = _WAITING_M * list(script.people).index(name)
    return {
        key: place._replace(x_m=place.ahead(-row)[0], y_m=place.ahead(-row)[1])
        if place.outside
        else place
        for key, place in places_of(script).items()
    }


def way_points(start: Place, target: Place, via: Sequence[Place], at: Point) -> Floats:
    """Return the corners of a walk (n, 2), from the current point to the standing point."""
    middle = [(one.x_m, one.y_m) for one in via]
    return np.array([at, *start.approach[::-1], *middle, *target.approach, standing_point(target)])


def standing_point(place: Place) -> Point:
    """Return the standing point of a place; in front of a seat."""
    return place.ahead(0.0 if place.seat_m is None else SEAT_AHEAD_M)


def walk_s(points: Floats, speed_m_s: float) -> float:
    """Return the duration of a walk along corners."""
    length = float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
    return length / speed_m_s + WALK_STARTS_S + WALK_ENDS_S + 0.5
