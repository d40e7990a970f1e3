"""Slow motion of a rig, joint by joint or together.

It uses neither camera nor attention. Every goal passes the guard, and the caller receives the
applied result:

    control = ManualControl(body, guard, RealClock())
    control.start()
    try:
        moved = control.jog("neck_yaw", 20.0)
        print(moved.joints["neck_yaw"])
    finally:
        control.stop()

Between two calls nothing is sent: Dynamixel servos are held by their own bus watchdog, others
stay at their last goal, or lose their torque if a guardian watches them
(gazerig.robot.guardian, after .4 s), and the next call continues from there.
"""

from collections.abc import Callable, Mapping, Sequence
from math import degrees, isfinite, radians, sqrt
from typing import NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.gaze.minimum_jerk import Quintic
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.commands import refuse_out_of_range
from gazerig.robot.loop.power_down import Again
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import Jog
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import GuardResult, JointAngles, JointState
from gazerig.robot.safety.guard import Guard

PASSING = ("starting slowly", "too hard", "too fast")
"""Reasons about the approach to a goal, which can still be reached."""

RATE_HZ = 100.0
"""Goals per second."""
SPEED_DEG_S = 20.0

_ACCEL_DEG_S2 = 100.0
_NEAR_RAD = radians(2.0)  # a nearer joint has arrived
_STILL_RAD_S = radians(2.0)
_TIMEOUT_S = 2.0  # time to come near after the way is over
# Peaks of a fifth-order polynomial from rest to rest, in distance/time and distance/time^2.
_PEAK_SPEED, _PEAK_ACCEL = 1.875, 5.774


class JointMove(NamedTuple):
    """Result of a movement for one joint, in degrees.

    desired, commanded: the goal, and the final command of the guard
    measured: present angle
    reasons: the guard's reasons for differences; empty without differences
    estimated: whether its servo has no sensor, so that measured follows from the goal and its speed
    """

    joint: str
    desired: float
    commanded: float
    measured: float
    reasons: tuple[str, ...]
    estimated: bool

    def __str__(self) -> str:
        """Write one line."""
        at = "estimated" if self.estimated else "measured"
        line = f"{self.joint}: desired {_deg(self.desired)}, {at} {_deg(self.measured)} deg"
        if abs(self.commanded - self.desired) > 0.05:
            line += f", commanded {_deg(self.commanded)}"
        return f"{line} ({', '.join(self.reasons)})" if self.reasons else line


class Step(NamedTuple):
    """One exchange with the servos: desired, commanded and measured joints."""

    t_s: float
    desired_rad: JointAngles
    guard_result: GuardResult
    joints: JointState


class MoveResult(NamedTuple):
    """Result of a movement.

    end_reason: "arrived", "held back" (by the guard), "not there in time", "torque_off", or the
        reason given by ``stopped``
    events: reports of the bus during it; last: the last exchange
    """

    end_reason: str
    seconds: float
    joints: dict[str, JointMove]
    events: tuple[str, ...]
    last: Step

    @property
    def arrived(self) -> bool:
        """Return whether every moving joint reached its goal."""
        return self.end_reason == "arrived"

    def __str__(self) -> str:
        """Write the result, with the reasons by joint."""
        reasons = [
            f"{part.joint}: {', '.join(part.reasons)}"
            for part in self.joints.values()
            if part.reasons
        ]
        return f"{self.end_reason} ({'; '.join(reasons)})" if reasons else self.end_reason


def _deg(angle: float) -> str:
    """Format an angle, with zero without a sign."""
    return f"{round(angle, 1) + 0.0:.1f}"


def no_reason() -> str | None:
    """Return no reason to stop."""
    return None


