"""Distinction between measured joints and estimated ones, whose servos have no feedback.

A hobby servo takes a goal and reports no position. Its position is estimated as its goal, moved
at its known speed: no sensor detects sticking, slipping or oscillation.
"""

from collections.abc import Callable, Collection
from typing import Literal

from gazerig.robot.loop.tick import Tick

Basis = Literal["measured", "partly estimated", "estimated"]

ESTIMATED = "estimated from commands and known servo speeds, not measured"


def estimated_joints(tick: Tick) -> tuple[str, ...]:
    """Return the joints whose servos have no feedback."""
    has_feedback = tick.joints.measured
    if not has_feedback:
        return ()
    return tuple(
        [n for n, one in zip(tick.guard_result.joints, has_feedback, strict=True) if not one]
    )


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
