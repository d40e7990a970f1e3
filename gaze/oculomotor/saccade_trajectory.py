"""Trajectory of one saccade: the gaze point between take-off and landing.

The path is the great circle between the two directions, so that both axes start and end together.
The points are seen from the head's position at each moment, so that its own motion moves neither
end. The nearness, and with it vergence, follows the same profile.

A target that jumps early in flight bends the path (``RedirectedTrajectory``): a second saccade,
from the old end to the new one, is added to the remainder of the first (the superposition of Flash
and Henis 1991), so that position, speed and acceleration are continuous.
"""

import numpy as np

from gazerig.gaze.angles import (
    add,
    along_great_circle,
    angle_between,
    cross,
    norm,
    rotate_about_axis,
    scale,
    sub,
    unit,
)
from gazerig.gaze.oculomotor.saccade import SaccadeModel
from gazerig.gaze.types import Floats, Vec3

_FARTHEST_1_M = 0.001
_SAMPLE_S, _STARTS, _MARGIN = 0.0025, 8, 0.98
"""Step of sampling the sum of two saccades, number of starts of the second that are tried, and
share of the limits that the sum may use."""


class SaccadeTrajectory:
    """The gaze point in motion from one point in the world to another."""

    onset_s: float
    ends_s: float

    def __init__(
        self, saccade: SaccadeModel, start: Vec3, end: Vec3, eye: Vec3, onset_s: float
    ) -> None:
        self._profile, self._start, self.end = saccade.profile, start, end
        self._start_way, self._end_way = unit(sub(start, eye)), unit(sub(end, eye))
        self.onset_s = onset_s
        self.amplitude_rad = angle_between(self._start_way, self._end_way)
        self.ends_s = onset_s + self._profile.duration_s(self.amplitude_rad)

    def point_at(self, eye: Vec3, t_s: float) -> Vec3:
        """Return the gaze point, seen from where the eyes are now."""
        done = self._profile.displacement_rad(self.amplitude_rad, t_s - self.onset_s)
        share = done / self.amplitude_rad if self.amplitude_rad > 0.0 else 1.0
        a, b = sub(self._start, eye), sub(self.end, eye)
        near_a, near_b = 1.0 / norm(a), 1.0 / norm(b)
        # The great circle stays that of the onset and both ends' parallax is added: the plane
        # through two nearly opposite directions would turn with the smallest parallax.
        way = along_great_circle(self._start_way, self._end_way, share)
        way = add(way, scale(sub(scale(a, near_a), self._start_way), 1.0 - share))
        way = add(way, scale(sub(scale(b, near_b), self._end_way), share))
        return add(eye, scale(unit(way), 1.0 / ((1.0 - share) * near_a + share * near_b)))


class RedirectedTrajectory:
    """A saccade whose target has jumped: a second one is added to the remainder of the first.

    Args:
        before: the present trajectory.
        saccade: durations and limits.
        end: the new end, in the world.
        eye: present midpoint between the eyes.
        t_s: present time, seconds.
    """

    onset_s: float
    ends_s: float

    def __init__(
        self, before: "Trajectory", saccade: SaccadeModel, end: Vec3, eye: Vec3, t_s: float
    ) -> None:
        self._before, self._profile, self.end, self.onset_s = (
            before,
            saccade.profile,
            end,
            before.onset_s,
        )
        first, then = unit(sub(before.end, eye)), unit(sub(end, eye))
        self._angle_rad = angle_between(first, then)
        lasts_s = self._profile.duration_s(self._angle_rad)
        self._begin_s = self._earliest(first, then, saccade, eye, t_s, lasts_s)
        self.ends_s = max(before.ends_s, self._begin_s + lasts_s)

    def _earliest(
        self, first: Vec3, then: Vec3, saccade: SaccadeModel, eye: Vec3, t_s: float, lasts_s: float
    ) -> float:
        """Return the earliest start of the second saccade with both within the limits.

        first, then: unit directions of the ends
        lasts_s: duration of the second one
        """
        before, left_s = self._before, self._before.ends_s - t_s
        pole = cross(first, then)
        times = np.arange(t_s, before.ends_s + lasts_s, _SAMPLE_S)
        if norm(pole) < 1e-9 or len(times) < 3:
            return before.ends_s
        ways = np.array([unit(sub(before.point_at(eye, float(t)), eye)) for t in times])
        velocity = np.diff(ways, axis=0) / _SAMPLE_S
        toward = np.array(cross(unit(pole), first))
        top, most = saccade.max_speed_rad_s * _MARGIN, saccade.max_acceleration_rad_s2 * _MARGIN
        fastest, hardest = np.maximum(_sizes(velocity), top), np.maximum(_changes(velocity), most)
        for share in range(_STARTS):
            begin_s = t_s + left_s * share / _STARTS
            added = [self._profile.displacement_rad(self._angle_rad, t - begin_s) for t in times]
            both = velocity + np.outer(np.diff(added) / _SAMPLE_S, toward)
            if (_sizes(both) <= fastest).all() and (_changes(both) <= hardest).all():
                return begin_s
        return before.ends_s

    def point_at(self, eye: Vec3, t_s: float) -> Vec3:
        """Return the gaze point, seen from where the eyes are now."""
        way = sub(self._before.point_at(eye, t_s), eye)
        added = self._profile.displacement_rad(self._angle_rad, t_s - self._begin_s)
        share = added / self._angle_rad if self._angle_rad > 0.0 else 1.0
        first, then = sub(self._before.end, eye), sub(self.end, eye)
        near = 1.0 / norm(way) + share * (1.0 / norm(then) - 1.0 / norm(first))
        pole = cross(unit(first), unit(then))
        if norm(pole) > 1e-9:
            way = rotate_about_axis(way, unit(pole), share * angle_between(first, then))
        return add(eye, scale(unit(way), 1.0 / max(near, _FARTHEST_1_M)))


Trajectory = SaccadeTrajectory | RedirectedTrajectory


def _sizes(vectors: Floats) -> Floats:
    sizes: Floats = np.sqrt((vectors * vectors).sum(axis=1))
    return sizes


def _changes(velocity: Floats) -> Floats:
    return _sizes(np.diff(velocity, axis=0)) / _SAMPLE_S