class ManualControl:
    """Control of a rig by the goals of a person.

    Args:
        body: the joints of one rig.
        guard: guard of the same rig.
        clock: clock of the host, or a simulated one with the emulated bus.
        speed_deg_s: top speed on the way; the guard's gentle speed holds as well.
        stopped: called at every step; returns why to stop, None without a reason.
    """

    def __init__(
        self,
        body: Body,
        guard: Guard,
        clock: Clock,
        speed_deg_s: float = SPEED_DEG_S,
        stopped: Callable[[], str | None] = no_reason,
    ) -> None:
        self.body = body
        self._guard = guard
        self._clock = clock
        self._speed_deg_s = speed_deg_s
        self._stopped = stopped
        self._goal: JointAngles = ()

    def start(self) -> None:
        """Open the bus and switch torque on at the present pose.

        Raises:
            SetupError: port or servos are not as configured.
        """
        self._goal = self.body.start(self._clock)
        self._guard.reset(self._clock.now_s(), self._goal)

    def stop(self) -> tuple[str, ...]:
        """Switch torque off and close the bus; return the bus's messages."""
        return self.body.stop()

    def jog(self, joint: str, angle_deg: float) -> MoveResult:
        """Move one joint slowly; the others hold.

        Raises:
            SetupError: the joint does not exist, or the angle is not a number or
                outside the joint's range.
            DriverError: the bus has disappeared.
        """
        refuse_angle(joint, angle_deg, self.body.names, self._guard.limits)
        return self.pose({joint: angle_deg})

    def pose(self, angles_deg: Mapping[str, float]) -> MoveResult:
        """Move several joints slowly, so that they arrive together; the others hold.

        Raises:
            SetupError: the joint does not exist, or an angle is not a number.
            DriverError: the bus has disappeared.
        """
        names, start = self.body.names, self._goal
        for name, angle in angles_deg.items():
            _refuse_unknown(name, angle, names)
        desired = tuple(
            radians(angles_deg[name]) if name in angles_deg else held
            for name, held in zip(names, start, strict=True)
        )
        far_deg = max((degrees(abs(a - b)) for a, b in zip(desired, start, strict=True)), default=0)
        slow_s = _PEAK_SPEED * far_deg / self._speed_deg_s
        way_s = max(0.05, slow_s, sqrt(_PEAK_ACCEL * far_deg / _ACCEL_DEG_S2))
        ways = [Quintic((a, 0.0, 0.0), b, 1.0) for a, b in zip(start, desired, strict=True)]
        moving = [i for i, name in enumerate(names) if name in angles_deg]

        def on_the_way(passed_s: float) -> JointAngles:
            return tuple(way.state_at(min(1.0, passed_s / way_s))[0] for way in ways)

        def is_there(step: Step, passed_s: float) -> str | None:
            return None if passed_s < way_s else _rest_result(step, desired, moving)

        return self._follow(on_the_way, is_there, way_s + _TIMEOUT_S, desired, gently=True)

    def hold(self, seconds: float) -> MoveResult:
        """Hold the present goals for a time.

        Raises:
            DriverError: the bus has disappeared.
        """
        goal = self._goal
        return self._follow(
            lambda _: goal, lambda _, passed_s: "arrived" if passed_s >= seconds else None, seconds,
            goal,
        )  # fmt: skip

    def park(
        self, angles_deg: Mapping[str, float], stopped: Callable[[], str | None] = no_reason
    ) -> MoveResult:
        """Move to a pose despite earlier requests to stop; omitted joints move to 0.

        stopped: called at every step; returns why to stop, None without a reason

        Raises:
            DriverError: the bus has disappeared.
        """
        before, self._stopped = self._stopped, stopped
        try:
            return self.pose({name: angles_deg.get(name, 0.0) for name in self.body.names})
        finally:
            self._stopped = before

    def _follow(
        self,
        desired_at: Callable[[float], JointAngles],
        done: Callable[[Step, float], str | None],
        longest_s: float,
        ends_on: JointAngles,
        gently: bool = False,
    ) -> MoveResult:
        """Send desired poses through the guard until there is a reason to end.

        desired_at: returns the pose at a time since the start, s
        done: returns the reason of the end for a step and that time, None to continue
        longest_s: time after which the motion ends with "not there in time"
        ends_on: pose with which the result is compared
        gently: whether the guard moves slowly throughout, not only at the start
        """
        clock, start_s, slot = self._clock, self._clock.now_s(), 0
        reasons: dict[str, dict[str, None]] = {}
        events, ended = list(self.body.bus.events()), None
        while ended is None:
            slot = max(slot + 1, int((clock.now_s() - start_s) * RATE_HZ))
            clock.sleep_until(start_s + slot / RATE_HZ)
            if gently:
                self._guard.start_gently()
            t_s = clock.now_s()
            passed_s = t_s - start_s
            joints, desired = self.body.read(t_s), desired_at(passed_s)
            # No camera is used here, so no frame can be too old.
            result = self._guard.check(desired, joints, 0.0, t_s)
            self.body.write(result.command_rad)
            self._goal, step = result.command_rad, Step(t_s, desired, result, joints)
            for line in result.reasons:
                joint, _, reason = line.partition(": ")
                if reason not in PASSING:
                    reasons.setdefault(joint, {})[reason] = None
            events += self.body.bus.events()
            ended = done(step, passed_s) or self._stopped()
            if result.level == "torque_off":
                ended = "torque_off"
            elif ended is None and passed_s >= longest_s:
                ended = "not there in time"
        measured = joints.measured or (True,) * len(result.joints)
        rows = zip(result.joints, ends_on, self._goal, joints.position_rad, measured, strict=True)
        moves = {
            name: JointMove(
                name, degrees(wanted), degrees(goal), degrees(at),
                (*reasons.get(name, {}), *reasons.get("all", {})), not has_sensor,
            )
            for name, wanted, goal, at, has_sensor in rows
        }  # fmt: skip
        return MoveResult(ended, passed_s, moves, tuple(events), step)


def _rest_result(step: Step, desired: JointAngles, moving: Sequence[int]) -> str | None:
    """Return the result for joints at rest: at their goals or held back; None while they move."""
    joints, result, held = step.joints, step.guard_result, False
    for i in moving:
        at = joints.position_rad[i]
        if abs(joints.velocity_rad_s[i]) > _STILL_RAD_S:
            return None
        if abs(at - desired[i]) <= _NEAR_RAD:
            continue
        if abs(at - result.command_rad[i]) > _NEAR_RAD or any(
            f"{result.joints[i]}: {reason}" in result.reasons for reason in PASSING
        ):
            return None
        held = True
    return "held back" if held else "arrived"


def park_slowly(control: ManualControl, park_deg: Mapping[str, float], again: Again) -> str:
    """Park slowly unless the user repeats the request to end; return the result as text."""
    moved = control.park(park_deg, lambda: "interrupted" if again() else None)
    return "parked" if moved.arrived else f"not parked ({moved})"


def _refuse_unknown(joint: str, angle_deg: float, joints: Sequence[str]) -> None:
    if joint not in joints:
        raise SetupError(f"no joint {joint!r}; available: {', '.join(joints)}")
    if not isfinite(angle_deg):
        raise SetupError(f"{joint}: {angle_deg} is not an angle in degrees")


def refuse_angle(
    joint: str, angle_deg: float, joints: Sequence[str], limits: Sequence[JointLimit]
) -> None:
    """Refuse an unknown joint, or an angle outside its range, before anything moves.

    Raises:
        SetupError: with the joints or the range.
    """
    _refuse_unknown(joint, angle_deg, joints)
    try:
        refuse_out_of_range(Jog(((joint, radians(angle_deg)),)), joints, limits)
    except ValueError as error:
        raise SetupError(str(error)) from None
