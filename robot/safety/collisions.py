"""Pairs of joint ranges that may not be taken together: a lid and a frame, chin and chest.

Of every pair one joint, the keeper, keeps out of its range: it has a wall in front of it
at which it can always stop. The other is free. The keeper changes only when the other joint
is out too, by its command and as measured, so no path between two commands crosses
the forbidden box however long a tick is.
"""

from collections.abc import Sequence
from math import isfinite

from gazerig.robot.model.forbidden_range import CollisionParams, ForbiddenRange, forbidden_pairs
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import JointAngles
from gazerig.robot.safety.motion_limiter import MotionLimiter

_ROUNDING_RAD = 1e-9


class Collisions:
    """Puts up walls so that no forbidden box is ever entered.

    exits: joints on their way out of a box they began in -> where they go
    still: joints that wait for these

    Args:
        params: the forbidden pairs of ranges.
        margin_deg: distance that is kept from them, as servos round and lag.
        limits: one for each joint.
        joints: the joints' names.

    Raises:
        ValueError: a pair leaves no pose inside the limits, or names an unknown joint.
    """

    def __init__(
        self,
        params: Sequence[CollisionParams],
        margin_deg: float,
        limits: tuple[JointLimit, ...],
        joints: tuple[str, ...],
    ) -> None:
        self._pairs = forbidden_pairs(params, margin_deg, limits, joints)
        self._joints = sorted({span.joint for pair in self._pairs for span in pair})
        self._keeper = [0] * len(self._pairs)
        self.exits: dict[int, float] = {}
        self.still: set[int] = set()

    def go_on(self, before: "Collisions") -> None:
        """Leave the pairs that were watched before to the same keepers."""
        kept = dict(zip(before._pairs, before._keeper, strict=True))
        self._keeper = [kept.get(pair, 0) for pair in self._pairs]

    def __bool__(self) -> bool:
        """Return whether there is any pair to watch."""
        return bool(self._pairs)

    def look(
        self,
        motion: MotionLimiter,
        desired: JointAngles,
        position: JointAngles,
        held: Sequence[bool],
    ) -> None:
        """Set this tick's limits, and find which joints have to leave a forbidden range first.

        desired: where the joints want to go, any numbers at all
        position: as measured
        held: joints that cannot be sent anywhere
        """
        for i in self._joints:
            motion.let_be(i)
        self.exits.clear()
        self.still.clear()
        inside = []
        for k, pair in enumerate(self._pairs):
            if not self._keep_out(k, pair, motion, desired, position):
                inside.append(pair)
        for pair in inside:
            self._lead_out(pair, motion, held)
        self.still.difference_update(self.exits)

    def _keep_out(
        self,
        k: int,
        pair: tuple[ForbiddenRange, ForbiddenRange],
        motion: MotionLimiter,
        desired: JointAngles,
        position: JointAngles,
    ) -> bool:
        """Wall off the keeper of a pair; return whether there is one."""
        keeper = self._keeper[k]
        if not _side(pair[keeper], motion):
            keeper = 1 - keeper
            if not _side(pair[keeper], motion):
                return False
        elif _side(pair[1 - keeper], motion):
            other = pair[1 - keeper]
            eager = _crosses(pair[keeper], motion, desired)
            if eager and not _crosses(other, motion, desired) and _is_out(other, position):
                keeper = 1 - keeper
            elif not _is_out(pair[keeper], position):
                # The keeper lags, or a hand has pushed it in: the other waits outside.
                _wall_off(other, motion)
        self._keeper[k] = keeper
        _wall_off(pair[keeper], motion)
        return True

    def _lead_out(
        self,
        pair: tuple[ForbiddenRange, ForbiddenRange],
        motion: MotionLimiter,
        held: Sequence[bool],
    ) -> None:
        """Send one joint of a pair that began in its box out by the shortest way."""
        ways = [
            (abs(exit_rad - motion.command[span.joint]), span.joint, exit_rad)
            for span in pair
            if not held[span.joint]
            for exit_rad in (span.below, span.above)
            if motion.low[span.joint] <= exit_rad <= motion.high[span.joint]
            and self._agrees(span.joint, exit_rad, motion)
        ]
        self.still.update(span.joint for span in pair)
        if ways:
            _, joint, exit_rad = min(ways)
            now = motion.command[joint]
            farther = [exit_rad, self.exits.get(joint, exit_rad)]
            self.exits[joint] = max(farther, key=lambda angle: abs(angle - now))

    def _agrees(self, joint: int, exit_rad: float, motion: MotionLimiter) -> bool:
        """Return whether a joint that leaves another box as well goes the same way."""
        now = motion.command[joint]
        return (self.exits.get(joint, exit_rad) - now) * (exit_rad - now) >= 0.0


def _side(span: ForbiddenRange, motion: MotionLimiter) -> int:
    """Return on which side a joint is and can stay: -1 below, 1 above, 0 neither."""
    if motion.keeps_below(span.joint, span.below):
        return -1
    return 1 if motion.keeps_above(span.joint, span.above) else 0


def _wall_off(span: ForbiddenRange, motion: MotionLimiter) -> None:
    """Limit a joint to the side on which it is."""
    i = span.joint
    if _side(span, motion) < 0:
        motion.wall_above(i, span.below)
    else:
        motion.wall_below(i, span.above)


def _crosses(span: ForbiddenRange, motion: MotionLimiter, desired: JointAngles) -> bool:
    """Return whether a joint's path to its desired angle leads into its half of the box."""
    i = span.joint
    if not isfinite(desired[i]):
        return False
    limit = motion.limits[i]
    now, then = motion.command[i], min(max(desired[i], limit.low_rad), limit.high_rad)
    return min(now, then) < span.above - _ROUNDING_RAD and (
        max(now, then) > span.below + _ROUNDING_RAD
    )


def _is_out(span: ForbiddenRange, position: JointAngles) -> bool:
    """Return whether a joint is measured outside its half of the box."""
    return not span.low <= position[span.joint] <= span.high
