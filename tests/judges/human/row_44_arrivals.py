"""A new or returned person brings the head: within 7 deg of the face in two seconds.

People orient to someone who arrives with eyes and head, and leave the eyes near the middle of the
head (Stahl 1999). The time begins when the face comes into the camera's field, for who is there at
the beginning with the run; who is never in the field, or never reached, counts as late.

A rest tells little of the next one, also while somebody comes, stays and goes: neighbours correlate
by about .1 in people.
"""

from collections.abc import Iterator
from math import atan2, copysign, cos, inf, pi, radians, sin

import numpy as np
from fakes.scenes import EmptyScene
from human.measured_run import Figures, MeasuredRun, Runs, measured_run
from human.spells import apart_deg, spells
from human.swinging_face import HEAD_M

from gazerig.sim_mock.scenes.scene import ScenePerson, min_jerk

WANTED = {
    "head within 7 deg in 2 s, % of arrivals": (95.0, 100.0),
    "there at the start: median, s": (0.0, 2.0),
    "coming or returning: median, s": (0.0, 2.0),
    "correlation of neighbouring rests": (-0.1, 0.12),
}

_STAYS_S, _AWAY_S, _WALKS_S = 8.0, 8.0, 2.0
_PERIOD_S = _STAYS_S + _AWAY_S + 2.0 * _WALKS_S
_VISITS, _SCENES = 3, 12
_OUTSIDE_RAD, _UP_M = radians(110.0), 0.11
_NEAR_DEG, _KEPT_S, _IN_TIME_S = 7.0, 0.5, 2.0
_FIELD_DEG = (34.5, 23.2)
"""Half of the field of the desk rig's camera, 69 deg wide, of 640 x 400 pixels."""


class Arrivals(EmptyScene):
    """A person who stands, walks off to the side, is away for 8 s, and comes to another place.

    With even numbers the person is there at the beginning, with odd ones comes to an empty room.
    """

    round_s = 3600.0

    def __init__(self, number: int) -> None:
        self.name, self.there = f"arrivals {number}", number % 2 == 0
        rng = np.random.default_rng(number)
        self._yaws_rad = np.radians(rng.uniform(6.0, 30.0, _VISITS) * rng.choice([-1, 1], _VISITS))
        self._far_m = rng.uniform(0.9, 1.6, _VISITS)

    def came_s(self, visit: int) -> float:
        """Return when the person is at the place of a visit."""
        return _PERIOD_S * visit + (0.0 if self.there else 0.5 * _PERIOD_S)

    def people(self, t_s: float) -> tuple[ScenePerson, ...]:
        """Return the person while there."""
        for visit, (yaw, far_m) in enumerate(zip(self._yaws_rad, self._far_m, strict=True)):
            since_s = t_s - self.came_s(visit)
            off_s = max(-since_s, since_s - _STAYS_S, 0.0)
            if off_s < _WALKS_S:
                yaw += (copysign(_OUTSIDE_RAD, yaw) - yaw) * min_jerk(off_s / _WALKS_S)
                x, y, z = HEAD_M
                face = x + far_m * cos(yaw), y + far_m * sin(yaw), z + _UP_M
                return (ScenePerson(face, (yaw + pi, -atan2(_UP_M, far_m)), None),)
        return ()


def measure(runs: Runs) -> Figures:
    """Return the share in time and the medians, over several places, a seed for each scene."""
    scenes = [Arrivals(number) for number in range(_SCENES)]
    every = [
        measured_run(scene, seed=n, seconds=scene.came_s(_VISITS - 1) + _STAYS_S)
        for n, scene in enumerate(scenes)
    ]
    found = [
        each for scene, one in zip(scenes, every, strict=True) for each in arrivals(one, scene)
    ]
    taken_s = np.array([s for _, s in found])
    first = np.array([at_start for at_start, _ in found])
    return {
        "head within 7 deg in 2 s, % of arrivals": 100.0 * (taken_s <= _IN_TIME_S).mean(),
        "there at the start: median, s": np.median(taken_s[first]),
        "coming or returning: median, s": np.median(taken_s[~first]),
        "number of arrivals": len(found),
        "correlation of neighbouring rests": np.corrcoef(
            np.concatenate([_neighbours(one) for one in every]).T
        )[0, 1],
    }


def _neighbours(one: MeasuredRun) -> np.ndarray:
    """Return (n, 2) the lengths of measured fixations and of those after them, of all kinds."""
    rests_s = np.array([fixation.duration_s for fixation in one.trace.fixations])
    return np.column_stack((rests_s[:-1], rests_s[1:]))


def arrivals(one: MeasuredRun, scene: Arrivals) -> Iterator[tuple[bool, float]]:
    """Yield whether the person was there at the start, and the time that the head has taken."""
    head, face = one.head_deg[:, :2], one.truth_deg("face 0")
    seen = (np.abs(face - head) < _FIELD_DEG).all(axis=1)
    kept = round(_KEPT_S / one.period_s)
    near = [begin for begin, end in spells(apart_deg(head, face) < _NEAR_DEG) if end - begin > kept]
    for visit in range(_VISITS):
        came_s = scene.came_s(visit)
        first, last = np.searchsorted(one.t_s, (came_s - _WALKS_S, came_s + _STAYS_S))
        at_start = came_s == 0.0
        in_view = np.flatnonzero(seen[first:last])
        begin = 0 if at_start else first + in_view[0] if len(in_view) else last
        reached = [tick for tick in near if begin <= tick < last]
        yield at_start, float(one.t_s[reached[0]] - one.t_s[begin]) if reached else inf
