"""Change of limits while joints move: without a jump, and joints outside move inside."""

from collections.abc import Callable

from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.safety.motion_limiter import MotionLimiter

_ROUNDING_RAD = 1e-9


class LimitChange:
    """The present limits of all joints, and new ones that wait until joints can keep them.

    Attributes:
        waiting: Joints that come to rest before their new limits apply.
        outside: Joints that are outside their ranges.

    Args:
        motion: Limiter with the present limits.
        wanted: One limit per joint.
        reach: Returns the ranges and speeds that the servos themselves keep; None for servos
            without limits of their own.
    """

    def __init__(
        self,
        motion: MotionLimiter,
        wanted: tuple[JointLimit, ...],
        reach: Callable[[], tuple[JointLimit, ...]] | None,
    ) -> None:
        self._motion, self._wanted, self._reach = motion, wanted, reach
        self.waiting: set[int] = set()
        self.outside: set[int] = set()
        self.reset()

    def reset(self) -> None:
        """Apply all limits immediately."""
        self._motion.limits[:] = self._within_reach()
        self.waiting.clear()

    def retune(self, wanted: tuple[JointLimit, ...]) -> None:
        """Change the limits, each as soon as its joint can keep it."""
        self._wanted = wanted
        in_force = self._motion.limits
        self.waiting = {i for i, limit in enumerate(self._within_reach()) if limit != in_force[i]}
        for i in range(len(wanted)):
            self._motion.reset_range(i)  # walls of a collision that is gone

    def begin(self, i: int, angle_rad: float) -> None:
        """Start a joint at its present goal on the bus, at rest."""
        low, high = self._motion.limits[i][:2]
        if self._reach is not None:
            reach = self._reach()[i]
            low, high = min(low, reach.low_rad), max(high, reach.high_rad)
        self._motion.restart(i, min(max(angle_rad, low), high))
        self._update_outside(i)

    def step(self, walls: bool) -> None:
        """Apply limits that joints can keep now.

        Args:
            walls: Whether there are walls against collisions, made for the present accelerations.
        """
        if self.waiting:
            limits, motion = self._within_reach(), self._motion
            for i in sorted(self.waiting):
                free = not walls and motion.keeps(i, limits[i])
                if motion.speed[i] == 0.0 or free:
                    motion.take(i, limits[i])
                    self.waiting.discard(i)
                    self._update_outside(i)
        for i in sorted(self.outside):
            self._update_outside(i)

    def _within_reach(self) -> tuple[JointLimit, ...]:
        """Return the wanted limits, reduced to those that the servos keep."""
        if self._reach is None:
            return self._wanted
        return tuple(map(JointLimit.within, self._wanted, self._reach()))

    def _update_outside(self, i: int) -> None:
        """Update whether a joint is outside its range."""
        limit, now = self._motion.limits[i], self._motion.command[i]
        if limit.low_rad - _ROUNDING_RAD <= now <= limit.high_rad + _ROUNDING_RAD:
            self.outside.discard(i)
        else:
            self.outside.add(i)
        self._motion.reset_range(i)
