"""Oculomotor control: converts a target to head, eye and lid angles, tick by tick.

Gaze is planned in space and the eyes take the remainder: E = gaze - head. So every motion of the
head during or after a gaze shift, planned or caused by a push, is compensated exactly (the
vestibulo-ocular reflex), and vergence follows from each eye's own geometry.
"""

from math import radians

import numpy as np

from gazerig.gaze.angles import (
    add,
    angle_between,
    keep_min_distance,
    norm,
    scale,
    sub,
    unit,
)
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.oculomotor.binocular import NEAREST_M, EyeGeometry
from gazerig.gaze.oculomotor.drift import Drift
from gazerig.gaze.oculomotor.gaze_point import MOVING_M_S, GazePoint, OculomotorParams
from gazerig.gaze.oculomotor.head import HeadModel
from gazerig.gaze.oculomotor.pursuit import FASTEST_SWING_RAD_S, Pursuit
from gazerig.gaze.oculomotor.saccade import SaccadeModel
from gazerig.gaze.oculomotor.target_prediction import TargetPrediction
from gazerig.gaze.track.track import EYES, HEAD, LIDS, NO_OFFSET, PoseOffset
from gazerig.gaze.types import (
    ORDERED,
    Angles2,
    Angles3,
    GazeCommand,
    GazeState,
    HeadGeometry,
    LimitedAngle,
    Mat3,
    Phase,
    Target,
    Vec3,
)

_AT_END = "at the end of its range"
_NEARER = 1.5
"""Range of an eye that a near target takes, as a multiple of each eye's convergence: eyes ahead of
the neck's axis see it farther aside, by half the convergence at 25 deg, whatever its distance."""

_Seen = tuple[Vec3, Vec3, Vec3, Vec3, bool]
"""The target at this tick: its point and velocity, the goal point of the head, the vector from
midway between the eyes to the first, and whether that goal point moves with it."""
_SWING_RAD = radians(12.0)
"""The head stays at the centre of smaller swings, and pursues larger ones."""


