"""Rooms of a world: places to stand, sit and enter, and paths around the furniture.

Places are on the floor, in the world's axes: the neck base of the first head is above (0, 0).
"""

from collections.abc import Mapping, Sequence
from functools import cache
from math import atan2, cos, radians, sin
from pathlib import Path

import msgspec
import numpy as np
from msgspec.structs import replace

from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.script import SceneScript

HOME = Path(__file__).parent
"""The folder with ``worlds``, the shipped scripts, and ``rooms``."""

Point = tuple[float, float]


class Place(msgspec.Struct, frozen=True):
    """Place of a person: on the floor, or on a seat.

    x_m, y_m: position of the centre of the hips
    facing_deg: direction of a person there, None towards the head
    seat_m: height of the seat above the floor, None without a seat
    approach: points that a walk from the room's middle passes before it
    outside: whether it is behind a door, where several people wait unseen
    height_m: height of a target of looking, pointing or reaching there
    """

    x_m: float
    y_m: float
    facing_deg: float | None = None
    seat_m: float | None = None
    approach: tuple[Point, ...] = ()
    outside: bool = False
    height_m: float = 1.3

    @property
    def facing_rad(self) -> float:
        """Return the direction of a person there."""
        if self.facing_deg is None:
            return atan2(-self.y_m, -self.x_m)
        return radians(self.facing_deg)

    def ahead(self, by_m: float) -> Point:
        """Return the point at a distance ahead of the place."""
        return self.x_m + by_m * cos(self.facing_rad), self.y_m + by_m * sin(self.facing_rad)


_WAITING_M = 0.6
SEAT_AHEAD_M = 0.40
"""Distance in front of a seat's centre from which a person sits down."""
WALK_STARTS_S, WALK_ENDS_S = 0.6, 0.8
"""Durations of the turns before and after a walk."""


@cache
def _room_places(room: str) -> Mapping[str, Place]:
    text = (HOME / "rooms" / f"{room}.yaml").read_bytes()
    return msgspec.yaml.decode(text, type=dict[str, Place])


def places_of(script: SceneScript) -> dict[str, Place]:
    """Return all places of a world: those of its room, replaced or extended by its own."""
    own = {
        name: Place(one.x_m, one.y_m, one.facing_deg, height_m=one.height_m)
        for name, one in script.places.items()
    }
    return {**_room_places(script.room), **own}


def places_for(script: SceneScript, name: str) -> dict[str, Place]:
    """Return all places as one person uses them: people who wait outside form a row."""
    row = _WAITING_M * list(script.people).index(name)
    return {
        key: replace(place, x_m=place.ahead(-row)[0], y_m=place.ahead(-row)[1])
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
