"""Oculomotor control: a target in, head, eye and lid angles out, tick by tick.

Gaze is planned in space and the eyes take what the head does not: E = gaze - head. So
whatever the head does during or after a gaze shift, planned or pushed, is compensated
exactly (the vestibulo-ocular reflex), and vergence comes from each eye's own geometry.
"""

from dataclasses import dataclass
from math import sqrt
from typing import Annotated, NamedTuple, Protocol

import numpy as np

from gazerig.gaze.angles import add, angle_between, no_nearer, norm, sub, unit
from gazerig.gaze.animation import NO_OFFSET, PoseOffset
from gazerig.gaze.binocular import HeadView
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.head import HeadModel
from gazerig.gaze.lids import Lids
from gazerig.gaze.pursuit import Pursuit, sight
from gazerig.gaze.saccade import SaccadeModel
from gazerig.gaze.saccade_trajectory import SaccadeTrajectory, scattered_endpoint
from gazerig.gaze.saccade_trigger import SaccadeTrigger, SaccadeTriggerParams
from gazerig.gaze.target_prediction import PredictionModel, TargetPrediction
from gazerig.gaze.types import (
    Angles2,
    Angles3,
    GazeCommand,
    GazeState,
    HeadGeometry,
    Limited,
    Mat3,
    Phase,
    Target,
    Vec3,
)
from gazerig.params import Bounds

_AT_END = "at the end of its range"
_MOVING_M_S = 0.05
"""A target slower than this is fixated, not pursued."""


@dataclass(frozen=True)
class OculomotorParams(SaccadeTriggerParams):
    """Saccade trigger, prediction horizon and endpoint scatter."""

    # fmt: off
    prediction_horizon_ms: Annotated[float, Bounds(0, 2000),
        "longest time over which a target's position is extrapolated with its velocity"] = 120.0
    fade_ms: Annotated[float, Bounds(1, 5000), "time constant with which that velocity decays after that time"] = 300.0
    target_prediction: Annotated[PredictionModel,
        "where a target is expected: where its frame showed it, moved on with its velocity, or along its curve and its swing, "
        "which is recognised after one to two cycles"] = "periodic"
    eye_lag_ms: Annotated[float, Bounds(0, 200), "delay from command to motion of an eye; the head's motion during it is predicted"] = 15.0
    nearest_m: Annotated[float, Bounds(0.05, 2), "nearest distance on which the eyes converge (0.2 m is 17.6 deg of vergence)"] = 0.2
    endpoint_scatter_along: Annotated[float, Bounds(0, 0.2),
        "scatter of saccade endpoints along the path, standard deviation as a share of the amplitude; people .03-.05"] = 0.0
    endpoint_scatter_across: Annotated[float, Bounds(0, 0.2),
        "scatter of saccade endpoints across the path, standard deviation as a share of the amplitude; people .02"] = 0.0
    # fmt: on


class Sway(Protocol):
    """A motion added to the head's angles: breathing."""

    def reset(self, t_s: float) -> None:
        """Start from rest."""
        ...

    def step(self, t_s: float) -> Angles3:
        """Return (yaw, pitch, roll) to add to the head's angles."""
        ...


_Seen = tuple[Vec3, Vec3, Vec3, Vec3]
"""The target at this tick: its point and velocity, the point that the head turns to, and the way
from between the eyes to the first."""


class ReachableGaze(NamedTuple):
    """Where head and eyes come to rest for a point, and the eye angles that it would need.

    facing_rad, head_rad: (yaw, pitch, roll) that face it, and where the head stops
    asked_eyes_rad, eyes_rad: left and right (yaw, pitch) from there, and as far as they go
    too_near: the point is nearer than the eyes converge on
    base_rad: (yaw, pitch) of a lower neck meanwhile
    """

    facing_rad: Angles3
    head_rad: Angles3
    asked_eyes_rad: tuple[Angles2, Angles2]
    eyes_rad: tuple[Angles2, Angles2]
    too_near: bool
    base_rad: Angles2 = (0.0, 0.0)


