"""Slow motion of a rig, joint by joint or together, for bring-up and for users' programs.

It uses neither camera nor attention. Every goal passes the guard, and the caller receives the
applied result:

    control = ManualControl(body, guard, RealClock())
    control.start()
    try:
        moved = control.jog("neck_yaw", 20.0)
        print(moved.of("neck_yaw"))
    finally:
        control.stop()

Between two calls nothing is sent: Dynamixel servos are held by their own bus watchdog, others
stay at their last goal, or lose their torque if a guardian watches them
(gazerig.robot.guardian, after .4 s), and the next call continues from there.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import degrees, isfinite, radians, sqrt
from typing import Annotated, NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.gaze.minimum_jerk import Quintic
from gazerig.params import Bounds
from gazerig.robot.control.body import Body
from gazerig.robot.control.command_choices import refuse_out_of_range
from gazerig.robot.control.observers import failure_text
from gazerig.robot.control.power_down import Again
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import Jog
from gazerig.robot.model.joint import JointLimit
from gazerig.robot.model.types import GuardResult, JointAngles, JointState, Level
from gazerig.robot.safety.guard import Guard

PASSING = ("starting slowly", "too hard", "too fast")
"""Reasons about the approach to a goal, which can still be reached."""

_STILL_DEG_S = 2.0


class JointMove(NamedTuple):
    """Result of a movement for one joint, in degrees.

    desired, commanded: the goal, and the final command of the guard
    measured: present angle; error: measured minus desired
    reasons: the guard's reasons for differences; empty without differences
    estimated: whether its servo has no sensor, so that measured follows from the goal and its speed
    """

    joint: str
    desired: float
    commanded: float
    measured: float
    reasons: tuple[str, ...]
    estimated: bool = False

    @property
    def error(self) -> float:
        """Return the distance of the joint from its goal."""
        return self.measured - self.desired

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
    level: the guard's last level; events: reports of the bus during it
    last: the last exchange
    """

    end_reason: str
    seconds: float
    joints: tuple[JointMove, ...]
    level: Level
    events: tuple[str, ...]
    last: Step

    @property
    def arrived(self) -> bool:
        """Return whether every moving joint reached its goal."""
        return self.end_reason == "arrived"

    def __str__(self) -> str:
        """Write the result, with the reasons by joint."""
        reasons = [f"{part.joint}: {', '.join(part.reasons)}" for part in self.remarkable_joints()]
        return f"{self.end_reason} ({'; '.join(reasons)})" if reasons else self.end_reason

    def joint_move(self, joint: str) -> JointMove:
        """Return one joint's result."""
        return next(part for part in self.joints if part.joint == joint)

    def remarkable_joints(self) -> tuple[JointMove, ...]:
        """Return the joints with reasons."""
        return tuple(part for part in self.joints if part.reasons)


class GuardReasons:
    """Reasons of the guard by joint, in order of occurrence, each once."""

    def __init__(self) -> None:
        self._by_joint: dict[str, dict[str, None]] = {}

    def add(self, guard_result: GuardResult) -> None:
        """Add the reasons of a guard result, except those about the approach to a goal."""
        for line in guard_result.reasons:
            joint, _, reason = line.partition(": ")
            if reason not in PASSING:
                self._by_joint.setdefault(joint, {})[reason] = None

    def joint_reasons(self, joint: str) -> tuple[str, ...]:
        """Return the reasons of one joint, including those of all joints."""
        return (*self._by_joint.get(joint, {}), *self._by_joint.get("all", {}))


def move_result(step: Step, desired: JointAngles, notes: GuardReasons) -> tuple[JointMove, ...]:
    """Return every joint's result of a movement."""
    guard_result, joints = step.guard_result, step.joints
    has_feedback = joints.measured or (True,) * len(guard_result.joints)
    rows = zip(
        guard_result.joints,
        desired,
        guard_result.command_rad,
        joints.position_rad,
        has_feedback,
        strict=True,
    )
    return tuple(
        JointMove(
            name, degrees(asked), degrees(let), degrees(at), notes.joint_reasons(name), not tells
        )
        for name, asked, let, at, tells in rows
    )


