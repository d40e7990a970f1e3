"""Gaze angles of a run in degrees, one column each, as an eye tracker would measure them.

All exports use this definition. Angles are those of lines of sight in space, not in the head:

x  yaw, the rotation about the vertical axis of the world, + to the robot's own left
y  pitch above the horizontal, + up

0, 0 is horizontal and straight ahead of the base. The cyclopean gaze is the mean of both eyes'
unit lines of sight. These are Fick angles: a rotation in x of 1 deg moves the gaze by cos(y) deg.
An angle is NaN (the eye tracker's "lost") in a tick in which one of its servos did not answer,
and in all ticks if the rig lacks the joint. Angles of servos without feedback are estimated:
their goals, moved at the servos' known speeds.
"""

from array import array
from collections.abc import Iterable
from math import degrees, nan
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gazerig.gaze.angles import add, angle_between, sub, yaw_pitch
from gazerig.gaze.field_of_view import head_in_space, line_of_sight
from gazerig.gaze.types import Angles2, Floats, GazeState, Target, Vec3
from gazerig.robot.control.feedback_basis import Basis, basis_of, estimated_joints
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.commands import REPEATED, Command, Jog, Stop

Ints = NDArray[np.int64]

MOVEMENTS = ("", "fixation", "saccade", "pursuit")
"""Movements of the eyes; "" if unknown: they were moved by hand or had no torque."""

_CODE = {"fixate": 1, "saccade": 2, "pursue": 3}
_ARRIVED_RAD = 0.009  # half a degree: a new target within this distance needs no saccade
_NECK_AXES = ("neck_yaw", "neck_pitch", "neck_roll")
_LIDS = ("left_upper_lid", "right_upper_lid", "left_lower_lid", "right_lower_lid")
_NECK = frozenset(_NECK_AXES)
_BOTH = _NECK | {"eyes_pan", "eyes_tilt"}
_LEFT = _BOTH | {"left_eye_pan", "left_eye_tilt"}
_RIGHT = _BOTH | {"right_eye_pan", "right_eye_tilt"}
_JOINTS_OF = {
    "left": _LEFT, "right": _RIGHT, "cyclopean": _LEFT | _RIGHT, "head": _NECK,
    "lids": frozenset(_LIDS),
}  # fmt: skip
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
        lids, lower_lids: (n, 2) Left and right, 0 shut .. 1 open, NaN without such a joint.
        planned_deg: (n, 2) Desired cyclopean x and y.
        movement: (n,) Planned movement as an index in MOVEMENTS.
        blink: (n,) Whether a blink was planned.
        looked_at: (n,) Planned target as an index in ``names``.
        messages: Events and commands in order, (time_s, text).
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
    messages: tuple[tuple[float, str], ...]
    lower_lids: Floats
    joints: tuple[str, ...]
    estimated: tuple[str, ...]

    @property
    def rate_hz(self) -> float:
        """Return the median rate of the ticks."""
        return 1.0 / float(np.median(np.diff(self.time_s)))

    def basis(self, of: str) -> Basis:
        """Return whether "left", "right" or "cyclopean" gaze, "head" or "lids" are measured."""
        return basis_of(self.joints, self.estimated, _JOINTS_OF[of].__contains__)


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
        self._messages: list[tuple[float, str]] = []
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
        lids = (pose.lid_left, pose.lid_right, pose.lower_left, pose.lower_right)
        head = tuple(map(degrees, head_in_space(pose)))
        self._joints = tick.guard_result.joints
        self._estimated.update(dict.fromkeys(estimated_joints(tick)))
        if missing:
            lost_left, lost_right = not _LEFT.isdisjoint(missing), not _RIGHT.isdisjoint(missing)
            cyclopean = _LOST if lost_left or lost_right else cyclopean
            left, right = _LOST if lost_left else left, _LOST if lost_right else right
            head = (nan, nan, nan) if not _NECK.isdisjoint(missing) else head
            lost_lids = [nan if n in missing else o for n, o in zip(_LIDS, lids, strict=True)]
            lids = (lost_lids[0], lost_lids[1], lost_lids[2], lost_lids[3])
        time_s = tick.t_s - self._start_s
        self._angles.extend((time_s, *left, *right, *cyclopean, *head, *lids, *planned))
        self._messages += [(time_s, event) for event in tick.events]
        for command in tick.commands:
            if isinstance(command, REPEATED):
                continue
            self._messages.append((time_s, command_text(command)))
            if isinstance(command, Jog):
                self._jogged = bool(command.angles_rad)
            elif isinstance(command, Stop):
                self._jogged = False
        if self._led and not tick.led:  # a timeout, for which there is no command
            self._jogged = False
        self._led = tick.led
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
        for column, joint in enumerate((*_NECK_AXES, *_LIDS), start=7):
            if joint not in self._joints:
                a[:, column] = nan
        return GazeAngles(
            self._start_s, a[:, 0], a[:, 1:3], a[:, 3:5], a[:, 5:7], a[:, 7:10], a[:, 10:12],
            a[:, 14:16], codes[:, 0], codes[:, 1] > 0, codes[:, 2], tuple(self._numbers),
            tuple(self._messages), a[:, 12:14], self._joints, tuple(self._estimated),
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
    return target.kind if target.id < 0 else f"{target.kind} {target.id}"


def command_text(command: Command) -> str:
    """Return a command as text, e.g. "asked: stop why=space bar"."""
    usual = command._field_defaults
    given = " ".join(
        f"{name}={value}"
        for name, value in command._asdict().items()
        if name not in usual or value != usual[name]
    )
    return f"asked: {type(command).__name__.lower()} {given}".rstrip()


def _degrees(way: Vec3) -> Angles2:
    yaw, pitch = yaw_pitch(way)
    return (degrees(yaw), degrees(pitch))