class Oculomotor:
    """Composes saccades, following, head and lids.

    Args:
        params: thresholds and times.
        geometry: of head and eyes.
        eye_limits: for left and right eye, ((yaw low, high), (pitch low, high)), rad.
        saccade: the model of saccades.
        pursuit: the model of pursuit.
        head: the model of head movements.
        lids: the model of lids and blinks.
        breathing: sways the head; None: it does not.
        rng: random generator of the endpoint scatter.

    Raises:
        ValueError: endpoints are to scatter and there is no rng.
    """

    def __init__(
        self,
        params: OculomotorParams,
        geometry: HeadGeometry,
        eye_limits: tuple[tuple[Angles2, Angles2], tuple[Angles2, Angles2]],
        saccade: SaccadeModel,
        pursuit: Pursuit,
        head: HeadModel,
        lids: Lids,
        breathing: Sway | None = None,
        rng: np.random.Generator | None = None,
    ) -> None:
        self._rng = rng
        self._trigger = SaccadeTrigger(params, False)
        self._prediction = TargetPrediction("none", 0.0, 1.0)
        self.retune(params, eye_limits)
        self._geometry = geometry
        self._saccade = saccade
        self._pursuit = pursuit
        self._head = head
        self._lids = lids
        self._breathing = breathing
        self._started = False
        self._base_rad: Angles2 = (0.0, 0.0)

    def retune(
        self,
        params: OculomotorParams,
        eye_limits: tuple[tuple[Angles2, Angles2], tuple[Angles2, Angles2]],
    ) -> None:
        """Change thresholds, durations and ranges; a saccade under way goes on to its end.

        Raises:
            ValueError: endpoints are to scatter and there is no rng.
        """
        scatter = (params.endpoint_scatter_along, params.endpoint_scatter_across)
        if any(scatter) and self._rng is None:
            raise ValueError(
                "endpoint_scatter_along and endpoint_scatter_across need a random generator: give rng"
            )
        self._params, self._scatter, self._eye_limits = params, scatter, eye_limits
        self._lag_s, self._nearest_m = params.eye_lag_ms / 1e3, params.nearest_m
        self._prediction.retune(
            params.target_prediction, params.prediction_horizon_ms / 1e3, params.fade_ms / 1e3
        )
        self._trigger.retune(params, any(scatter))

    def reset(self, t_s: float, state: GazeState) -> None:
        """Start from the present angles of head and eyes."""
        self._head.reset(t_s, state.head_rad)
        self._lids.reset(t_s)
        if self._breathing is not None:
            self._breathing.reset(t_s)
        self._trigger.reset(t_s)
        self._prediction.reset()
        self._pursuit.binocular.reset()
        self._gaze = _meeting_point(state)
        self._trajectory: SaccadeTrajectory | None = None
        self.saccades = self.fixations = 0
        self._started = True

    def step(
        self,
        target: Target,
        state: GazeState,
        t_s: float,
        dt_s: float,
        offset: PoseOffset = NO_OFFSET,
    ) -> GazeCommand:
        """Return the command for this tick.

        state: head and eyes as measured now
        dt_s: time since the step before
        offset: what gestures and expressions add
        """
        if not self._started:
            self.reset(t_s, state)
        R_world_head, p_head = self._foreseen_head(state)
        seen = self._now(target, p_head, t_s)
        point, velocity, centre_point, toward = seen
        self._base_rad = base = state.base_rad
        facing = centre = self._geometry.facing(point, base)
        if centre_point is not point:
            centre = self._geometry.facing(centre_point, base)
        ahead = R_world_head[0][0], R_world_head[1][0], R_world_head[2][0]
        aside_rad = angle_between(ahead, toward)
        trigger = self._trigger
        if target.shift != trigger.shift:
            free_s = self._trajectory.ends_s if self._trajectory else t_s
            trigger.record_shift(target.shift, self._head.leads_s(target, aside_rad), free_s, t_s)
        jumps = self._trajectory is not None
        shift_rad = self._move_gaze(seen, p_head, t_s, dt_s)
        head = self._head.step(target, centre, facing, aside_rad, t_s - trigger.onset_s, t_s)
        wanted = self._geometry.eyes_on(self._gaze, R_world_head, p_head)
        if self._pursuit.is_binocular:
            jumps = jumps or shift_rad is not None
            view = HeadView(R_world_head, p_head, self._geometry.eyes_on, self._nearest_m)
            wanted, self._gaze = self._pursuit.binocular.fixate(
                target, self._gaze, wanted if jumps else None, trigger, view, t_s, dt_s
            )
        if offset.eyes_rad != NO_OFFSET.eyes_rad:
            wanted = _turned(wanted[0], offset.eyes_rad), _turned(wanted[1], offset.eyes_rad)
        left, right = eyes = self._in_range(wanted)
        limited = () if eyes == wanted else self._limited(wanted, head, facing)
        lids = self._lids.step(t_s, 0.5 * (left[1] + right[1]), shift_rad)
        if offset.lids != NO_OFFSET.lids:
            lids = lids.scaled(offset.lids)
        head = self._swayed(head, offset.head_rad, t_s)
        phase: Phase = (
            "saccade" if self._trajectory
            else "pursue" if norm(velocity) > _MOVING_M_S
            else "fixate"
        )  # fmt: skip
        # Without the call of a function written in Python that the class itself would cost.
        return tuple.__new__(
            GazeCommand,
            (
                head, left, right, lids.left, lids.right, phase, lids.blink, self._gaze,
                self.saccades, self.fixations, self._lids.blinks, lids.lower_left,
                lids.lower_right, limited,
            ),
        )  # fmt: skip

    def reach(self, target: Target) -> ReachableGaze:
        """Return where head and eyes come to rest for a point that stands still."""
        facing = self._geometry.facing(target.p_world_m, self._base_rad)
        head = self._head.destination_rad(target, facing)
        R_world_head, p_head = self._geometry.head_pose(head, self._base_rad)
        exact = self._geometry.eyes_on(target.p_world_m, R_world_head, p_head)
        point = self._clear(target.p_world_m, p_head)
        left, right = self._in_range(self._geometry.eyes_on(point, R_world_head, p_head))
        return ReachableGaze(
            (*facing, 0.0), head, exact, (left, right), point != target.p_world_m, self._base_rad
        )

    @property
    def ranges_rad(self) -> tuple[tuple[Angles2, Angles2], ...]:
        """Return ((yaw low, high), (pitch low, high)) of left eye, right eye and head."""
        return (*self._eye_limits, self._head.range_rad)

    def _in_range(self, eyes: tuple[Angles2, Angles2]) -> tuple[Angles2, Angles2]:
        """Return the angles of both eyes clipped to their ranges; the same where nothing is."""
        (left_yaw, left_pitch), (right_yaw, right_pitch) = eyes
        left, right = self._eye_limits
        (yaw_low, yaw_high), (pitch_low, pitch_high) = left
        if yaw_low <= left_yaw <= yaw_high and pitch_low <= left_pitch <= pitch_high:
            (yaw_low, yaw_high), (pitch_low, pitch_high) = right
            if yaw_low <= right_yaw <= yaw_high and pitch_low <= right_pitch <= pitch_high:
                return eyes
        return _clip(eyes[0], left), _clip(eyes[1], right)

    def _limited(
        self, wanted: tuple[Angles2, Angles2], head: Angles3, facing: Angles2
    ) -> tuple[Limited, ...]:
        """Return the angles that the ranges of eyes and neck cut off."""
        eyes = self._in_range(wanted)
        rows = (("left eye", wanted[0], eyes[0]), ("right eye", wanted[1], eyes[1]))
        found = [
            Limited(f"{name} {axis}", asked[i], done[i], _AT_END)
            for name, asked, done in rows
            for i, axis in enumerate(("yaw", "pitch"))
            if asked[i] != done[i]
        ]
        for i, axis in enumerate(("yaw", "pitch")):
            low, high = self._head.range_rad[i]
            if not low < head[i] < high and not low <= facing[i] <= high:
                found.append(Limited(f"head {axis}", facing[i], head[i], _AT_END))
        return tuple(found)

    def _swayed(self, head: Angles3, offset: Angles3, t_s: float) -> Angles3:
        """Return the head's angles with breathing and an offset, clipped to the neck's range."""
        if self._breathing is not None:
            yaw, pitch, roll = self._breathing.step(t_s)
            head = head[0] + yaw, head[1] + pitch, head[2] + roll
        elif offset == NO_OFFSET.head_rad:
            return head
        return self._head.in_range((head[0] + offset[0], head[1] + offset[1], head[2] + offset[2]))

    def _foreseen_head(self, state: GazeState) -> tuple[Mat3, Vec3]:
        """Return the head's pose at the time when an eye command of now takes effect."""
        lag = self._lag_s
        (yaw, pitch, roll), (yaw_rate, pitch_rate, roll_rate) = state[:2]
        base, turning = state.base_rad, state.base_rate_rad_s
        if turning != (0.0, 0.0):
            base = base[0] + turning[0] * lag, base[1] + turning[1] * lag
        return self._geometry.head_pose(
            (yaw + yaw_rate * lag, pitch + pitch_rate * lag, roll + roll_rate * lag), base
        )

    def _now(self, target: Target, p_head: Vec3, t_s: float) -> _Seen:
        """Return the target where it is predicted to be now."""
        prediction = self._prediction
        prediction.see(target, p_head, self._pursuit.fastest_swing_rad_s)
        moved, velocity = prediction.displacement(t_s), prediction.velocity(t_s)
        p, centre = target.p_world_m, target.centre_world_m
        point = self._clear(add(p, moved), p_head)
        middle = prediction.to_middle
        if middle is not None:
            head_point = self._clear(add(p if centre is None else centre, middle), p_head)
        elif centre is None:
            head_point = point
        else:
            head_point = self._clear(add(centre, moved), p_head)
        return point, velocity, head_point, sub(point, p_head)

    def _clear(self, point: Vec3, p_head: Vec3) -> Vec3:
        """Return a point moved away to ``nearest_m`` where it is nearer."""
        return no_nearer(point, p_head, self._nearest_m)

    def _move_gaze(self, seen: _Seen, p_head: Vec3, t_s: float, dt_s: float) -> float | None:
        """Move the gaze point along a saccade, or after the target.

        Returns:
            The amplitude of the saccade that starts now, radians; None where none does.
        """
        shift_rad = None
        if self._trajectory is None:
            point, velocity, _, _ = seen
            gaze, there = sight(self._gaze, p_head), sight(point, p_head)
            x, y, z = there[0] - gaze[0], there[1] - gaze[1], there[2] - gaze[2]
            trigger = self._trigger
            if not trigger.rests(sqrt(x * x + y * y + z * z)):
                slip = self._pursuit.slip(self._gaze, point, velocity, p_head)
                if trigger.due(slip, t_s):
                    shift_rad = self._jump(seen, p_head, t_s)
            if shift_rad is None:
                if not trigger.waits and dt_s > 0.0 and not self._pursuit.is_binocular:
                    closing = not trigger.corrects
                    self._gaze = self._pursuit.follow(
                        gaze, there, point, velocity, p_head, dt_s, closing
                    )
                return None
        trajectory = self._trajectory
        assert trajectory is not None
        self._gaze = trajectory.at(p_head, t_s)
        if trajectory.landed(t_s):
            self._trajectory = None
            self._trigger.record_landing(t_s)
            self.fixations += 1
        return shift_rad

    def _jump(self, seen: _Seen, p_head: Vec3, t_s: float) -> float:
        """Start a saccade; return its amplitude in radians."""
        point = seen[0]
        error = angle_between(sub(self._gaze, p_head), sub(point, p_head))
        after_s = t_s + self._saccade.duration_s(error)
        moved, until = self._prediction.displacement(t_s), self._prediction.displacement(after_s)
        end = add(point, sub(until, moved))
        end = self._clear(end, p_head)
        if self._rng is not None and any(self._scatter):
            end = scattered_endpoint(end, self._gaze, p_head, *self._scatter, self._rng)
        self._trajectory = SaccadeTrajectory(self._saccade, self._gaze, end, p_head, t_s)
        self.saccades += 1
        return error


def _clip(eye: Angles2, limits: tuple[Angles2, Angles2]) -> Angles2:
    """Return eye angles clipped to their range."""
    (yaw_low, yaw_high), (pitch_low, pitch_high) = limits
    return (min(max(eye[0], yaw_low), yaw_high), min(max(eye[1], pitch_low), pitch_high))


def _turned(eye: Angles2, offset: Angles2) -> Angles2:
    """Return an eye's angles with an offset."""
    return eye[0] + offset[0], eye[1] + offset[1]


def _meeting_point(state: GazeState) -> Vec3:
    """Return a point 1 m along the mean of the measured lines of sight."""
    way = unit(add(line_of_sight(state, left=True), line_of_sight(state, left=False)))
    return add(state.p_world_head_m, way)