class Oculomotor:
    """Composes saccades, following, head and lids.

    Args:
        params: thresholds and times.
        geometry: geometry of head and eyes.
        eye_limits: limits of left and right eye, ((yaw low, high), (pitch low, high)), rad.
        saccade: the model of saccades.
        pursuit: the model of pursuit.
        head: the model of head movements.
        lids: the model of lids and blinks.
        rng: random generator of endpoints and re-fixations.
        drift: moves the head a little at rest; None: no drift.
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
        rng: np.random.Generator,
        drift: Drift | None = None,
    ) -> None:
        self._prediction = TargetPrediction()
        self._gaze = GazePoint(params, saccade, pursuit, self._prediction, rng)
        self.retune(params, eye_limits)
        self._geometry = geometry
        self._pursuit = pursuit
        self._head = head
        self._lids = lids
        self._drift = drift
        self._started = False

    def retune(
        self,
        params: OculomotorParams,
        eye_limits: tuple[tuple[Angles2, Angles2], tuple[Angles2, Angles2]],
    ) -> None:
        """Change laws and ranges; a saccade in flight continues to its end."""
        self._gaze.retune(params)
        self._eye_limits, self._lag_s = eye_limits, params.eye_lag_ms / 1e3
        self._yaw_limit_rad = min(abs(end) for yaw, _ in eye_limits for end in yaw)
        self._prediction.retune(params.law == "people", self._lag_s)

    def reset(self, t_s: float, state: GazeState) -> None:
        """Start from the present angles of head and eyes."""
        self._head.reset(t_s, state.head_rad)
        self._lids.reset(t_s)
        if self._drift is not None:
            self._drift.reset(t_s)
        self._prediction.reset()
        self._pursuit.reset()
        self._gaze.reset(t_s, _meeting_point(state))
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
        dt_s: time since the last step
        offset: offset by tracks and expressions
        """
        if not self._started:
            self.reset(t_s, state)
        R_world_head, p_head = self._predict_head(state)
        point, velocity, centre_point, toward, moves = self._predict_target(target, p_head, t_s)
        facing = centre = self._geometry.neck_angles_to(point)
        if centre_point is not point:
            centre = self._geometry.neck_angles_to(centre_point)
        ahead = R_world_head[0][0], R_world_head[1][0], R_world_head[2][0]
        aside_rad = angle_between(ahead, toward)
        place, eyes_on = self._gaze, self._geometry.eye_angles_to
        both_rad = self._both_eyes_rad(norm(toward))
        if target.shift != place.shift:
            off_rad = angle_between(sub(place.point_m, p_head), toward)
            self._record_shift(target, aside_rad, off_rad, both_rad, t_s)
        jumps = place.is_in_saccade
        shift_rad = place.move(point, velocity, p_head, t_s, dt_s)
        soon = None
        if moves and (ahead_s := self._head.foresees_s) > 0.0:
            soon = self._geometry.neck_angles_to(add(centre_point, scale(velocity, ahead_s)))
        since_s = t_s - place.onset_s
        head = self._head.step(target, centre, facing, aside_rad, since_s, t_s, soon, both_rad)
        wanted = eyes_on(place.point_m, R_world_head, p_head)
        if (controller := self._pursuit.controller) is not None:
            jumps = jumps or shift_rad is not None
            view = EyeGeometry(R_world_head, p_head, eyes_on, self._clip_eyes)
            wanted, place.point_m = controller.fixate(
                target, place.point_m, wanted if jumps else None, place, view, t_s, dt_s
            )
        wanted = _move_eye(wanted[0], offset), _move_eye(wanted[1], offset)
        left, right = self._clip_eyes(wanted)
        limited = () if (left, right) == wanted else self._limited_angles(wanted, head, facing)
        lids = self._lids.step(t_s, 0.5 * (left[1] + right[1]), shift_rad)
        lids = lids.change(offset.factors[LIDS], offset.added[LIDS])
        head = self._move_head(head, offset, t_s)
        phase: Phase = (
            "saccade" if place.is_in_saccade
            else "pursue" if norm(velocity) > MOVING_M_S
            else "fixate"
        )  # fmt: skip
        return GazeCommand(
            head, left, right, lids.left, lids.right, phase, lids.blink, place.point_m,
            place.saccades, place.fixations, self._lids.blinks, lids.lower_left,
            lids.lower_right, limited,
        )  # fmt: skip

    def resting_gaze(self, target: Target) -> tuple[Angles3, tuple[Angles2, Angles2]]:
        """Return (yaw, pitch, roll) of the head, and both eyes, at rest on a fixed point."""
        facing = self._geometry.neck_angles_to(target.p_world_m)
        p_head = self._geometry.head_pose((*facing, 0.0))[1]
        point = keep_min_distance(target.p_world_m, p_head, NEAREST_M)
        both_rad = self._both_eyes_rad(norm(sub(point, p_head)))
        head = self._head.destination_rad(target, facing, both_rad)
        R_world_head, p_head = self._geometry.head_pose(head)
        point = keep_min_distance(target.p_world_m, p_head, NEAREST_M)
        return head, self._clip_eyes(self._geometry.eye_angles_to(point, R_world_head, p_head))

    @property
    def has_arrived(self) -> bool:
        """Return whether the gaze has arrived: no saccade to a new target is due or in flight."""
        return self._gaze.has_arrived

    def speak(self, loudness: float | None) -> None:
        """Move the head as a speaker does, by a loudness 0..1, or, for None, as a silent person."""
        if self._drift is not None:
            self._drift.speak(loudness)

    def _both_eyes_rad(self, distance_m: float) -> float:
        """Return the eccentricity up to which both eyes converge on a point at a distance."""
        return self._yaw_limit_rad - _NEARER * self._geometry.convergence_rad(distance_m)

    def _record_shift(
        self, target: Target, aside_rad: float, off_rad: float, both_rad: float, t_s: float
    ) -> None:
        """Record a new target; the lids draw the blink that comes with its saccade, or its bend.

        aside_rad, off_rad: angles of the target from the head's facing direction, and from the gaze
        both_rad: eccentricity up to which both eyes converge on it
        """
        gaze = self._gaze
        waits = gaze.is_saccade_due
        wait_s = self._head.draw_lead_s(target, aside_rad, both_rad)
        gaze.record_shift(target.shift, wait_s, t_s, target.kind == ORDERED)
        if waits:
            return
        if not gaze.is_in_saccade:
            wait_s = self._lids.draw_blink_of_shift(off_rad, gaze.onset_s, t_s)
            if wait_s > 0.0:
                gaze.postpone(wait_s)
        elif gaze.onset_s <= t_s:
            self._lids.draw_blink_of_shift(off_rad, t_s, t_s)

    def _clip_eyes(self, eyes: tuple[Angles2, Angles2]) -> tuple[Angles2, Angles2]:
        """Return the angles of both eyes clipped to their ranges; the same object if unclipped."""
        (left_yaw, left_pitch), (right_yaw, right_pitch) = eyes
        left, right = self._eye_limits
        (yaw_low, yaw_high), (pitch_low, pitch_high) = left
        if yaw_low <= left_yaw <= yaw_high and pitch_low <= left_pitch <= pitch_high:
            (yaw_low, yaw_high), (pitch_low, pitch_high) = right
            if yaw_low <= right_yaw <= yaw_high and pitch_low <= right_pitch <= pitch_high:
                return eyes
        return _clip(eyes[0], left), _clip(eyes[1], right)

    def _limited_angles(
        self, wanted: tuple[Angles2, Angles2], head: Angles3, facing: Angles2
    ) -> tuple[LimitedAngle, ...]:
        """Return the angles that the ranges of eyes and neck cut off."""
        eyes = self._clip_eyes(wanted)
        rows = (("left eye", wanted[0], eyes[0]), ("right eye", wanted[1], eyes[1]))
        found = [
            LimitedAngle(f"{name} {axis}", asked[i], done[i], _AT_END)
            for name, asked, done in rows
            for i, axis in enumerate(("yaw", "pitch"))
            if asked[i] != done[i]
        ]
        for i, axis in enumerate(("yaw", "pitch")):
            low, high = self._head.range_rad[i]
            if not low < head[i] < high and not low <= facing[i] <= high:
                found.append(LimitedAngle(f"head {axis}", facing[i], head[i], _AT_END))
        return tuple(found)

    def _move_head(self, head: Angles3, offset: PoseOffset, t_s: float) -> Angles3:
        """Return the head's angles with drift and offset, clipped to the neck's range."""
        if self._drift is not None:
            head = add(head, self._drift.step(t_s))
        yaw, pitch, roll = offset.change(HEAD, head)
        return self._head.clip_to_range((yaw, pitch, roll))

    def _predict_head(self, state: GazeState) -> tuple[Mat3, Vec3]:
        """Return the head's pose at the time when a present eye command takes effect."""
        lag = self._lag_s
        (yaw, pitch, roll), (yaw_rate, pitch_rate, roll_rate) = (
            state.head_rad,
            state.head_rate_rad_s,
        )
        return self._geometry.head_pose(
            (yaw + yaw_rate * lag, pitch + pitch_rate * lag, roll + roll_rate * lag)
        )

    def _predict_target(self, target: Target, p_head: Vec3, t_s: float) -> _Seen:
        """Return the target at its predicted present position."""
        prediction = self._prediction
        prediction.record_target(target, p_head, FASTEST_SWING_RAD_S)
        moved, velocity = prediction.motion(t_s)
        p, centre = target.p_world_m, target.centre_world_m
        point = keep_min_distance(add(p, moved), p_head, NEAREST_M)
        middle, toward, moves = (
            prediction.to_middle,
            sub(point, p_head),
            norm(velocity) > MOVING_M_S,
        )
        if middle is not None and prediction.size_m <= _SWING_RAD * norm(toward):
            moves = False
            head_point = keep_min_distance(
                add(p if centre is None else centre, middle), p_head, NEAREST_M
            )
        elif centre is None:
            head_point = point
        else:
            head_point = keep_min_distance(add(centre, moved), p_head, NEAREST_M)
        return point, velocity, head_point, toward, moves


def _clip(eye: Angles2, limits: tuple[Angles2, Angles2]) -> Angles2:
    (yaw_low, yaw_high), (pitch_low, pitch_high) = limits
    return (min(max(eye[0], yaw_low), yaw_high), min(max(eye[1], pitch_low), pitch_high))


def _move_eye(eye: Angles2, offset: PoseOffset) -> Angles2:
    yaw, pitch = offset.change(EYES, eye)
    return yaw, pitch


def _meeting_point(state: GazeState) -> Vec3:
    """Return a point 1 m along the mean of the measured lines of sight."""
    way = unit(add(line_of_sight(state, left=True), line_of_sight(state, left=False)))
    return add(state.p_world_head_m, way)
