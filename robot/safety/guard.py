"""Guard between desired angles and the bus; it uses limits, measurements and ages, not gaze.

For any desired angles, the commands are finite, inside every joint's range, within its speed and
acceleration, always able to stop before the end of the range, and without collisions between
joints. A joint that is hot, overloaded, stuck or has too low a voltage slows down or stops
independently of the others. Angles are in rad.
"""

from math import inf, isfinite, radians
from typing import Literal, NamedTuple

from gazerig.robot.model.guard_params import GuardParams
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import GuardResult, JointAngles, JointState, Level
from gazerig.robot.safety.collisions import Collisions
from gazerig.robot.safety.health import FAR_RAD, LEAD_RAD, JointHealth, StallDetector
from gazerig.robot.safety.motion_limiter import LateTicks, LimitChange, MotionLimiter

_NEAR_RAD = radians(1.0)
_ROUNDING_RAD = 1e-9
JOINT_TIMEOUT_S = 0.15
"""A joint whose last measurement is older is stopped."""
FRAME_TIMEOUT_S = 1.5
"""The neck is stopped while the last frame is older."""
SOFT_START_S = 1.0
"""Shortest time of slow motion after torque-on."""
SOFT_START_RAD_S2 = radians(300.0)
"""Acceleration after torque-on and while parking."""
LATE_S = 0.05
LATE_RAD_S2 = radians(15_000.0)
"""Highest acceleration for ``LATE_S`` after a tick that missed its slot, because servos brake
without new goals; slow motion regains its speed with it.
"""
_LEVELS: tuple[Level, ...] = ("ok", "limited", "hold", "torque_off")


class _Hold(NamedTuple):
    """A reason for a joint not to follow its desired angle, and its motion meanwhile.

    Attributes:
        reason: The reason.
        goal: Angle to move to, None to stop.
        is_slow: Whether to move there slowly.
        restart: How the joint starts afterwards.
    """

    reason: str
    goal: float | None = None
    is_slow: bool = False
    restart: Literal["at once", "slowly"] = "at once"


