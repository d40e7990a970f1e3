"""The guard's result of one tick from its findings for the joints."""

from typing import NamedTuple

from gazerig.robot.model.types import GuardResult, JointAngles, Level

_LEVELS: tuple[Level, ...] = ("ok", "limited", "hold", "torque_off")


def standstill(
    command: JointAngles, desired_rad: JointAngles, joints: tuple[str, ...]
) -> GuardResult:
    """Return the result of a tick without motion, as no time has passed."""
    reasons = ("all: time stands still",)
    why = ("time stands still",) * len(command)
    return GuardResult(command, "hold", reasons, desired_rad, why, reasons, joints)


def passed(desired_rad: JointAngles, joints: tuple[str, ...]) -> GuardResult:
    """Return the result of a tick in which every joint follows its desired angle."""
    # Avoids the call of the class's constructor, a Python function.
    return tuple.__new__(GuardResult, (desired_rad, "ok", (), desired_rad, (), (), joints))


class Findings(NamedTuple):
    """The guard's findings for all joints, in the fields of ``GuardResult``."""

    level: Level
    reasons: tuple[str, ...]
    why: tuple[str, ...]
    critical_reasons: tuple[str, ...]


def findings(short: dict[int, tuple[int, str]], joints: tuple[str, ...]) -> Findings:
    """Return the findings for all joints; the level is that of the worst joint.

    Args:
        short: Rank, 1 (limited) to 3 (torque_off), and reason by the number of each joint that
            does not follow.
        joints: Names of all joints.
    """
    if not short:
        return Findings("ok", (), (), ())
    worst = max(rank for rank, _ in short.values())
    reasons = {i: f"{joints[i]}: {reason}" for i, (_, reason) in short.items()}
    return Findings(
        _LEVELS[worst],
        tuple(reasons.values()),
        tuple([short[i][1] if i in short else "" for i in range(len(joints))]),
        tuple([reasons[i] for i in reasons if short[i][0] == worst]),
    )
