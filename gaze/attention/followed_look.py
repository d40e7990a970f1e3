"""Following the look of a person: to what somebody turns to look at, and back to the face.

People follow a partner's turn of eyes and head within a second in most cases, and look back at the
face (joint attention; Frischen, Bayliss & Tipper 2007). A look counts when it has turned by a clear
angle, away from the robot's head, and has come to rest. It goes to the visible body nearest to its
line, or into its direction if there is none. A look at another person is left to the choice among
people.
"""

from typing import NamedTuple

import numpy as np

from gazerig.gaze.angles import add, angle_between, norm, scale, sub
from gazerig.gaze.types import Face, Percept, Vec3, vec

_FOLLOWED = 0.8
"""Share of the looks that are followed."""
_TURNED_RAD, _OFF_HEAD_RAD = 0.26, 0.35
"""A look has turned by at least 15 deg, and goes past the robot's head by at least 20 deg."""
_SETTLED_RAD, _SETTLED_S = 0.17, 0.15
"""A look is at rest when it has stayed within this angle, wider than its noise, for this time."""
_BESIDE_LINE_RAD = 0.21
"""Largest angle of a body from the line of the look."""
_OWN_M = 0.35
"""Bodies nearer than this to the face are the person's own."""
_AWAY_M = 0.5
"""Distance from the face of the point looked at if nothing is there."""
_PAUSE_S = 3.0
"""Shortest time between two followed looks: not each of many turns is followed."""
_THING_S, _NOTHING_S = (0.8, 1.4), (0.5, 0.8)
"""Ranges of the duration of the robot's own look, with a thing there or without."""


class Followed(NamedTuple):
    """A place that a person looks at, and the duration of the robot's look there."""

    p_world_m: Vec3
    seconds: float


class FollowedLook:
    """Looks of the attended person that are worth following."""

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.reset()

    def reset(self) -> None:
        """Forget the person."""
        self._id = -1
        self._captured_s = self._next_s = 0.0
        self._settled: Vec3 | None = None
        self._new: tuple[Vec3, float] | None = None

    def step(self, percept: Percept, attended_id: int, p_eye: Vec3) -> Followed | None:
        """Return the place of a look to follow now; None without one.

        Args:
            percept: the newest percept.
            attended_id: id of the face that the gaze is on.
            p_eye: middle of the robot's eyes.
        """
        if percept.captured_s == self._captured_s:
            return None
        self._captured_s = captured_s = percept.captured_s
        face = next((one for one in percept.faces if one.id == attended_id), None)
        if face is None:
            return None
        x_axis, _, _ = zip(*face.R_world_face, strict=True)
        way = face.gaze_world or x_axis
        if face.id != self._id:
            self._id, self._settled, self._new = face.id, None, None
        if self._new is None or angle_between(self._new[0], way) > _SETTLED_RAD:
            self._new = way, captured_s
            return None
        if captured_s - self._new[1] < _SETTLED_S:
            return None
        before, self._settled = self._settled, way
        if (
            before is None
            or angle_between(before, way) < _TURNED_RAD
            or angle_between(way, sub(p_eye, face.p_world_m)) < _OFF_HEAD_RAD
            or captured_s < self._next_s
            or self._rng.random() >= _FOLLOWED
        ):
            return None
        self._next_s = captured_s + _PAUSE_S
        return self._place(percept, face, way)

    def _place(self, percept: Percept, face: Face, way: Vec3) -> Followed | None:
        """Return the body on the line of a look, or a point in its direction."""
        bodies, nearest_rad = percept.bodies, _BESIDE_LINE_RAD
        found, kind = None, ""
        for row, p in enumerate(map(vec, bodies.p_world_m)):
            rel = sub(p, face.p_world_m)
            if norm(rel) > _OWN_M and (off_rad := angle_between(rel, way)) < nearest_rad:
                found, kind, nearest_rad = p, bodies.kinds[row], off_rad
        if kind == "face":
            return None
        low_s, high_s = _NOTHING_S if found is None else _THING_S
        there = add(face.p_world_m, scale(way, _AWAY_M)) if found is None else found
        return Followed(there, float(self._rng.uniform(low_s, high_s)))
