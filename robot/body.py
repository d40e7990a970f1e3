"""Joints to servos and back: the only place that knows what a step means at a joint."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import ceil, floor, inf, pi, radians

from drivers.dynamixel_table import MODELS
from drivers.types import ServoBus, ServoReading, ServoSetup
from robot.safety.guard import JointLimit
from robot.types import JOINTS, JointAngles, JointState

_STEPS_PER_RAD = 4096.0 / (2.0 * pi)  # all Dynamixel X servos


@dataclass(frozen=True)
class JointParams:
    """One joint: its servo, how it is built in, and its limits."""

    id: int = field(metadata={"low": 0, "high": 252, "unit": "", "says": "servo id"})
    model: str = field(metadata={"unit": "", "says": 'servo model, e.g. "xl330-m077"'})
    min_deg: float = field(
        metadata={"low": -180.0, "high": 180.0, "unit": "deg", "says": "lowest joint angle"}
    )
    max_deg: float = field(
        metadata={"low": -180.0, "high": 180.0, "unit": "deg", "says": "highest joint angle"}
    )
    max_speed_deg_s: float = field(
        metadata={"low": 1.0, "high": 2000.0, "unit": "deg/s", "says": "top speed of the joint"}
    )
    max_accel_deg_s2: float = field(
        metadata={
            "low": 10.0,
            "high": 200000.0,
            "unit": "deg/s2",
            "says": "top acceleration of the joint",
        }
    )
    sign: int = field(
        default=1,
        metadata={
            "choices": (1, -1),
            "unit": "",
            "says": "1 where more steps turn the joint left, up, open or right ear down; else -1",
        },
    )
    ratio: float = field(
        default=1.0,
        metadata={
            "low": 0.05,
            "high": 50.0,
            "unit": "",
            "says": "turns of the servo for one turn of the joint",
        },
    )
    zero_step: int = field(
        default=2048,
        metadata={"low": 0, "high": 4095, "unit": "steps", "says": "servo position at 0 deg"},
    )
    gains: tuple[int, int, int] | None = field(
        default=None,
        metadata={
            "low": 0,
            "high": 16383,
            "unit": "",
            "says": "the servo's Position P, I and D Gain; null: left as they are",
        },
    )
    strength: float | None = field(
        default=None,
        metadata={
            "low": 0.05,
            "high": 1.0,
            "unit": "",
            "says": "share of its full drive that the servo may use (PWM Limit), which bounds "
            "force and top speed alike; null: left as it is",
        },
    )
    firmware_min: int = field(
        default=0,
        metadata={"low": 0, "high": 255, "unit": "", "says": "oldest servo firmware that will do"},
    )

    def __post_init__(self) -> None:
        """Check that the limits fit each other and the servo's one turn.

        Raises:
            ValueError: they do not; the message says which.
        """
        if self.min_deg >= self.max_deg:
            raise ValueError(f"min_deg {self.min_deg} must be below max_deg {self.max_deg}")
        if not self.min_deg <= 0.0 <= self.max_deg:
            raise ValueError("0 deg, the centre, must lie between min_deg and max_deg")
        for key, angle in (("min_deg", self.min_deg), ("max_deg", self.max_deg)):
            steps = self.steps(radians(angle))
            if not 0.0 <= steps <= 4095.0:
                raise ValueError(
                    f"{key} {angle} lies at step {steps:.0f}, outside the servo's 0..4095"
                )

    def steps(self, angle_rad: float) -> float:
        """Give the servo position of a joint angle, not rounded."""
        return self.zero_step + self.sign * self.ratio * angle_rad * _STEPS_PER_RAD

    def angle_rad(self, steps: float) -> float:
        """Give the joint angle of a servo position."""
        return (steps - self.zero_step) / (self.sign * self.ratio * _STEPS_PER_RAD)

    def limit(self) -> JointLimit:
        """Give the limits in radians, and those of the servo's own protection."""
        model = MODELS.get(self.model)
        own = (
            (float(model.temperature_limit), 0.1 * model.min_voltage, 0.1 * model.max_voltage)
            if model is not None
            else ()
        )
        return JointLimit(
            radians(self.min_deg),
            radians(self.max_deg),
            radians(self.max_speed_deg_s),
            radians(self.max_accel_deg_s2),
            *own,
        )

    def setup(self, name: str = "") -> ServoSetup:
        """Give what the bus must know: the range rounded inwards, the speed at the servo."""
        ends = sorted((self.steps(radians(self.min_deg)), self.steps(radians(self.max_deg))))
        speed = radians(self.max_speed_deg_s) * self.ratio * _STEPS_PER_RAD
        return ServoSetup(
            self.id,
            self.model,
            ceil(ends[0]),
            floor(ends[1]),
            speed,
            name,
            self.firmware_min,
            self.gains,
            self.strength,
        )


