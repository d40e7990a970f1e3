"""Search for a person whom a client wants: by number, or anybody on a side.

The head looks along its reach, first where the person was seen last, in steps that overlap in the
field of view of a camera. Its looks are those of the search for a lost person
(gazerig.gaze.attention.idle), along a plan.
"""

from math import degrees, radians
from typing import Literal

import numpy as np
from msgspec import Struct

from gazerig.gaze.angles import Angles2, norm, sub, yaw_pitch
from gazerig.gaze.attention.idle import REST_M, Idle, IdleParams
from gazerig.gaze.types import SEARCH, Face, Percept, Vec3

Sought = int | Literal["left", "right", "anybody"]
"""Number of a person, or the side on which anybody is wanted."""

GIVES_UP_S = 7.5
"""Longest search."""
_LOOK_S = 1.4
"""Duration of a look: the head arrives, and a detector gets some frames."""
_NEARER = 0.5
"""Angle of the first look to a side, as a share of the reach."""
_UP_RAD = radians(8.0)
"""Elevation of looks to a side: most people are taller than a head on a table."""
_ASIDE_RAD = radians(5.0)
_EYE: Vec3 = (0.0, 0.0, REST_M[2])


class Found(Struct, frozen=True, gc=False):
    """A found person.

    Attributes:
        person: Perception's number.
        direction_rad: (yaw, pitch) in the world from the resting height, + left and + up.
        distance_m: Distance from there.
    """

    person: int
    direction_rad: Angles2
    distance_m: float

    def text(self) -> str:
        """Return the person, with the direction in words."""
        yaw, pitch = map(degrees, self.direction_rad)
        side = "left" if yaw > 0.0 else "right"
        return (
            f"person {self.person}: {abs(yaw):.0f} deg to the {side}, {pitch:.0f} deg up, "
            f"{self.distance_m:.1f} m away"
        )


class Finding(Idle):
    """A search: the gaze while nobody fits, along a plan.

    Args:
        sought: who is wanted.
        place: where that person was seen last, None if unknown.
        params: reach of the gaze.
        t_s: present time.
    """

    def __init__(self, sought: Sought, place: Vec3 | None, params: IdleParams, t_s: float) -> None:
        super().__init__(params, np.random.default_rng(0))
        self._sought, self._began_s = sought, t_s
        self._lost, self._until_s = True, t_s
        reach = radians(params.reach_deg)
        signs = {"left": (1.0,), "right": (-1.0,)}.get(str(sought), (1.0, -1.0))
        aside = [(sign * share * reach, _UP_RAD) for sign in signs for share in (_NEARER, 1.0)]
        self._ways = aside if place is None else [yaw_pitch(sub(place, _EYE)), *aside]

    def has_given_up(self, t_s: float) -> bool:
        """Return whether nobody was found in time."""
        return t_s - self._began_s > GIVES_UP_S

    def face(self, percept: Percept) -> Face | None:
        """Return the first living face that fits, None without one."""
        for face in percept.faces:
            yaw = yaw_pitch(sub(face.p_world_m, _EYE))[0]
            sides = {"left": yaw > _ASIDE_RAD, "right": yaw < -_ASIDE_RAD, "anybody": True}
            fits = sides.get(str(self._sought), face.id == self._sought)
            if fits and face.id not in percept.bodies.lifeless:
                return face
        return None

    def _start_next_phase(self, t_s: float) -> None:
        way = self._ways[self._count % len(self._ways)]
        self._look(SEARCH, way, REST_M[0], t_s, "looking for the person whom a user wants")
        self._until_s = t_s + _LOOK_S


def found(face: Face) -> Found:
    """Return what a client is told of a found face."""
    rel = sub(face.p_world_m, _EYE)
    return Found(face.id, yaw_pitch(rel), norm(rel))
