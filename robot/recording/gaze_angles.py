"""Gaze angles of a run in degrees, one column each, as an eye tracker would measure them.

All exports use this definition. Angles are those of lines of sight in space, not in the head:

x  yaw, the rotation about the vertical axis of the world, + to the robot's own left
y  pitch above the horizontal, + up

0, 0 is horizontal and straight ahead of the base. The cyclopean gaze is the mean of both eyes'
unit lines of sight. These are Fick angles: a rotation in x of 1 deg moves the gaze by cos(y) deg.
An angle is NaN (the eye tracker's "lost") in a tick in which one of its servos did not answer,
and in all ticks if the rig lacks the joint. Angles of servos without feedback are estimated:
their goals, moved at the servos' known speeds.

The labels saccade, fixation, pursuit and blink are not detected: the models report their movement
in every tick. The servos follow the plan with a lag, so the plan is shifted by the lag at which it
best fits the measured gaze. Amplitudes and speeds are measured.
"""

from array import array
from collections.abc import Callable, Collection, Iterable
from math import degrees, nan
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.angles import add, angle_between, sub, yaw_pitch
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import Angles2, Floats, GazeState, Target, Vec3, body_name
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import Jog, Stop

Ints = NDArray[np.int64]
Basis = Literal["measured", "partly estimated", "estimated"]
ESTIMATED = "estimated from commands and known servo speeds, not measured"

MOVEMENTS = ("", "fixation", "saccade", "pursuit")
"""Movements of the eyes; "" if none of these: they were moved by hand or had no torque."""

_CODE = {"fixate": 1, "saccade": 2, "pursue": 3}
_ARRIVED_RAD = 0.009  # half a degree: a new target within this distance needs no saccade
NECK_AXES = ("neck_yaw", "neck_pitch", "neck_roll")
LID_JOINTS = ("left_upper_lid", "right_upper_lid", "left_lower_lid", "right_lower_lid")
_NECK = frozenset(NECK_AXES)
_BOTH = _NECK | {"eyes_pan", "eyes_tilt"}
_LEFT = _BOTH | {"left_eye_pan", "left_eye_tilt"}
_RIGHT = _BOTH | {"right_eye_pan", "right_eye_tilt"}
_LOST: Angles2 = (nan, nan)


class GazeDirections(NamedTuple):
    """Lines of sight in space: (x, y) each, degrees, + left and + up."""

    left_deg: Angles2
    right_deg: Angles2
    cyclopean_deg: Angles2


class GazeTarget(NamedTuple):
    """A target of the gaze: kind and id, and the part of a face, "" for other targets."""

    target: str
    part: str


class GazeAngles(NamedTuple):
    """The columns of a run of n ticks.

    Attributes:
        start_s: Clock of the rig at the first tick.
        time_s: (n,) Time since the first tick.
        left_deg, right_deg, cyclopean_deg: (n, 2) x and y at the servos' positions, NaN if lost.
        head_deg: (n, 3) Yaw + left, pitch + up, roll + right ear down, NaN without such a joint.
        lids: (n, 4) Upper left and right, lower left and right, 0 shut .. 1 open, NaN without such
            a joint.
        planned_deg: (n, 2) Desired cyclopean x and y.
        movement: (n,) Planned movement as an index in MOVEMENTS.
        blink: (n,) Whether a blink was planned.
        looked_at: (n,) Planned target as an index in ``names``.
        joints: Names of the rig's joints.
        estimated: Names of the joints whose servos have no feedback.
    """

    start_s: float
    time_s: Floats
    left_deg: Floats
    right_deg: Floats
    cyclopean_deg: Floats
    head_deg: Floats
    lids: Floats
    planned_deg: Floats
    movement: Ints
    blink: NDArray[np.bool_]
    looked_at: Ints
    names: tuple[GazeTarget, ...]
    joints: tuple[str, ...]
    estimated: tuple[str, ...]

    @property
    def rate_hz(self) -> float:
        """Return the median rate of the ticks."""
        return 1.0 / float(np.median(np.diff(self.time_s)))


