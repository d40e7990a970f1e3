"""Turns a target into head, eye and lid angles, tick by tick; the one file that knows all.

Gaze is planned in space and the eyes take what the head does not: E = gaze - head. So
whatever the head does during or after a gaze shift, planned or pushed, is compensated
exactly (the vestibulo-ocular reflex), and vergence comes from each eye's own geometry.
"""

from dataclasses import dataclass, field
from math import radians
from typing import NamedTuple

from gaze.angles import add, along_great_circle, angle_between, norm, rotate, scale, sub, unit
from gaze.field_of_view import line_of_sight
from gaze.head import Head
from gaze.lids import Lids
from gaze.pursuit import Pursuit
from gaze.saccade import Saccade
from gaze.types import (
    Angles2,
    Angles3,
    GazeCommand,
    GazeState,
    HeadGeometry,
    Mat3,
    Phase,
    Target,
    Vec3,
)


@dataclass(frozen=True)
class OculomotorParams:
    """When to jump, and how to bridge delays."""

    saccade_deg: float = field(
        default=2.0,
        metadata={
            "low": 0.1,
            "high": 30.0,
            "unit": "deg",
            "says": "error that is closed by a saccade instead of smooth following",
        },
    )
    smallest_shift_deg: float = field(
        default=0.3,
        metadata={
            "low": 0.0,
            "high": 10.0,
            "unit": "deg",
            "says": "a new target nearer than this needs no saccade",
        },
    )
    refractory_ms: float = field(
        default=150.0,
        metadata={
            "low": 0.0,
            "high": 2000.0,
            "unit": "ms",
            "says": "pause before an error alone may bring the next saccade",
        },
    )
    extrapolate_ms: float = field(
        default=200.0,
        metadata={
            "low": 0.0,
            "high": 2000.0,
            "unit": "ms",
            "says": "longest time for which a target is moved on by its own velocity",
        },
    )
    eye_lag_ms: float = field(
        default=15.0,
        metadata={
            "low": 0.0,
            "high": 200.0,
            "unit": "ms",
            "says": "time from command to motion of an eye; the head's motion in it is foreseen",
        },
    )
    nearest_m: float = field(
        default=0.2,
        metadata={
            "low": 0.05,
            "high": 2.0,
            "unit": "m",
            "says": "no nearer point is converged on (0.2 m is 17.6 deg of vergence)",
        },
    )


class _Flight(NamedTuple):
    """A saccade under way: from and to points in the world, amplitude, onset."""

    start: Vec3
    end: Vec3
    amplitude_rad: float
    onset_s: float
    ends_s: float


