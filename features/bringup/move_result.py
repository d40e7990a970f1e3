"""Result of a movement, joint by joint, with the reason for each difference from the goal."""

from collections.abc import Iterable
from math import degrees, radians
from typing import NamedTuple

from gazerig.robot.model.types import GuardResult, JointAngles, JointState, Level

PASSING = ("starting slowly", "too hard", "too fast")
"""Reasons about the approach to a goal, which can still be reached."""

_STILL_DEG_S = 2.0


class JointResult(NamedTuple):
    """Result of a movement for one joint, in degrees.

    desired, commanded: the goal, and what the guard sent of it in the end
    measured: present angle; error: measured less desired
    reasons: why commanded or measured differ, as the guard names it; empty when all is well
    estimated: its servo has no sensor, so measured is the goal moved by its known speed
    """

    joint: str
    desired: float
    commanded: float
    measured: float
    reasons: tuple[str, ...]
    estimated: bool = False

    @property
    def error(self) -> float:
        """Return the distance of the joint from its goal."""
        return self.measured - self.desired

    def __str__(self) -> str:
        """Write one line."""
        at = "estimated" if self.estimated else "measured"
        line = f"{self.joint}: desired {_deg(self.desired)}, {at} {_deg(self.measured)} deg"
        if abs(self.commanded - self.desired) > 0.05:
            line += f", commanded {_deg(self.commanded)}"
        return f"{line} ({', '.join(self.reasons)})" if self.reasons else line


class Step(NamedTuple):
    """One exchange: desired, commanded and measured joints."""

    t_s: float
    desired_rad: JointAngles
    guard_result: GuardResult
    joints: JointState


class MoveResult(NamedTuple):
    """Result of a movement.

    ended: "arrived", "held back" (by the guard), "not there in time", "torque_off", or the name
        of what stopped it
    level: the guard's last level; events: reports of the bus during it
    last: the last exchange
    """

    ended: str
    seconds: float
    joints: tuple[JointResult, ...]
    level: Level
    events: tuple[str, ...]
    last: Step

    @property
    def arrived(self) -> bool:
        """Return whether every moving joint came near its goal."""
        return self.ended == "arrived"

    def __str__(self) -> str:
        """Write how it ended, with the reasons joint by joint."""
        reasons = [f"{part.joint}: {', '.join(part.reasons)}" for part in self.remarkable()]
        return f"{self.ended} ({'; '.join(reasons)})" if reasons else self.ended

    def of(self, joint: str) -> JointResult:
        """Return one joint's result."""
        return next(part for part in self.joints if part.joint == joint)

    def remarkable(self) -> tuple[JointResult, ...]:
        """Return the joints with reasons."""
        return tuple(part for part in self.joints if part.reasons)


class GuardReasons:
    """Reasons of the guard by joint, in the order of coming, each once."""

    def __init__(self) -> None:
        self._by_joint: dict[str, dict[str, None]] = {}

    def add(self, guard_result: GuardResult) -> None:
        """Add the reasons of a guard result, except those about the approach to a goal."""
        for line in guard_result.reasons:
            joint, _, reason = line.partition(": ")
            if reason not in PASSING:
                self._by_joint.setdefault(joint, {})[reason] = None

    def of(self, joint: str) -> tuple[str, ...]:
        """Return the reasons of one joint, with those of all."""
        return (*self._by_joint.get(joint, {}), *self._by_joint.get("all", {}))


def outcome(step: Step, desired: JointAngles, notes: GuardReasons) -> tuple[JointResult, ...]:
    """Return every joint's result of a movement."""
    guard_result, joints = step.guard_result, step.joints
    has_feedback = joints.measured or (True,) * len(guard_result.joints)
    rows = zip(
        guard_result.joints,
        desired,
        guard_result.command_rad,
        joints.position_rad,
        has_feedback,
        strict=True,
    )
    return tuple(
        JointResult(name, degrees(asked), degrees(let), degrees(at), notes.of(name), not tells)
        for name, asked, let, at, tells in rows
    )


def rest_result(
    step: Step, desired: JointAngles, moving: Iterable[int], near_rad: float
) -> str | None:
    """Return the result for joints at rest: at their goals or held back; None while they move."""
    joints, command = step.joints, step.guard_result.command_rad
    held = False
    for i in moving:
        at = joints.position_rad[i]
        if abs(joints.velocity_rad_s[i]) > radians(_STILL_DEG_S):
            return None
        if abs(at - desired[i]) <= near_rad:
            continue
        passing = any(
            f"{step.guard_result.joints[i]}: {reason}" in step.guard_result.reasons
            for reason in PASSING
        )
        if passing or abs(at - command[i]) > near_rad:
            return None
        held = True
    return "held back" if held else "arrived"


def _deg(angle: float) -> str:
    """Write an angle, and zero without a sign."""
    return f"{round(angle, 1) + 0.0:.1f}"
