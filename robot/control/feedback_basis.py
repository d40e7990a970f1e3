"""What is measured and what is only estimated: joints whose servos tell nothing.

A hobby servo takes a place and gives none back. What stands for its place is its goal, moved
by the speed that it is known to have: no sensor sees it stick, slip or swing.
"""

from collections.abc import Callable, Collection
from typing import Literal

from gazerig.robot.control.tick import Tick

Basis = Literal["measured", "partly estimated", "estimated"]

ESTIMATED = "estimated from commands and known servo speeds, not measured"
PARTLY = "in part estimated from commands and known servo speeds, not measured"


def estimated_joints(tick: Tick) -> tuple[str, ...]:
    """Return the joints whose servos tell nothing."""
    has_feedback = tick.joints.measured
    if not has_feedback:
        return ()
    return tuple(
        [n for n, one in zip(tick.guard_result.joints, has_feedback, strict=True) if not one]
    )


def basis_of(
    joints: Collection[str], estimated: Collection[str], counts: Callable[[str], bool]
) -> Basis:
    """Return what a figure rests on.

    joints: the rig's; counts: whether the figure rests on a joint of this name
    """
    hidden = [counts(name) for name in estimated]
    if not any(hidden):
        return "measured"
    whole = sum(hidden) == sum(counts(name) for name in joints)
    return "estimated" if whole else "partly estimated"