class Body:
    """All joints of one rig on one bus."""

    def __init__(self, bus: ServoBus, joints: Mapping[str, JointParams]) -> None:
        """Take the bus, made with the setups in the order of JOINTS, and the joints."""
        self.bus = bus
        self._set_up = tuple(joints[name] for name in JOINTS)
        self._take(self._set_up)
        # Before the first answer: the centre, of an age that says so.
        self._last = [ServoReading(zero, 0.0, 0.0, -inf, False) for zero in self._zero]

    def _take(self, joints: tuple[JointParams, ...]) -> None:
        self._joints = joints
        self._scale = tuple(1.0 / (j.sign * j.ratio * _STEPS_PER_RAD) for j in joints)
        self._zero = tuple(joint.zero_step for joint in joints)

    def retune(self, joints: Mapping[str, JointParams]) -> dict[int, tuple[float, float]]:
        """Count angles otherwise from now on; the servos are set up anew when torque comes on.

        Gives, for each joint whose angles are other ones now, (factor, offset in radians):
        what was x is factor x + offset.
        """
        before = self._joints
        self._take(tuple(joints[name] for name in JOINTS))
        self.bus.retune(
            [joint.setup(name) for name, joint in zip(JOINTS, self._joints, strict=True)]
        )
        return {
            i: (
                now.angle_rad(old.steps(1.0)) - now.angle_rad(old.steps(0.0)),
                now.angle_rad(old.steps(0.0)),
            )
            for i, (old, now) in enumerate(zip(before, self._joints, strict=True))
            if not _counts_alike(old, now)
        }

    def reach(self) -> tuple[JointLimit, ...]:
        """Give the ranges and speeds that servos keep to as they were set up, as angles of now."""
        return tuple(map(_as_set_up, self._set_up, self._joints))

    def start(self) -> JointAngles:
        """Open the bus and switch torque on where the joints are; give the goals in force.

        Raises:
            drivers.errors.SetupError: port or servos are not as configured.
        """
        self.bus.open()
        try:
            return self.take_hold()
        except BaseException:
            self.stop()
            raise

    def read(self, t_s: float) -> JointState:
        """Read all joints; one that does not answer keeps its last value and its age."""
        readings = self.bus.read(t_s)
        missing: tuple[str, ...] = ()
        for i, reading in enumerate(readings):
            if reading is None:
                missing = (*missing, JOINTS[i])
            else:
                self._last[i] = reading
        columns = zip(*self._last, strict=True)
        steps, speeds, _, at_s, _, torque, fault, load, warm, volts, _ = columns
        return JointState(
            tuple([(s - z) * k for s, z, k in zip(steps, self._zero, self._scale, strict=True)]),
            tuple([v * k for v, k in zip(speeds, self._scale, strict=True)]),
            at_s,
            missing,
            torque,
            fault,
            load,
            warm,
            volts,
            tuple([reading is not None and reading.rearmed for reading in readings]),
        )

    def write(self, command_rad: JointAngles) -> None:
        """Send one goal to every servo."""
        self.bus.write(
            [
                round(zero + angle / scale)
                for zero, scale, angle in zip(self._zero, self._scale, command_rad, strict=True)
            ]
        )

    def angles(self, steps: tuple[int, ...] | list[float]) -> JointAngles:
        """Give the joint angles of servo positions in the order of JOINTS."""
        return tuple(joint.angle_rad(step) for joint, step in zip(self._joints, steps, strict=True))

    def let_go(self) -> None:
        """Torque off at once; the bus stays open and readings go on.

        Raises:
            drivers.errors.BusLost: the port is gone.
        """
        self.bus.release()

    def take_hold(self) -> JointAngles:
        """Torque on again where the joints are; give the goals in force.

        Raises:
            drivers.errors.SetupError: a servo does not answer, refuses or has latched a fault.
            drivers.errors.BusLost: the port is gone.
        """
        goals = self.bus.engage()
        self._set_up = self._joints
        return self.angles(goals)

    def stop(self) -> None:
        """Torque off and close the bus."""
        try:
            self.bus.release()
        finally:
            self.bus.close()


def _counts_alike(one: JointParams, other: JointParams) -> bool:
    """Tell whether both make the same angle of the same step."""
    return (one.sign, one.ratio, one.zero_step) == (other.sign, other.ratio, other.zero_step)


def _as_set_up(set_up: JointParams, now: JointParams) -> JointLimit:
    """Give the limits of a servo that was set up with other parameters than are in force."""
    limit = set_up.limit()
    if _counts_alike(set_up, now):
        return limit
    ends = sorted(now.angle_rad(set_up.steps(end)) for end in (limit.low_rad, limit.high_rad))
    speed = limit.speed_rad_s * set_up.ratio / now.ratio
    return limit._replace(low_rad=ends[0], high_rad=ends[1], speed_rad_s=speed)
