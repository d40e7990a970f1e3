"""What really became of a wish, joint by joint, with the reason where it differs."""

from collections.abc import Iterable
from math import degrees, radians
from typing import NamedTuple

from gazerig.robot.model.types import GuardResult, JointAngles, JointState, Level

PASSING = ("starting slowly", "too hard", "too fast")
"""Reasons that say how a goal is approached, not that it cannot be reached."""

_STILL_DEG_S = 2.0


class Applied(NamedTuple):
    """What became of one joint's wish, in degrees.

    wished, permitted: what was asked for, and what the guard let through of it in the end
    measured: where the joint is; error: measured less wished
    reasons: why permitted or measured differ, as the guard names it; empty when all is well
    reckoned: its servo tells nothing, so measured is the goal moved by its known speed
    """

    joint: str
    wished: float
    permitted: float
    measured: float
    reasons: tuple[str, ...]
    reckoned: bool = False

    @property
    def error(self) -> float:
        """Return how far from the wish the joint is."""
        return self.measured - self.wished

    def __str__(self) -> str:
        """Write one line."""
        at = "is reckoned at" if self.reckoned else "is at"
        line = f"{self.joint}: wished {_deg(self.wished)}, {at} {_deg(self.measured)} deg"
        if abs(self.permitted - self.wished) > 0.05:
            line += f", permitted {_deg(self.permitted)}"
        return f"{line} ({', '.join(self.reasons)})" if self.reasons else line


class Step(NamedTuple):
    """One exchange: wish, what was let through, what is measured."""

    t_s: float
    wish_rad: JointAngles
    verdict: GuardResult
    joints: JointState


class Moved(NamedTuple):
    """How a movement ended.

    ended: "arrived", "held back" (by the guard), "not there in time", "limp", or the name
        of what stopped it
    level: the guard's last level; events: what the bus reported on the way
    last: the last exchange
    """

    ended: str
    seconds: float
    joints: tuple[Applied, ...]
    level: Level
    events: tuple[str, ...]
    last: Step

    @property
    def arrived(self) -> bool:
        """Return whether every joint that was to move came near its wish."""
        return self.ended == "arrived"

    def __str__(self) -> str:
        """Write how it ended, with the reasons joint by joint."""
        reasons = [f"{part.joint}: {', '.join(part.reasons)}" for part in self.remarkable()]
        return f"{self.ended} ({'; '.join(reasons)})" if reasons else self.ended

    def of(self, joint: str) -> Applied:
        """Return one joint's part."""
        return next(part for part in self.joints if part.joint == joint)

    def remarkable(self) -> tuple[Applied, ...]:
        """Return the joints that something is to be said of."""
        return tuple(part for part in self.joints if part.reasons)


class Notes:
    """Reasons of the guard by joint, in the order of coming, each once."""

    def __init__(self) -> None:
        self._by_joint: dict[str, dict[str, None]] = {}

    def take(self, verdict: GuardResult) -> None:
        """Take what a verdict says, but for how goals are approached."""
        for line in verdict.reasons:
            joint, _, reason = line.partition(": ")
            if reason not in PASSING:
                self._by_joint.setdefault(joint, {})[reason] = None

    def of(self, joint: str) -> tuple[str, ...]:
        """Return the reasons of one joint, with those of all."""
        return (*self._by_joint.get(joint, {}), *self._by_joint.get("all", {}))


def outcome(step: Step, wish: JointAngles, notes: Notes) -> tuple[Applied, ...]:
    """Return every joint's part of how a movement ended."""
    verdict, joints = step.verdict, step.joints
    told = joints.measured or (True,) * len(verdict.joints)
    rows = zip(verdict.joints, wish, verdict.command_rad, joints.position_rad, told, strict=True)
    return tuple(
        Applied(name, degrees(wished), degrees(let), degrees(at), notes.of(name), not tells)
        for name, wished, let, at, tells in rows
    )


def standing(step: Step, wish: JointAngles, moving: Iterable[int], near_rad: float) -> str | None:
    """Return how joints that stand have ended: at their wish, or where the guard keeps them."""
    joints, command = step.joints, step.verdict.command_rad
    held = False
    for i in moving:
        at = joints.position_rad[i]
        if abs(joints.velocity_rad_s[i]) > radians(_STILL_DEG_S):
            return None
        if abs(at - wish[i]) <= near_rad:
            continue
        passing = any(
            f"{step.verdict.joints[i]}: {reason}" in step.verdict.reasons for reason in PASSING
        )
        if passing or abs(at - command[i]) > near_rad:
            return None
        held = True
    return "held back" if held else "arrived"


def _deg(angle: float) -> str:
    """Write an angle, and zero without a sign."""
    return f"{round(angle, 1) + 0.0:.1f}"
