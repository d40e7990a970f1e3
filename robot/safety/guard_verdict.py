"""The guard's result of one tick, made from what it found of each joint."""

from gazerig.robot.model.types import GuardResult, JointAngles, Level

_LEVELS: tuple[Level, ...] = ("ok", "limited", "hold", "torque_off")


def standstill(
    command: JointAngles, desired_rad: JointAngles, joints: tuple[str, ...]
) -> GuardResult:
    """Return the result where nothing moves, as no time has passed."""
    reasons = ("all: time stands still",)
    why = ("time stands still",) * len(command)
    return GuardResult(command, "hold", reasons, desired_rad, why, reasons, joints)


def passed(desired_rad: JointAngles, joints: tuple[str, ...]) -> GuardResult:
    """Return the result of a tick in which every joint may do as is desired."""
    return GuardResult(desired_rad, "ok", (), desired_rad, (), (), joints)


def verdict(
    command: JointAngles,
    desired_rad: JointAngles,
    short: dict[int, tuple[int, str]],
    joints: tuple[str, ...],
) -> GuardResult:
    """Return the result of a tick; its level is that of the worst joint.

    Args:
        command: what is sent, rad.
        desired_rad: what was asked for.
        short: how bad it is, 1 (limited) to 3 (torque_off), and why, by the number of every joint
            that falls short.
        joints: their names.
    """
    if not short:
        return GuardResult(command, "ok", (), desired_rad, (), (), joints)
    worst = max(rank for rank, _ in short.values())
    reasons = {i: f"{joints[i]}: {reason}" for i, (_, reason) in short.items()}
    return GuardResult(
        command,
        _LEVELS[worst],
        tuple(reasons.values()),
        desired_rad,
        tuple([short[i][1] if i in short else "" for i in range(len(command))]),
        tuple([reasons[i] for i in reasons if short[i][0] == worst]),
        joints,
    )
