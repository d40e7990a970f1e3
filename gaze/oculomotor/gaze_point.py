"""The gaze point: saccades move it to a target, pursuit keeps it there.

Points are in the world, in metres. Saccades land short of a far target, and with scatter (Harris &
Wolpert 1998).

Re-fixations are small saccades within a target during a long look. People's eyes never rest for
seconds: they make one to two small saccades per second, more than 90 % of them below 1 deg
(Otero-Millan et al. 2013). A servo shows those that are larger than its steps and its play. So the
gaze moves between points near the middle of a target after rests of .35 to 1.45 s: one such step a
second, and few in the shorter rests of a face or a room that is explored.
"""

from dataclasses import dataclass
from math import cos, degrees, hypot, inf, pi, radians, sin, sqrt
from typing import Annotated, Literal

import numpy as np

from gazerig.gaze.angles import (
    add,
    angle_between,
    direction,
    keep_min_distance,
    norm,
    offset_direction,
    scale,
    sub,
    unit,
    yaw_pitch,
)
from gazerig.gaze.oculomotor.binocular import NEAREST_M
from gazerig.gaze.oculomotor.pursuit import Pursuit, line_of_sight_to
from gazerig.gaze.oculomotor.saccade import SaccadeModel
from gazerig.gaze.oculomotor.saccade_trajectory import (
    RedirectedTrajectory,
    SaccadeTrajectory,
    Trajectory,
)
from gazerig.gaze.oculomotor.saccade_trigger import SaccadeTrigger
from gazerig.gaze.oculomotor.target_prediction import TargetPrediction
from gazerig.gaze.types import Angles2, Vec3
from gazerig.params import Bounds

MOVING_M_S = 0.05
"""A target slower than this is fixated, not pursued."""
_SLOW_M_S = 0.03
"""A target faster than this is followed without re-fixations: each would interrupt the following,
and an eye's friction delays its motion again."""
_MIDDLE = (0.0, 0.0)
_CORRECT_S = 0.155, 0.045
"""Mean delay from landing to a corrective saccade, people's is 100 to 200 ms, and its largest
random deviation."""
_CATCH_UP_S = 0.2, 0.05
"""The same for a saccade that catches up with a moving target."""


@dataclass(frozen=True)
class OculomotorParams:
    """Accuracy of saccades, rests between them, and the eyes' servos."""

    # fmt: off
    law: Annotated[Literal["people", "exact"],
        "people: saccades fall short and scatter, are corrected, bend and keep a distance in time, and targets are predicted; "
        "exact: they land on the target as it was seen, and go on to their ends"] = "people"
    refixations: Annotated[bool, "with law people: small saccades within the target during a long look"] = True
    eye_lag_ms: Annotated[float, Bounds(0, 200), "delay from command to motion of an eye; the head's motion during it is predicted"] = 15.0
    # fmt: on