def gaze_in_space(pose: GazeState) -> GazeDirections:
    """Return the directions of both eyes and of the cyclopean gaze in space."""
    left, right = line_of_sight(pose, left=True), line_of_sight(pose, left=False)
    return GazeDirections(_degrees(left), _degrees(right), _degrees(add(left, right)))


def collect_gaze_angles(ticks: Iterable[Tick]) -> GazeAngles:
    """Collect the columns of a run.

    Raises:
        ValueError: There are fewer than two ticks.
    """
    tracing = GazeAnglesBuilder()
    for tick in ticks:
        tracing.update(tick)
    return tracing.trace()


class GazeAnglesBuilder:
    """A builder of one run's columns, tick by tick; it needs about 200 bytes per tick."""

    def __init__(self) -> None:
        self._angles = array("d")
        self._codes = array("l")
        self._numbers: dict[GazeTarget, int] = {}
        self._start_s: float | None = None
        self._fixated: Target | None = None
        self._saccades = 0
        self._jogged = False
        self._led = ""
        self._joints: tuple[str, ...] = ()
        self._estimated: dict[str, None] = {}

    def update(self, tick: Tick) -> None:
        """Add a tick."""
        if self._start_s is None:
            self._start_s = tick.t_s
        pose, missing = tick.pose, tick.joints.missing
        left, right, cyclopean = gaze_in_space(pose)
        planned = _degrees(sub(tick.gaze.gaze_point_world_m, pose.p_world_head_m))
        lids = [pose.lid_left, pose.lid_right, pose.lower_left, pose.lower_right]
        head = tuple(map(degrees, pose.head_rad))
        self._joints = tick.guard_result.joints
        self._estimated.update(dict.fromkeys(tick.estimated_joints))
        if missing:
            lost_left, lost_right = not _LEFT.isdisjoint(missing), not _RIGHT.isdisjoint(missing)
            cyclopean = _LOST if lost_left or lost_right else cyclopean
            left, right = _LOST if lost_left else left, _LOST if lost_right else right
            head = (nan, nan, nan) if not _NECK.isdisjoint(missing) else head
            lids = [nan if n in missing else o for n, o in zip(LID_JOINTS, lids, strict=True)]
        time_s = tick.t_s - self._start_s
        self._angles.extend((time_s, *left, *right, *cyclopean, *head, *lids, *planned))
        for command in tick.commands:
            if isinstance(command, Jog):
                self._jogged = bool(command.angles_rad)
            elif isinstance(command, Stop):
                self._jogged = False
        if self._led and not tick.controlled_by:  # a timeout, for which there is no command
            self._jogged = False
        self._led = tick.controlled_by
        known = not (tick.stopped or self._jogged)
        movement = _CODE[tick.gaze.phase] if known else 0
        self._codes.extend((movement, tick.gaze.blink and known, self._number(tick)))

    def trace(self) -> GazeAngles:
        """Return the columns of the ticks added up to now.

        Raises:
            ValueError: There are fewer than two ticks.
        """
        a = np.array(self._angles).reshape(-1, 16)
        codes = np.array(self._codes, np.int64).reshape(-1, 3)
        if len(a) < 2 or self._start_s is None:
            raise ValueError("fewer than two ticks: there is nothing to export")
        for column, joint in enumerate((*NECK_AXES, *LID_JOINTS), start=7):
            if joint not in self._joints:
                a[:, column] = nan
        return GazeAngles(
            self._start_s, a[:, 0], a[:, 1:3], a[:, 3:5], a[:, 5:7], a[:, 7:10], a[:, 10:14],
            a[:, 14:16], codes[:, 0], codes[:, 1] > 0, codes[:, 2], tuple(self._numbers),
            self._joints, tuple(self._estimated),
        )  # fmt: skip

    def _number(self, tick: Tick) -> int:
        """Return the number of the target that the eyes are on or move to.

        The gaze moves to a new target with a saccade, after its latency. A new target within
        half a degree needs no saccade.
        """
        target, fixated = tick.target, self._fixated
        if fixated is None or tick.gaze.saccades != self._saccades:
            fixated = target
        elif target.shift != fixated.shift and tick.gaze.phase != "saccade":
            head = tick.pose.p_world_head_m
            way = sub(tick.gaze.gaze_point_world_m, head)
            if angle_between(way, sub(target.p_world_m, head)) < _ARRIVED_RAD:
                fixated = target
        self._fixated, self._saccades = fixated, tick.gaze.saccades
        name = GazeTarget(target_text(fixated), fixated.part or "")
        return self._numbers.setdefault(name, len(self._numbers))