def rest_result(
    step: Step, desired: JointAngles, moving: Iterable[int], near_rad: float
) -> str | None:
    """Return the result for joints at rest: at their goals or held back; None while they move."""
    joints, command = step.joints, step.guard_result.command_rad
    held = False
    for i in moving:
        at = joints.position_rad[i]
        if abs(joints.velocity_rad_s[i]) > radians(_STILL_DEG_S):
            return None
        if abs(at - desired[i]) <= near_rad:
            continue
        passing = any(
            f"{step.guard_result.joints[i]}: {reason}" in step.guard_result.reasons
            for reason in PASSING
        )
        if passing or abs(at - command[i]) > near_rad:
            return None
        held = True
    return "held back" if held else "arrived"


def _deg(angle: float) -> str:
    """Format an angle, with zero without a sign."""
    return f"{round(angle, 1) + 0.0:.1f}"


_PEAK_SPEED, _PEAK_ACCEL = 1.875, 5.774
"""Peaks of a fifth-order polynomial from rest to rest, in distance/time and distance/time^2."""


@dataclass(frozen=True)
class JogParams:
    """Speed of a slow move, and criteria for a reached goal."""

    # fmt: off
    speed_deg_s: Annotated[float, Bounds(0.5, 200), "top speed on the way; the guard's gentle speed holds as well"] = 20.0
    accel_deg_s2: Annotated[float, Bounds(5, 5000), "top acceleration"] = 100.0
    rate_hz: Annotated[float, Bounds(20, 500), "goals a second"] = 100.0
    near_deg: Annotated[float, Bounds(0.1, 20), "nearer is arrived"] = 2.0
    timeout_s: Annotated[float, Bounds(0.1, 30), "time to come near after the way is over"] = 2.0
    # fmt: on


DesiredPose = Callable[[JointState, float, float], JointAngles]
"""Returns the desired pose for measured joints, the time, and the time since the last step."""

Done = Callable[[Step], str | None]
"""Returns the reason of the end, None while the motion continues."""


def no_reason() -> str | None:
    """Return no reason to stop."""
    return None