class Oculomotor:
    """Composes saccades, following, head and lids."""

    def __init__(
        self,
        params: OculomotorParams,
        geometry: HeadGeometry,
        eye_limits: tuple[tuple[Angles2, Angles2], tuple[Angles2, Angles2]],
        saccade: Saccade,
        pursuit: Pursuit,
        head: Head,
        lids: Lids,
    ) -> None:
        """Take the models and, for left and right eye, ((yaw low, high), (pitch low, high))."""
        self._params = params
        self._geometry = geometry
        self._eye_limits = eye_limits
        self._saccade = saccade
        self._pursuit = pursuit
        self._head = head
        self._lids = lids
        self._started = False

    def reset(self, t_s: float, state: GazeState) -> None:
        """Begin where head and eyes are."""
        self._head.reset(t_s, state.head_rad)
        self._lids.reset(t_s)
        self._gaze = _meeting_point(state)
        self._flight: _Flight | None = None
        self._onset_s = self._landed_s = t_s
        self._shift: int | None = None
        self.saccades = self.fixations = 0
        self._started = True

    def step(self, target: Target, state: GazeState, t_s: float, dt_s: float) -> GazeCommand:
        """Give the command for this tick.

        state: head and eyes as measured now
        dt_s: time since the step before
        """
        if not self._started:
            self.reset(t_s, state)
        R_world_head, p_head = self._foreseen_head(state)
        ahead_s = min(max(0.0, t_s - target.at_s), self._params.extrapolate_ms / 1e3)
        point = self._clear(add(target.p_world_m, scale(target.v_world_m_s, ahead_s)), p_head)
        shift_rad = self._maybe_jump(target, point, p_head, t_s)
        self._move_gaze(point, target.v_world_m_s, p_head, t_s, dt_s)
        head = self._head.step(
            target,
            self._geometry.facing(point),
            angle_between(rotate(R_world_head, (1.0, 0.0, 0.0)), sub(point, p_head)),
            t_s - self._onset_s,
            t_s,
        )
        left, right = self._geometry.eyes_on(self._gaze, R_world_head, p_head)
        left, right = _clip(left, self._eye_limits[0]), _clip(right, self._eye_limits[1])
        lids = self._lids.step(t_s, 0.5 * (left[1] + right[1]), shift_rad)
        return self._command(head, left, right, lids, target)

    def _command(
        self,
        head: Angles3,
        left: Angles2,
        right: Angles2,
        lids: tuple[float, float, bool],
        target: Target,
    ) -> GazeCommand:
        moving = norm(target.v_world_m_s) > 0.05
        phase: Phase = "saccade" if self._flight else "pursue" if moving else "fixate"
        return GazeCommand(
            head,
            left,
            right,
            *lids[:2],
            phase,
            lids[2],
            self._gaze,
            self.saccades,
            self.fixations,
            self._lids.blinks,
        )

    def _foreseen_head(self, state: GazeState) -> tuple[Mat3, Vec3]:
        """Give the head's pose at the time when an eye command of now takes effect."""
        lag = self._params.eye_lag_ms / 1e3
        (yaw, pitch, roll), rates = state.head_rad, state.head_rate_rad_s
        return self._geometry.head_pose(
            (yaw + rates[0] * lag, pitch + rates[1] * lag, roll + rates[2] * lag)
        )

    def _clear(self, point: Vec3, p_head: Vec3) -> Vec3:
        """Keep a point far enough away to converge on."""
        rel = sub(point, p_head)
        if norm(rel) >= self._params.nearest_m:
            return point
        return add(p_head, scale(unit(rel), self._params.nearest_m))

    def _maybe_jump(self, target: Target, point: Vec3, p_head: Vec3, t_s: float) -> float | None:
        """Start a saccade when a new target or a large error asks for one; give its size."""
        if self._flight is not None:
            return None
        error = angle_between(sub(self._gaze, p_head), sub(point, p_head))
        par = self._params
        new = target.shift != self._shift
        if new:
            self._shift = target.shift
            self._onset_s = t_s
        rested = t_s - self._landed_s >= par.refractory_ms / 1e3
        large = error > radians(par.saccade_deg) and rested
        if not large and not (new and error > radians(par.smallest_shift_deg)):
            return None
        duration = self._saccade.duration_s(error)
        end = add(point, scale(target.v_world_m_s, duration))
        end = self._clear(end, p_head)
        amplitude = angle_between(sub(self._gaze, p_head), sub(end, p_head))
        self._flight = _Flight(
            self._gaze, end, amplitude, t_s, t_s + self._saccade.duration_s(amplitude)
        )
        self._onset_s = t_s
        self.saccades += 1
        return error

    def _move_gaze(self, point: Vec3, v_point: Vec3, p_head: Vec3, t_s: float, dt_s: float) -> None:
        """Move the gaze point along the saccade, or after the target."""
        flight = self._flight
        if flight is None:
            self._gaze = self._pursuit.step(self._gaze, point, v_point, p_head, dt_s)
            return
        done = self._saccade.displacement_rad(flight.amplitude_rad, t_s - flight.onset_s)
        share = done / flight.amplitude_rad if flight.amplitude_rad > 0.0 else 1.0
        # Both ends are seen from where the head is now, so the head's own motion
        # during the saccade bends nothing; vergence goes with the same profile.
        a, b = sub(flight.start, p_head), sub(flight.end, p_head)
        nearness = (1.0 - share) / norm(a) + share / norm(b)
        way = along_great_circle(unit(a), unit(b), share)
        self._gaze = add(p_head, scale(way, 1.0 / nearness))
        if t_s >= flight.ends_s - 1e-9:
            self._flight = None
            self._landed_s = t_s
            self.fixations += 1


def _clip(eye: Angles2, limits: tuple[Angles2, Angles2]) -> Angles2:
    """Keep an eye inside its range."""
    (yaw_low, yaw_high), (pitch_low, pitch_high) = limits
    return (min(max(eye[0], yaw_low), yaw_high), min(max(eye[1], pitch_low), pitch_high))


def _meeting_point(state: GazeState) -> Vec3:
    """Give a point 1 m along the mean of the measured lines of sight."""
    way = unit(add(line_of_sight(state, left=True), line_of_sight(state, left=False)))
    return add(state.p_world_head_m, way)