def target_text(target: Target) -> str:
    """Return kind and id of a target, e.g. "face 3"."""
    return body_name(target.kind, target.id)


def _degrees(way: Vec3) -> Angles2:
    yaw, pitch = yaw_pitch(way)
    return (degrees(yaw), degrees(pitch))


LONGEST_LAG_S = 0.1
SHORTEST_PURSUIT_S = 0.1
"""A target's velocity fluctuates about the motion threshold; a shorter pursuit is part of the
movements around it."""

_LAGS_S = np.arange(0.0, LONGEST_LAG_S, 0.001)
_FIXATION, _SACCADE, _PURSUIT = 1, 2, 3


class Labels(NamedTuple):
    """Labels of the measured samples: the columns of GazeAngles, shifted by the lag.

    Attributes:
        lag_s: Time from the plan to its measured motion.
    """

    lag_s: float
    movement: Ints
    blink: NDArray[np.bool_]
    looked_at: Ints

    def event(self) -> list[str]:
        """Return one word per sample: "blink" during a blink, otherwise the movement."""
        labels = np.array(MOVEMENTS, dtype=object)[self.movement]
        return list(np.where(self.blink, "blink", labels))


class LabelledInterval(NamedTuple):
    """One saccade, fixation, pursuit or blink.

    Attributes:
        onset_s: Time since the first tick.
        amplitude_deg: Great circle from the first to the last sample of the measured cyclopean
            gaze, None if it was lost and for a blink.
        peak_deg_s: Highest speed of the measured cyclopean gaze, None as for the amplitude.
        looked_at: Destination of a saccade, otherwise the present target of the eyes.
    """

    onset_s: float
    duration_s: float
    event: str
    amplitude_deg: float | None
    peak_deg_s: float | None
    looked_at: GazeTarget


def label_samples(trace: GazeAngles) -> Labels:
    """Label the samples of a run."""
    lag_s = estimate_lag(trace)
    source = np.searchsorted(trace.time_s, trace.time_s - lag_s + 1e-9, side="right") - 1
    source = np.maximum(source, 0)
    out, time_s = trace.movement[source], trace.time_s
    # Short pursuits become fixations, and short fixations within a pursuit become pursuit.
    for wanted, other in ((_PURSUIT, _FIXATION), (_FIXATION, _PURSUIT)):
        for first, last in _value_runs(out):
            if out[first] != wanted or time_s[last] - time_s[first] >= SHORTEST_PURSUIT_S:
                continue
            before = out[first - 1] if first else 0
            after = out[last + 1] if last + 1 < len(out) else 0
            if wanted == _PURSUIT or (before == other and after == other):
                out[first : last + 1] = other
    return Labels(lag_s, out, trace.blink[source], trace.looked_at[source])


def estimate_lag(trace: GazeAngles) -> float:
    """Return the lag of the measured gaze behind the planned one, 0 .. LONGEST_LAG_S.

    It is the lag at which the speeds of both correlate best during and just after saccades.
    Speeds are compared because the gaze may have a constant offset. Saccades are compared
    because all lags fit a gaze at rest equally well.
    """
    jumps = trace.movement == _SACCADE
    if not jumps.any():
        return 0.0
    t = trace.time_s
    planned, seen = speed_deg_s(t, trace.planned_deg), speed_deg_s(t, trace.cyclopean_deg)
    onsets = t[jumps]
    since = t - onsets[np.maximum(np.searchsorted(onsets, t, side="right") - 1, 0)]
    near = (since >= 0.0) & (since <= LONGEST_LAG_S) & np.isfinite(seen)
    if np.count_nonzero(near) < 3 or np.ptp(seen[near]) == 0.0:
        return 0.0
    fits = []
    for lag in _LAGS_S:
        moved = np.interp(t[near] - lag, t, planned)
        # A constant plan has no correlation.
        fits.append(np.corrcoef(moved, seen[near])[0, 1] if np.ptp(moved) > 0.0 else -1.0)
    return float(_LAGS_S[int(np.argmax(fits))])