class ManualControl:
    """Control of a rig by the goals of a person.

    Args:
        body: the joints of one rig.
        guard: guard of the same rig.
        clock: clock of the host, or a simulated one with the emulated bus.
        params: speed of the motion.
        stopped: called at every step; returns why to stop, None without a reason.
        watch: receives every step.
    """

    def __init__(
        self,
        body: Body,
        guard: Guard,
        clock: Clock,
        params: JogParams | None = None,
        stopped: Callable[[], str | None] = no_reason,
        watch: Callable[[Step], None] | None = None,
    ) -> None:
        self.body = body
        self._guard = guard
        self._clock = clock
        self._params = params if params is not None else JogParams()
        self._stopped = stopped
        self._watch = watch
        self._goal: JointAngles = ()
        self._said: list[str] = []

    @property
    def goal_rad(self) -> JointAngles:
        """Return the active goals."""
        return self._goal

    def start(self) -> JointAngles:
        """Open the bus and switch torque on at the present pose; return the active goals.

        Raises:
            SetupError: port or servos are not as configured.
        """
        self._goal = self.body.start(self._clock)
        self._guard.reset(self._clock.now_s(), self._goal)
        return self._goal

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
        names = self.body.names
        refuse_unknown(angles_deg, names)
        desired = tuple(
            radians(angles_deg[name]) if name in angles_deg else held
            for name, held in zip(names, self._goal, strict=True)
        )
        moving = tuple(i for i, name in enumerate(names) if name in angles_deg)
        start_s = self._clock.now_s()
        ways = [Quintic((g, 0.0, 0.0), w, 1.0) for g, w in zip(self._goal, desired, strict=True)]
        far = max((abs(desired[i] - self._goal[i]) for i in moving), default=0.0)
        takes_s = duration_s(far, self._params)

        def on_the_way(_: JointState, t_s: float, __: float) -> JointAngles:
            share = min(1.0, (t_s - start_s) / takes_s)
            return tuple(way.state_at(share)[0] for way in ways)

        def there(step: Step) -> str | None:
            if step.t_s - start_s < takes_s:
                return None
            return rest_result(step, desired, moving, radians(self._params.near_deg))

        longest_s = takes_s + self._params.timeout_s
        return self.follow(on_the_way, there, longest_s, desired, gently=True)

    def hold(self, seconds: float) -> MoveResult:
        """Hold the present goals for a time.

        Raises:
            DriverError: the bus has disappeared.
        """
        goal, end_s = self._goal, self._clock.now_s() + seconds
        return self.follow(
            lambda *_: goal, lambda s: "arrived" if s.t_s >= end_s else None, seconds
        )

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

    def follow(
        self,
        desired: DesiredPose,
        done: Done,
        longest_s: float,
        ends_on: JointAngles | None = None,
        gently: bool = False,
    ) -> MoveResult:
        """Send desired poses through the guard until ``done`` returns the reason of the end.

        longest_s: time after which the motion ends with "not there in time"
        ends_on: pose with which the result is compared; None: the last one
        gently: whether the guard moves slowly throughout, not only at the start

        Raises:
            DriverError: the bus has disappeared.
        """
        clock, period = self._clock, 1.0 / self._params.rate_hz
        start_s = last_s = clock.now_s()
        slot, notes, events = 0, GuardReasons(), list(self.body.bus.events())
        while True:
            slot = max(slot + 1, int((clock.now_s() - start_s) / period))
            clock.sleep_until(start_s + slot * period)
            if gently:
                self._guard.start_gently()
            t_s = clock.now_s()
            joints = self.body.read(t_s)
            wanted = desired(joints, t_s, t_s - last_s)
            # No camera is used here, so no frame can be too old.
            guard_result = self._guard.check(wanted, joints, 0.0, t_s)
            self.body.write(guard_result.command_rad)
            step, last_s = Step(t_s, wanted, guard_result, joints), t_s
            if self._watch is not None:
                try:
                    self._watch(step)
                except Exception as error:
                    self._watch = None
                    self._said.append(failure_text("who watches", error))
            notes.add(step.guard_result)
            events += self.body.bus.events()
            ended = done(step) or self._stopped()
            ended = "torque_off" if step.guard_result.level == "torque_off" else ended
            if ended is None and step.t_s - start_s >= longest_s:
                ended = "not there in time"
            if ended is not None:
                break
        self._goal = step.guard_result.command_rad
        applied = move_result(step, step.desired_rad if ends_on is None else ends_on, notes)
        level = step.guard_result.level
        events += self._said
        self._said.clear()
        return MoveResult(ended, step.t_s - start_s, applied, level, tuple(events), step)


def park_slowly(control: ManualControl, park_deg: Mapping[str, float], again: Again) -> str:
    """Park slowly unless the user repeats the request to end; return the result as text."""
    moved = control.park(park_deg, lambda: "interrupted" if again() else None)
    return "parked" if moved.arrived else f"not parked ({moved})"


def duration_s(distance_rad: float, params: JogParams) -> float:
    """Return the time of a move from rest to rest within speed and acceleration."""
    far = degrees(abs(distance_rad))
    slow = _PEAK_SPEED * far / params.speed_deg_s
    return max(0.05, slow, sqrt(_PEAK_ACCEL * far / params.accel_deg_s2))


def refuse_unknown(angles_deg: Mapping[str, float], joints: tuple[str, ...]) -> None:
    """Refuse unknown joints, and angles that are not numbers.

    Raises:
        SetupError: the message lists the available joints.
    """
    for name, angle in angles_deg.items():
        if name not in joints:
            raise SetupError(f"no joint {name!r}; available: {', '.join(joints)}")
        if not isfinite(angle):
            raise SetupError(f"{name}: {angle} is not an angle in degrees")


def refuse_angle(
    joint: str, angle_deg: float, joints: tuple[str, ...], limits: Sequence[JointLimit]
) -> None:
    """Refuse an angle outside a joint's range, before anything moves.

    Raises:
        SetupError: with the range.
    """
    refuse_unknown({joint: angle_deg}, joints)
    try:
        refuse_out_of_range(Jog(((joint, radians(angle_deg)),)), joints, limits)
    except ValueError as error:
        raise SetupError(str(error)) from None