class GazePoint:
    """Common goal of both eyes, moved from tick to tick.

    point_m: point in the world
    saccades, fixations: counts since the reset

    Args:
        params: law of saccades and of rests.
        saccade: the model of saccades.
        pursuit: the model of pursuit.
        prediction: prediction of the target that ``move`` receives.
        rng: random generator of endpoints and re-fixations.
    """

    def __init__(
        self,
        params: OculomotorParams,
        saccade: SaccadeModel,
        pursuit: Pursuit,
        prediction: TargetPrediction,
        rng: np.random.Generator,
    ) -> None:
        self._rng = rng
        self._saccade, self._pursuit, self._prediction = saccade, pursuit, prediction
        self._trigger = SaccadeTrigger(True)
        self._refixations = Refixations(rng)
        self.retune(params)
        self._exact = False
        self.reset(0.0, (1.0, 0.0, 0.0))

    def retune(self, params: OculomotorParams) -> None:
        """Change the law; a saccade in flight continues to its end."""
        self._people = params.law == "people"
        self._refixates = self._people and params.refixations
        self._trigger.retune(self._people)
        if not self._refixates:
            self._refixations.reset()

    def reset(self, t_s: float, point_m: Vec3) -> None:
        """Rest on a point."""
        self._trigger.reset(t_s)
        self._refixations.reset()
        self.point_m = point_m
        self._trajectory: Trajectory | None = None
        self.saccades = self.fixations = 0

    @property
    def is_in_saccade(self) -> bool:
        """Return whether a saccade is in flight."""
        return self._trajectory is not None

    @property
    def has_arrived(self) -> bool:
        """Return whether the gaze has arrived: no saccade to a new target is due or in flight."""
        return self._trajectory is None and not self._trigger.is_saccade_due

    @property
    def is_saccade_due(self) -> bool:
        """Return whether the saccade to a new target has not started yet."""
        return self._trigger.is_saccade_due

    @property
    def is_correction_due(self) -> bool:
        """Return whether the error of the last saccade waits for a correction."""
        return self._trigger.is_correction_due

    @property
    def shift(self) -> int | None:
        """Return the target's count of gaze shifts that was recorded last."""
        return self._trigger.shift

    @property
    def onset_s(self) -> float:
        """Return the start of the last saccade, or the planned start of the next."""
        return self._trigger.onset_s

    def record_shift(self, shift: int, wait_s: float, t_s: float, exact: bool = False) -> None:
        """Record a new target.

        Args:
            shift: its count of gaze shifts.
            wait_s: delay of the eyes because the head moves first.
            t_s: present time, seconds.
            exact: land on it without undershoot and scatter, and rest there without re-fixations.
        """
        self._exact = exact
        lands_s = self._trajectory.ends_s if self._trajectory else None
        self._trigger.record_shift(shift, wait_s, lands_s, t_s)
        self._refixations.reset()

    def postpone(self, wait_s: float) -> None:
        """Delay the saccade to a new target further."""
        self._trigger.postpone(wait_s)

    def move(
        self, point: Vec3, velocity: Vec3, p_head: Vec3, t_s: float, dt_s: float
    ) -> float | None:
        """Move the gaze point along a saccade, or after the target.

        Args:
            point: the target now, not nearer than ``NEAREST_M``.
            velocity: velocity of the target, m/s.
            p_head: midpoint between the eyes.
            t_s: present time, seconds.
            dt_s: time since the last tick.

        Returns:
            The amplitude of the saccade that starts now, radians; None without one.
        """
        shift_rad, known = None, self._prediction.sine is not None
        trigger, trajectory = self._trigger, self._trajectory
        if self._refixations.offset_rad != _MIDDLE:
            point = _offset_point(point, p_head, self._refixations.offset_rad)
        if trajectory is None:
            gaze, there = line_of_sight_to(self.point_m, p_head), line_of_sight_to(point, p_head)
            x, y, z = there[0] - gaze[0], there[1] - gaze[1], there[2] - gaze[2]
            if not trigger.is_error_small(sqrt(x * x + y * y + z * z)):
                self._refixations.interrupt()
                slip = self._pursuit.slip(self.point_m, point, velocity, p_head, known)
                if trigger.is_due(slip, t_s, self._pursuit.refractory_s):
                    shift_rad = self._start_saccade(point, p_head, t_s)
            elif (
                self._refixates
                and not self._exact
                and self._refixations.is_due(t_s, norm(velocity) <= _SLOW_M_S)
            ):
                trigger.refixate(t_s)
            if shift_rad is None:
                if dt_s > 0.0 and self._pursuit.controller is None:
                    closing = not (trigger.is_correction_due or trigger.is_saccade_due)
                    self.point_m = self._pursuit.follow(
                        gaze, there, point, velocity, p_head, dt_s, closing, known
                    )
                return None
        elif trigger.may_redirect(t_s):
            end = add(point, scale(velocity, trajectory.ends_s - t_s))
            end = keep_min_distance(end, p_head, NEAREST_M)
            self._trajectory = RedirectedTrajectory(trajectory, self._saccade, end, p_head, t_s)
        trajectory = self._trajectory
        assert trajectory is not None
        self.point_m = trajectory.point_at(p_head, t_s)
        if t_s >= trajectory.ends_s - 1e-9:
            self._trajectory = None
            trigger.record_landing(t_s, self._correction_delay_s(norm(velocity) > MOVING_M_S))
            self.fixations += 1
        return shift_rad

    def _start_saccade(self, point: Vec3, p_head: Vec3, t_s: float) -> float:
        """Start a saccade; return its amplitude in radians."""
        error = angle_between(sub(self.point_m, p_head), sub(point, p_head))
        after_s = t_s + self._saccade.profile.duration_s(error)
        moved, until = self._prediction.displacement(t_s), self._prediction.displacement(after_s)
        end = keep_min_distance(add(point, sub(until, moved)), p_head, NEAREST_M)
        if self._people and not self._exact:
            end = endpoint(end, self.point_m, p_head, self._rng)
        self._trajectory = SaccadeTrajectory(self._saccade, self.point_m, end, p_head, t_s)
        self.saccades += 1
        return error

    def _correction_delay_s(self, moves: bool) -> float:
        """Draw the delay of a correction of this landing's error; ``moves``: the target does."""
        if not self._people:
            return 0.0
        mean_s, spread_s = _CATCH_UP_S if moves else _CORRECT_S
        return mean_s + spread_s * float(self._rng.uniform(-1.0, 1.0))