def find_intervals(trace: GazeAngles, labels: Labels) -> tuple[LabelledInterval, ...]:
    """Return all intervals in the order of their onsets; blinks overlap movements."""
    key = labels.movement * len(trace.names) + labels.looked_at
    # A target that changes during a saccade does not split the saccade.
    key = np.where(labels.movement == _SACCADE, -1, key)
    speed = speed_deg_s(trace.time_s, trace.cyclopean_deg)
    found = [
        _interval(trace, labels, speed, first, last, MOVEMENTS[labels.movement[first]])
        for first, last in _value_runs(key)
        if labels.movement[first]
    ]
    found += [
        _interval(trace, labels, speed, first, last, "blink")
        for first, last in _value_runs(labels.blink.astype(np.int64))
        if labels.blink[first]
    ]
    return tuple(sorted(found, key=lambda s: (s.onset_s, s.event)))


def _value_runs(key: Ints) -> list[tuple[int, int]]:
    """Return first and last index of every run of equal values."""
    breaks = np.flatnonzero(np.diff(key)) + 1
    firsts = [0, *breaks.tolist()]
    return list(zip(firsts, [*(b - 1 for b in breaks.tolist()), len(key) - 1], strict=True))


def _interval(
    trace: GazeAngles, labels: Labels, speed: Floats, first: int, last: int, event: str
) -> LabelledInterval:
    onset_s = float(trace.time_s[first])
    if last + 1 < len(trace.time_s):
        end_s = float(trace.time_s[last + 1])
    else:
        end_s = float(trace.time_s[last]) + 1.0 / trace.rate_hz
    amplitude = _great_circle_deg(trace.cyclopean_deg[first], trace.cyclopean_deg[last])
    peak = float(np.max(speed[first : last + 1]))
    return LabelledInterval(
        onset_s,
        end_s - onset_s,
        event,
        amplitude if event != "blink" and np.isfinite(amplitude) else None,
        peak if event != "blink" and np.isfinite(peak) else None,
        trace.names[labels.looked_at[first]],
    )


def speed_deg_s(time_s: Floats, gaze_deg: Floats) -> Floats:
    """Return the angular speed (n,) of a gaze (n, 2), each over two sample intervals."""
    x, y = gaze_deg.T
    dx, dy = np.gradient(x, time_s), np.gradient(y, time_s)
    speed: Floats = np.hypot(dx * np.cos(np.radians(y)), dy)
    return speed


def _great_circle_deg(a_deg: Floats, b_deg: Floats) -> float:
    """Return the great-circle angle between two directions (x, y)."""
    (xa, ya), (xb, yb) = np.radians(a_deg), np.radians(b_deg)
    # Haversine: exact for small angles.
    h = np.sin((yb - ya) / 2) ** 2 + np.cos(ya) * np.cos(yb) * np.sin((xb - xa) / 2) ** 2
    return float(np.degrees(2.0 * np.arcsin(min(1.0, np.sqrt(h)))))


def basis_of(
    joints: Collection[str], estimated: Collection[str], counts: Callable[[str], bool]
) -> Basis:
    """Return whether a figure is measured or estimated.

    Args:
        joints: Joints of the rig.
        estimated: Joints without feedback.
        counts: Returns whether the figure depends on a joint of this name.
    """
    hidden = [counts(name) for name in estimated]
    if not any(hidden):
        return "measured"
    whole = sum(hidden) == sum(counts(name) for name in joints)
    return "estimated" if whole else "partly estimated"
