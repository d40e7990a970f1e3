"""The guard between desired angles and the bus: knows limits, measurements and ages, not gaze.

Whatever is desired, what leaves is finite, inside every joint's range, within its speed
and its acceleration, always able to stop before the end of the range, and in no pose in
which joints collide. What is hot, overloaded, short of voltage or stuck slows down or
stops, each joint by itself. Radians.
"""

from collections.abc import Callable
from math import inf, isfinite, radians
from typing import Literal, NamedTuple

from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import GuardResult, JointAngles, JointState
from gazerig.robot.safety.collisions import Collisions
from gazerig.robot.safety.guard_verdict import findings, passed, standstill
from gazerig.robot.safety.health import JointHealth
from gazerig.robot.safety.late_ticks import LateTicks
from gazerig.robot.safety.limit_change import LimitChange
from gazerig.robot.safety.motion_limiter import MotionLimiter
from gazerig.robot.safety.stall_detector import StallDetector

_NEAR_RAD = radians(1.0)
_ROUNDING_RAD = 1e-9


class _Hold(NamedTuple):
    """Why a joint does not follow its desired angle, and what it does instead.

    goal: where it goes; None: it comes to a stop
    slowly: it goes there slowly
    again: how it begins when this is over
    """

    reason: str
    goal: float | None = None
    slowly: bool = False
    again: Literal["at once", "slowly"] = "at once"