def _offset_point(point: Vec3, eye: Vec3, offset: Angles2) -> Vec3:
    """Return a point next to another one at its distance, by angles to the left and up."""
    way = sub(point, eye)
    yaw, pitch = yaw_pitch(way)
    return add(eye, scale(direction((yaw + offset[0], pitch + offset[1])), norm(way)))


_UNDERSHOOT = 0.08
"""Share of its amplitude by which a saccade of 10 deg or more falls short; people's is .05-.10."""
_FULL_DEG, _NONE_DEG = 10.0, 5.0
"""Saccades have the full undershoot from the first amplitude on, and none up to the second."""
_ALONG, _ACROSS = 0.04, 0.02
"""Scatter of endpoints along and across the path, standard deviation as a share of the amplitude;
people's are .03-.05 and .02."""


def endpoint(end: Vec3, start: Vec3, eye: Vec3, rng: np.random.Generator) -> Vec3:
    """Return the landing point of a saccade from a point to another one, all in the world."""
    a, b = sub(start, eye), sub(end, eye)
    amplitude = angle_between(a, b)
    far = (degrees(amplitude) - _NONE_DEG) / (_FULL_DEG - _NONE_DEG)
    further, across = (float(n) for n in rng.standard_normal(2))
    along = -_UNDERSHOOT * min(1.0, max(0.0, far)) + _ALONG * further
    way = offset_direction(unit(b), unit(a), along * amplitude, _ACROSS * across * amplitude)
    return add(eye, scale(way, norm(b)))


_TRIES = 12
_LEAST_RAD, _MOST_RAD = radians(1.15), radians(1.7)
"""Sizes of re-fixations; smaller ones are hidden by servo steps and play."""
_AFTER_S, _SPREAD_S = 0.5, 1.1
"""Shortest rest of the gaze before a re-fixation, and the random time by which it is extended."""


class Refixations:
    """Successive gaze points about the middle of a target.

    offset_rad: offset of the present point, to the left and up; (0, 0): the middle itself
    """

    def __init__(self, rng: np.random.Generator) -> None:
        self._rng = rng
        self.reset()

    def reset(self) -> None:
        """Look at the middle of a new target."""
        self.offset_rad: Angles2 = (0.0, 0.0)
        self._due_s = inf

    def interrupt(self) -> None:
        """Restart the rest, because the gaze has moved."""
        self._due_s = inf

    def is_due(self, t_s: float, still: bool = True) -> bool:
        """Return whether another point must be chosen now; call it in every tick of a rest.

        still: whether the target is at rest; a moving one is only followed
        """
        if t_s < self._due_s:
            if self._due_s == inf:
                self._due_s = t_s + _AFTER_S + _SPREAD_S * float(self._rng.random())
            return False
        self._due_s = inf
        return still and self._choose()

    def _choose(self) -> bool:
        """Draw a point near the middle, one step away from the last."""
        across, up = self.offset_rad
        radius = 0.75 * _MOST_RAD
        for _ in range(_TRIES):
            r, angle = radius * sqrt(self._rng.random()), 2.0 * pi * self._rng.random()
            x, y = r * cos(angle), r * sin(angle)
            if _LEAST_RAD <= hypot(x - across, y - up) <= _MOST_RAD:
                self.offset_rad = (x, y)
                return True
        return False