class Guard:
    """The check of all commands, tick by tick.

    Args:
        params: Thresholds and times.
        limits: One limit per joint, as in the servos' own configuration.
        joints: The joints' names.
        period_s: Nominal time between ticks. Motion missed by a late tick is not made up for.

    Raises:
        ValueError: A collision leaves no pose inside the limits.
    """

    def __init__(
        self,
        params: GuardParams,
        limits: tuple[JointLimit, ...],
        joints: tuple[str, ...],
        period_s: float = 0.1,
    ) -> None:
        self._gentle_speed = radians(params.soft_start_speed_deg_s)
        self._late = LateTicks(period_s)
        self._soft = False
        self._names = joints
        self._neck = tuple("neck" in name.split("_") for name in joints)
        self._motion = MotionLimiter(limits)
        self._change = LimitChange(self._motion)
        self._limits = self._motion.limits
        self._health = JointHealth(limits)
        self._stuck = StallDetector(len(limits))
        self._collisions = Collisions(params.collisions, limits, joints)
        self.reset(0.0, tuple(0.5 * (limit.low_rad + limit.high_rad) for limit in limits))

    def retune(self, params: GuardParams, limits: tuple[JointLimit, ...]) -> list[int]:
        """Change the limits without a jump; counters and findings stay.

        A joint whose motion exceeds its new limit first comes to rest under the old one. A joint
        outside its new range then moves inside slowly. Limits wider than at the start have no
        effect, as the servos have those as well.

        Returns:
            The joints whose new limits are wider.

        Raises:
            ValueError: A collision leaves no pose inside the limits; nothing has changed.
        """
        self._collisions = Collisions(params.collisions, limits, self._names)
        self._gentle_speed = radians(params.soft_start_speed_deg_s)
        return self._change.retune(limits)

    def reset(self, t_s: float, command_rad: JointAngles) -> None:
        """Start slowly and at rest from the present goals on the bus."""
        self._t_s = t_s
        self._change.reset()
        self._held = [False] * len(self._limits)
        self._retrying = [False] * len(self._limits)
        self._retreat: list[float | None] = [None] * len(self._limits)
        self._health.reset()
        for i, angle in enumerate(command_rad):
            self._change.begin(i, angle)
            self._stuck.forget(i)
        self.start_gently()

    def start_gently(self) -> None:
        """Move slowly for some time; each joint also until it first reaches its desired angle."""
        for i in range(len(self._limits)):
            self._motion.forget_gaps(i)
        self._gentle = [True] * len(self._limits)
        self._gentle_until_s = [self._t_s + SOFT_START_S] * len(self._limits)

    @property
    def limits(self) -> tuple[JointLimit, ...]:
        """Return the present limits; new ones replace them as soon as joints keep them."""
        return tuple(self._limits)

    def check(
        self, desired_rad: JointAngles, joints: JointState, frame_age_s: float, t_s: float
    ) -> GuardResult:
        """Return the commands that may be sent now.

        Args:
            desired_rad: Any numbers including NaN.
            joints: Measured joints.
            frame_age_s: Age of the newest frame, infinity before the first.
            t_s: Present time.
        """
        if any(joints.rearmed):
            for i, (angle, rearmed) in enumerate(
                zip(joints.position_rad, joints.rearmed, strict=True)
            ):
                if rearmed and isfinite(angle):
                    self._change.begin(i, angle)
                    self._stuck.forget(i)
                    self._retreat[i] = None
                    self._slow_down(i)
        since_s = t_s - self._t_s
        if not (since_s > 0.0 and isfinite(since_s)):
            command = tuple(self._motion.command)
            reasons = ("all: time does not advance",)
            why = ("time does not advance",) * len(command)
            return GuardResult(command, "hold", reasons, desired_rad, why, reasons, self._names)
        self._t_s = t_s
        if self._change.waiting or self._change.outside:
            self._change.step(bool(self._collisions))
        dt_s, missed_s = self._late.split(since_s, t_s, LATE_S)
        if missed_s > 0.0:
            self._motion.record_gap(missed_s)
        self._soft = t_s < self._late.soft_until_s
        self._health.step(joints, dt_s)
        if self._collisions:
            self._collisions.set_walls(self._motion, desired_rad, joints.position_rad, self._held)
        no_frame = not frame_age_s <= FRAME_TIMEOUT_S
        return self._joints(desired_rad, joints, no_frame, dt_s)

    def _joints(
        self, desired_rad: JointAngles, joints: JointState, no_frame: bool, dt_s: float
    ) -> GuardResult:
        """Move all joints; nearly every desired angle is returned unchanged."""
        motion, stale_s = self._motion, self._t_s - JOINT_TIMEOUT_S
        short: dict[int, tuple[int, str]] = {}
        followed = True
        rows = zip(desired_rad, joints.position_rad, joints.measured_s, motion.command, strict=True)
        for i, (desired, position, at_s, now) in enumerate(rows):
            is_near = -FAR_RAD <= now - position <= FAR_RAD and not self._stuck.watched[i]
            is_well = is_near and at_s >= stale_s and self._is_well(i, joints, no_frame)
            if is_well and motion.follow(i, desired, dt_s):
                continue
            followed = False
            unseen = no_frame and self._neck[i]
            outcome = self._move_joint(i, desired, joints, at_s >= stale_s, unseen, dt_s)
            if outcome[1]:
                short[i] = outcome
        if followed:
            return GuardResult(desired_rad, "ok", (), desired_rad, (), (), self._names)
        return self._result(short, desired_rad)

    def _is_well(self, i: int, joints: JointState, no_frame: bool) -> bool:
        """Return whether only limit, age and distance of a joint must be checked."""
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

    def _slow_down(self, i: int) -> None:
        """Make a joint continue slowly, as after torque is switched on."""
        if not self._gentle[i]:
            self._motion.forget_gaps(i)
        self._gentle[i] = True
        self._gentle_until_s[i] = self._t_s + SOFT_START_S

    def _move_joint(
        self, i: int, desired: float, joints: JointState, fresh: bool, unseen: bool, dt_s: float
    ) -> tuple[int, str]:
        """Move a joint; return the rank of its level and the reason, 0 and "" if it follows."""
        position = joints.position_rad[i]
        fault = joints.fault[i] if joints.fault else ""
        fresh = fresh and isfinite(position)
        hold = self._servo_hold(i, joints, fault, fresh)
        self._held[i] = hold is not None
        if hold is None:
            self._retreat[i] = None
            hold = self._outer_hold(i, desired, unseen)
        if fault:  # a joint that still moves is parking
            self._slow_down(i)
        if hold is not None:
            if hold.restart == "slowly":
                self._slow_down(i)
            if hold.goal is None:
                self._motion.brake(i, dt_s)
            elif hold.is_slow:
                self._seek_gently(i, hold.goal, dt_s)
            else:
                limit = self._limits[i]
                self._motion.seek(i, hold.goal, dt_s, limit.speed_rad_s, limit.accel_rad_s2)
            rank, reason = 2, hold.reason
        else:
            reason = self._move_towards(i, desired, position, dt_s)
            rank = 1 if reason else 0
        return (3, fault) if fault else (rank, reason)

    def _servo_hold(self, i: int, joints: JointState, fault: str, fresh: bool) -> _Hold | None:
        """Return the hold of a joint whose servo cannot or must not follow, otherwise None."""
        position = joints.position_rad[i]
        powered = joints.torque[i] if joints.torque else not fault
        if not powered:
            # The command follows the position, so that nothing jumps when torque is switched on.
            self._stuck.forget(i)
            return _Hold("torque off", position if isfinite(position) else None, restart="slowly")
        if "encoder" in fault:
            return _Hold(fault)
        if self._is_stalled(i, joints, fresh):
            return self._retreat_to(i, "not moving", position, fresh)
        strain = self._health.held[i]
        if strain == "overloaded":
            return self._retreat_to(i, strain, position, fresh)
        if not fresh:
            return _Hold("stale joints")
        return _Hold(strain, restart="slowly") if strain else None

    def _outer_hold(self, i: int, desired: float, unseen: bool) -> _Hold | None:
        """Return the hold of a joint for reasons other than its servo, otherwise None."""
        if i in self._change.waiting:
            return _Hold("new limits")
        if i in self._collisions.exits:
            return _Hold(
                "self-collision", self._collisions.exits[i], is_slow=True, restart="slowly"
            )
        if i in self._collisions.still:
            return _Hold("self-collision", restart="slowly")
        if i in self._change.outside:
            limit = self._limits[i]
            end = limit.low_rad if self._motion.command[i] < limit.low_rad else limit.high_rad
            return _Hold("outside its new range", end, True, "slowly")
        if not isfinite(desired):
            return _Hold("not finite")
        return _Hold("stale frame") if unseen else None

    def _is_stalled(self, i: int, joints: JointState, fresh: bool) -> bool:
        """Return whether a joint does not move although it is commanded to."""
        if self._stuck.is_waiting(i, self._t_s):
            return True
        # Without feedback the position is estimated and shows no obstacle.
        if joints.measured and not joints.measured[i]:
            return False
        command, position = self._motion.command[i], joints.position_rad[i]
        if fresh and self._stuck.has_stalled(i, command, position, joints.measured_s[i], self._t_s):
            self._retrying[i] = True
            return True
        return False

    def _retreat_to(self, i: int, reason: str, position: float, fresh: bool) -> _Hold:
        """Move the command back to the joint's position, and again if the joint is pushed away.

        The command does not follow continuously: a neck would sink under its own weight.
        """
        back = self._retreat[i]
        if fresh and (back is None or abs(back - position) > FAR_RAD):
            self._retreat[i] = back = position
        return _Hold(reason, back, restart="slowly")

    def _seek_gently(
        self, i: int, goal: float, dt_s: float, top: float = inf, accel: float = inf
    ) -> None:
        """Move to a goal slowly; slow speed lost by a late tick is regained immediately."""
        speed, soft = min(top, self._gentle_speed), min(accel, SOFT_START_RAD_S2)
        self._motion.seek(i, goal, dt_s, speed, soft, regain=min(accel, LATE_RAD_S2))

    def _move_towards(self, i: int, desired: float, position: float, dt_s: float) -> str:
        """Move a joint towards its desired angle; return why it does not reach it, or ""."""
        motion, limit, share = self._motion, self._limits[i], self._health.share[i]
        began = motion.command[i]
        target = min(max(desired, motion.low[i]), motion.high[i])
        top, soft = share * limit.speed_rad_s, share * limit.accel_rad_s2
        if self._soft:
            soft = min(soft, LATE_RAD_S2)
        if self._gentle[i]:
            pull, lead = desired, LEAD_RAD
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

    def _result(self, short: dict[int, tuple[int, str]], desired_rad: JointAngles) -> GuardResult:
        """Return the result of a tick; its level is that of the worst joint.

        Args:
            short: Rank, 1 (limited) to 3 (torque_off), and reason by the number of each joint that
                does not follow.
            desired_rad: Desired angles.
        """
        command, names = tuple(self._motion.command), self._names
        if not short:
            return GuardResult(command, "ok", (), desired_rad, (), (), names)
        worst = max(rank for rank, _ in short.values())
        reasons = {i: f"{names[i]}: {reason}" for i, (_, reason) in short.items()}
        why = tuple([short[i][1] if i in short else "" for i in range(len(names))])
        critical = tuple([reasons[i] for i, (rank, _) in short.items() if rank == worst])
        return GuardResult(
            command, _LEVELS[worst], tuple(reasons.values()), desired_rad, why, critical, names
        )
