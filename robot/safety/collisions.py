"""Avoidance of pairs of joint ranges that collide, such as a lid and a frame, chin and chest.

In every pair one joint, the keeper, stays out of its range: a wall in front of the range always
allows it to stop. The other joint is free. The keeper changes only if command and measured angle of
the other joint are also outside. Therefore no path between two commands crosses the forbidden box,
however long a tick is.
"""

from collections.abc import Sequence
from math import isfinite

from gazerig.robot.model.guard_params import CollisionParams, ForbiddenRange, forbidden_pairs
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import JointAngles
from gazerig.robot.safety.motion_limiter import MotionLimiter

_ROUNDING_RAD = 1e-9


class Collisions:
    """A set of forbidden boxes, with walls that keep the joints out of them.

    Attributes:
        exits: Joints that leave a box in which they started -> their goals in rad.
        still: Joints that wait for the exits.

    Args:
        params: The forbidden pairs of ranges.
        limits: One limit per joint.
        joints: The joints' names.

    Raises:
        ValueError: A pair leaves no pose inside the limits, or names an unknown joint.
    """

    def __init__(
        self,
        params: Sequence[CollisionParams],
        limits: tuple[JointLimit, ...],
        joints: tuple[str, ...],
    ) -> None:
        self._pairs = forbidden_pairs(params, limits, joints)
        self._joints = sorted({span.joint for pair in self._pairs for span in pair})
        self._keeper = [0] * len(self._pairs)
        self.exits: dict[int, float] = {}
        self.still: set[int] = set()

    def __bool__(self) -> bool:
        """Return whether there is any pair."""
        return bool(self._pairs)

    def set_walls(
        self,
        motion: MotionLimiter,
        desired: JointAngles,
        position: JointAngles,
        held: Sequence[bool],
    ) -> None:
        """Set this tick's walls, and find joints that must leave a forbidden range.

        Args:
            motion: Limiter of the joints' motion.
            desired: Desired angles in rad, any numbers including NaN.
            position: Measured angles in rad.
            held: Whether each joint cannot follow a goal.
        """
        for i in self._joints:
            motion.reset_range(i)
        self.exits.clear()
        self.still.clear()
        inside = []
        for k, pair in enumerate(self._pairs):
            if not self._keep_out(k, pair, motion, desired, position):
                inside.append(pair)
        for pair in inside:
            self._move_out(pair, motion, held)
        self.still.difference_update(self.exits)

    def _keep_out(
        self,
        k: int,
        pair: tuple[ForbiddenRange, ForbiddenRange],
        motion: MotionLimiter,
        desired: JointAngles,
        position: JointAngles,
    ) -> bool:
        """Set the keeper's wall; return False if both joints are inside their ranges."""
        keeper = self._keeper[k]
        if not _present_side(pair[keeper], motion):
            keeper = 1 - keeper
            if not _present_side(pair[keeper], motion):
                return False
        elif _present_side(pair[1 - keeper], motion):
            other = pair[1 - keeper]
            eager = _crosses(pair[keeper], motion, desired)
            if eager and not _crosses(other, motion, desired) and _is_outside(other, position):
                keeper = 1 - keeper
            elif not _is_outside(pair[keeper], position):
                # The keeper lags, or was pushed in by hand: the other joint waits outside.
                _put_wall(other, motion)
        self._keeper[k] = keeper
        _put_wall(pair[keeper], motion)
        return True

    def _move_out(
        self,
        pair: tuple[ForbiddenRange, ForbiddenRange],
        motion: MotionLimiter,
        held: Sequence[bool],
    ) -> None:
        """Set the goal of one joint of a pair inside its box to the nearest exit."""
        paths = []
        for span in pair:
            joint, now = span.joint, motion.command[span.joint]
            for exit_rad in (span.below, span.above):
                # In the direction of the joint's exit from another box.
                same = (self.exits.get(joint, exit_rad) - now) * (exit_rad - now) >= 0.0
                if same and not held[joint] and motion.low[joint] <= exit_rad <= motion.high[joint]:
                    paths.append((abs(exit_rad - now), joint, exit_rad))
        self.still.update(span.joint for span in pair)
        if paths:
            _, joint, exit_rad = min(paths)
            now = motion.command[joint]
            farther = [exit_rad, self.exits.get(joint, exit_rad)]
            self.exits[joint] = max(farther, key=lambda angle: abs(angle - now))


def _present_side(span: ForbiddenRange, motion: MotionLimiter) -> int:
    """Return the side on which a joint is and can stay: -1 below, 1 above, 0 neither."""
    if motion.keeps_below(span.joint, span.below):
        return -1
    return 1 if motion.keeps_above(span.joint, span.above) else 0


def _put_wall(span: ForbiddenRange, motion: MotionLimiter) -> None:
    """Limit a joint to its present side."""
    i = span.joint
    if _present_side(span, motion) < 0:
        motion.wall_above(i, span.below)
    else:
        motion.wall_below(i, span.above)


def _crosses(span: ForbiddenRange, motion: MotionLimiter, desired: JointAngles) -> bool:
    """Return whether a joint's path to its desired angle enters its range of the box."""
    i = span.joint
    if not isfinite(desired[i]):
        return False
    limit = motion.limits[i]
    now, then = motion.command[i], min(max(desired[i], limit.low_rad), limit.high_rad)
    return min(now, then) < span.above - _ROUNDING_RAD and (
        max(now, then) > span.below + _ROUNDING_RAD
    )


def _is_outside(span: ForbiddenRange, position: JointAngles) -> bool:
    """Return whether a joint's measured angle is outside its range of the box."""
    return not span.low <= position[span.joint] <= span.high