class Guard:
    """Checks every command, one tick after the other.

    Args:
        params: thresholds and times.
        limits: one for each joint.
        joints: the joints' names.
        reach: returns the ranges and speeds that the servos themselves keep, which apply beside
            limits that are changed; None: all.
        period_s: nominal time between ticks; a late tick is not made up for.

    Raises:
        ValueError: a collision leaves no pose inside the limits.
    """

    def __init__(
        self,
        params: GuardParams,
        limits: tuple[JointLimit, ...],
        joints: tuple[str, ...],
        reach: Callable[[], tuple[JointLimit, ...]] | None = None,
        period_s: float = 0.1,
    ) -> None:
        self._take(params)
        self._late = LateTicks(period_s)
        self._soft = False
        self._calm = False  # in the last tick every joint followed, and nothing has come since
        self._names, self._numbers = joints, range(len(limits))
        self._neck = tuple("neck" in name.split("_") for name in joints)
        self._motion = MotionLimiter(limits)
        self._change = LimitChange(self._motion, limits, reach)
        self._limits = self._motion.limits
        self._short: dict[int, tuple[int, str]] = {}
        self._findings = findings(self._short, joints)
        self._health = JointHealth(params.health, limits)
        self._stuck = StallDetector(params.stall, len(limits))
        self._collisions = Collisions(
            params.collisions, params.collision_margin_deg, limits, joints
        )
        self.reset(0.0, tuple(0.5 * (limit.low_rad + limit.high_rad) for limit in limits))

    def _take(self, params: GuardParams) -> None:
        self._params = params
        self._gentle_speed = radians(params.soft_start_speed_deg_s)
        self._gentle_accel = radians(params.soft_start_accel_deg_s2)
        self._late_accel = radians(params.late_accel_deg_s2)

    def pace(self, period_s: float) -> None:
        """Expect ticks at another rate from now on."""
        self._late.period_s = period_s

    def retune(self, params: GuardParams, limits: tuple[JointLimit, ...]) -> None:
        """Change the limits without a jump; counters and findings stay.

        A joint that moves so that it cannot keep its new limit comes to rest under the old
        one first. A joint that is outside its new range then is led inside slowly.

        Raises:
            ValueError: a collision leaves no pose inside the limits; nothing has changed.
        """
        collisions = Collisions(params.collisions, params.collision_margin_deg, limits, self._names)
        collisions.go_on(self._collisions)
        self._collisions = collisions
        self._take(params)
        self._health.retune(params.health)
        self._stuck.retune(params.stall)
        self._change.retune(limits)
        self._calm = False

    def recount(self, i: int, factor: float, offset_rad: float) -> None:
        """Count a joint's angles otherwise, as its zero, sign or ratio was changed.

        Where the joint is sent does not change; where it should be may, so it goes slowly.
        What was x is factor x + offset_rad from now on.
        """
        self._motion.recount(i, factor, offset_rad)
        self._stuck.forget(i)
        self._retreat[i] = None
        self._slow_down(i)

    def reset(self, t_s: float, command_rad: JointAngles) -> None:
        """Begin from the goals that are in force on the bus, at rest, gently."""
        self._t_s = t_s
        self._change.reset()
        self._held = [False] * len(self._limits)
        self._retrying = [False] * len(self._limits)
        self._retreat: list[float | None] = [None] * len(self._limits)
        self._health.reset()
        for i, angle in enumerate(command_rad):
            self._change.begin(i, angle)
            self._stuck.forget(i)
        self.go_gently()

    def go_gently(self) -> None:
        """Move slowly for a while, and each joint until it has once met its desired angle."""
        self._calm = False
        for i in range(len(self._limits)):
            self._motion.forget_gaps(i)
        self._gentle = [True] * len(self._limits)
        self._gentle_until_s = [self._t_s + self._params.soft_start_ms / 1e3] * len(self._limits)

    @property
    def limits(self) -> tuple[JointLimit, ...]:
        """Return the limits in force, which new ones take the place of once joints keep them."""
        return tuple(self._limits)

    @property
    def gentle(self) -> bool:
        """Return whether any joint is still on its slow way."""
        return any(self._gentle)

    def check(
        self, desired_rad: JointAngles, joints: JointState, frame_age_s: float, t_s: float
    ) -> GuardResult:
        """Return what may be sent now.

        desired_rad: any numbers at all
        frame_age_s: age of the newest frame; infinity before the first
        """
        if any(joints.rearmed):
            self._rearm(joints)
        since_s = t_s - self._t_s
        if not (since_s > 0.0 and isfinite(since_s)):
            return standstill(tuple(self._motion.command), desired_rad, self._names)
        self._t_s = t_s
        if self._change.waiting or self._change.outside:
            self._calm = False
            self._change.step(bool(self._collisions))
        dt_s, missed_s = self._late.split(since_s, t_s, self._params.late_ms / 1e3)
        if missed_s > 0.0:
            self._motion.left_alone(missed_s)
        self._soft = t_s < self._late.soft_until_s
        self._health.step(joints, dt_s)
        if self._collisions:
            self._collisions.look(self._motion, desired_rad, joints.position_rad, self._held)
        no_frame = not frame_age_s <= self._params.frame_timeout_ms / 1e3
        return self._joints(desired_rad, joints, no_frame, dt_s)

    def _joints(
        self, desired_rad: JointAngles, joints: JointState, no_frame: bool, dt_s: float
    ) -> GuardResult:
        """Move all joints. Nearly every desired angle is a good one and is passed on as it is."""
        motion, far = self._motion, self._stuck.far_rad
        if not motion.easy_s <= dt_s <= 2.0 * motion.easy_s:
            motion.ease(dt_s)
        command, speed, goal = motion.command, motion.speed, motion.goal
        usual = self._all_well(joints) and not no_frame
        stale_s = self._t_s - self._params.joint_timeout_ms / 1e3
        short: dict[int, tuple[int, str]] = {}
        followed = True
        rows = zip(
            self._numbers, desired_rad, joints.position_rad, joints.measured_s, self._stuck.watched,
            command, speed, goal, motion.easy_speed, motion.easy_low, motion.easy_high, strict=True,
        )  # fmt: skip
        for i, desired, position, at_s, watched, p, v, before, easy, low, high in rows:
            near = -far <= p - position <= far and not watched
            if near and at_s >= stale_s and (usual or self._well(i, joints, no_frame)):
                wanted = (desired - p) / dt_s
                if before is p and -easy <= wanted <= easy and -easy <= v <= easy and low <= desired <= high:  # fmt: skip
                    command[i] = goal[i] = desired
                    speed[i] = wanted
                    continue
                if motion.follow(i, desired, dt_s):
                    continue
            followed = False
            unseen = no_frame and self._neck[i]
            outcome = self._pass(i, desired, joints, at_s >= stale_s, unseen, dt_s)
            if outcome[1]:
                short[i] = outcome
        self._calm = followed
        if followed:
            return passed(desired_rad, self._names)
        if short != self._short:  # what is found of joints lasts for many ticks
            self._short, self._findings = short, findings(short, self._names)
        level, reasons, why, critical = self._findings
        return GuardResult(tuple(command), level, reasons, desired_rad, why, critical, self._names)

    def _all_well(self, joints: JointState) -> bool:
        """Return whether nothing but limits, ages and distances need be looked at."""
        calm = self._calm or not (
            any(self._gentle) or any(self._held) or self._change.waiting or self._change.outside
        )
        return calm and not (
            self._soft
            or not self._health.fine
            or self._collisions.exits
            or self._collisions.still
            or not all(joints.torque)
            or any(joints.fault)
        )

    def _well(self, i: int, joints: JointState, no_frame: bool) -> bool:
        """Whether this holds for one joint."""
        return not (
            (no_frame and self._neck[i])
            or self._soft
            or self._gentle[i]
            or self._held[i]
            or self._health.share[i] < 1.0
            or self._health.held[i]
            or i in self._collisions.exits
            or i in self._collisions.still
            or i in self._change.waiting
            or i in self._change.outside
            or (joints.torque and not joints.torque[i])
            or (joints.fault and joints.fault[i])
        )

    def _rearm(self, joints: JointState) -> None:
        """Begin where the bus has put the goals of joints whose torque came on again."""
        for i, (angle, rearmed) in enumerate(zip(joints.position_rad, joints.rearmed, strict=True)):
            if rearmed and isfinite(angle):
                self._change.begin(i, angle)
                self._stuck.forget(i)
                self._retreat[i] = None
                self._slow_down(i)

    def _slow_down(self, i: int) -> None:
        """Make one joint go on slowly, as after torque-on."""
        self._calm = False
        if not self._gentle[i]:
            self._motion.forget_gaps(i)
        self._gentle[i] = True
        self._gentle_until_s[i] = self._t_s + self._params.soft_start_ms / 1e3

    def _pass(
        self, i: int, desired: float, joints: JointState, fresh: bool, unseen: bool, dt_s: float
    ) -> tuple[int, str]:
        """Move one joint; return the rank of the level and the reason, if there is one."""
        position = joints.position_rad[i]
        fault = joints.fault[i] if joints.fault else ""
        fresh = fresh and isfinite(position)
        hold = self._servo_hold(i, joints, fault, fresh)
        self._held[i] = hold is not None
        if hold is None:
            self._retreat[i] = None
            hold = self._outer_hold(i, desired, unseen)
        if fault:  # what still moves, moves to its parking place
            self._slow_down(i)
        if hold is not None:
            self._stand(i, hold, dt_s)
            rank, reason = 2, hold.reason
        else:
            reason = self._go(i, desired, position, dt_s)
            rank = 1 if reason else 0
        return (3, fault) if fault else (rank, reason)

    def _servo_hold(self, i: int, joints: JointState, fault: str, fresh: bool) -> _Hold | None:
        """Return why a joint's servo cannot or must not follow the command."""
        position = joints.position_rad[i]
        powered = joints.torque[i] if joints.torque else not fault
        if not powered:
            # Where it is when the torque comes back, its command is already.
            self._stuck.forget(i)
            return _Hold("torque off", position if isfinite(position) else None, again="slowly")
        if "encoder" in fault:
            return _Hold(fault)
        if self._is_stuck(i, joints, fresh):
            return self._give_way(i, "not moving", position, fresh)
        strain = self._health.held[i]
        if strain == "overloaded":
            return self._give_way(i, strain, position, fresh)
        if not fresh:
            return _Hold("stale joints")
        return _Hold(strain, again="slowly") if strain else None

    def _outer_hold(self, i: int, desired: float, unseen: bool) -> _Hold | None:
        """Return what else keeps a joint from its desired angle."""
        if i in self._change.waiting:
            return _Hold("new limits")
        if i in self._collisions.exits:
            return _Hold("self-collision", self._collisions.exits[i], slowly=True, again="slowly")
        if i in self._collisions.still:
            return _Hold("self-collision", again="slowly")
        if i in self._change.outside:
            limit = self._limits[i]
            end = limit.low_rad if self._motion.command[i] < limit.low_rad else limit.high_rad
            return _Hold("outside its new range", end, True, "slowly")
        if not isfinite(desired):
            return _Hold("not finite")
        return _Hold("stale frame") if unseen else None

    def _is_stuck(self, i: int, joints: JointState, fresh: bool) -> bool:
        """Return whether a joint is commanded to move and does not."""
        if self._stuck.holds(i, self._t_s):
            return True
        # Where a servo tells nothing, its place is no news of what it met.
        if joints.measured and not joints.measured[i]:
            return False
        command, position = self._motion.command[i], joints.position_rad[i]
        if fresh and self._stuck.found(i, command, position, joints.measured_s[i], self._t_s):
            self._retrying[i] = True
            return True
        return False

    def _give_way(self, i: int, reason: str, position: float, fresh: bool) -> _Hold:
        """Move the command back to where the joint is, and again if it is pushed away.

        Not all the time: a neck would sink under its own weight.
        """
        back = self._retreat[i]
        if fresh and (back is None or abs(back - position) > self._stuck.far_rad):
            self._retreat[i] = back = position
        return _Hold(reason, back, again="slowly")

    def _stand(self, i: int, hold: _Hold, dt_s: float) -> None:
        """Bring a joint to a stop, or to where it should be meanwhile."""
        if hold.again == "slowly":
            self._slow_down(i)
        if hold.goal is None:
            self._motion.brake(i, dt_s)
        elif hold.slowly:
            self._seek_gently(i, hold.goal, dt_s)
        else:
            limit = self._limits[i]
            self._motion.seek(i, hold.goal, dt_s, limit.speed_rad_s, limit.accel_rad_s2)

    def _seek_gently(
        self, i: int, goal: float, dt_s: float, top: float = inf, accel: float = inf
    ) -> None:
        """Go to a goal slowly; what a late tick costs of the slow speed is regained at once."""
        speed, soft = min(top, self._gentle_speed), min(accel, self._gentle_accel)
        self._motion.seek(i, goal, dt_s, speed, soft, regain=min(accel, self._late_accel))

    def _go(self, i: int, desired: float, position: float, dt_s: float) -> str:
        """Move a joint towards its desired angle as far as it may; return why it fell short."""
        motion, limit, share = self._motion, self._limits[i], self._health.share[i]
        began = motion.command[i]
        target = min(max(desired, motion.low[i]), motion.high[i])
        top, soft = share * limit.speed_rad_s, share * limit.accel_rad_s2
        if self._soft:
            soft = min(soft, self._late_accel)
        if self._gentle[i]:
            pull, lead = desired, self._stuck.lead_rad
            if self._retrying[i]:
                pull = min(max(desired, position - lead), position + lead)
            self._seek_gently(i, pull, dt_s, top, soft)
            if abs(target - motion.command[i]) < _NEAR_RAD and self._t_s >= self._gentle_until_s[i]:
                self._gentle[i] = self._retrying[i] = False
        elif self._soft or share < 1.0 or not motion.follow(i, desired, dt_s):
            motion.chase(i, desired, dt_s, top, soft)
        if abs(desired - target) > _ROUNDING_RAD:
            outside = not limit.low_rad <= desired <= limit.high_rad
            return "out of range" if outside else "self-collision"
        if self._gentle[i]:
            return "starting slowly"
        if abs(target - motion.command[i]) <= _ROUNDING_RAD:
            return ""
        if self._soft:
            return "after a late tick"
        fast = abs(target - began) > limit.speed_rad_s * dt_s
        return self._health.why[i] or ("too fast" if fast else "too hard")
