"""Joints to servos and back: the only place that knows what a step means at a joint."""

import contextlib
from collections.abc import Mapping, Sequence
from operator import add, mul, sub

from gazerig.drivers.bus.limit_recovery import ENTRY_DEG_S
from gazerig.drivers.errors import BusLost, DriverError
from gazerig.drivers.types import Feedback, ServoBus, ServoConfig
from gazerig.robot.control.coupled_servos import CoupledServos
from gazerig.robot.model.coupling_params import CoupledPair, pair_setups
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.transmission import Line
from gazerig.robot.model.types import JointAngles, JointState, in_order


def setups(
    joints: Mapping[str, JointParams],
    park_rad: Mapping[str, float],
    gentle_deg_s: float = ENTRY_DEG_S,
    pairs: Sequence[CoupledPair] = (),
) -> tuple[ServoConfig, ...]:
    """Return what a bus must know of all servos.

    park_rad: parking pose of joints, 0 where not given: where servos that do not tell their
        place are taken to be
    gentle_deg_s: joints are led into their ranges no faster
    pairs: joints that two servos move together
    """
    coupled: dict[str, ServoConfig] = {}
    for pair in pairs:
        coupled |= pair_setups(pair, joints, park_rad, gentle_deg_s)
    return tuple(
        coupled.get(name) or joints[name].setup(name, park_rad.get(name, 0.0), gentle_deg_s)
        for name in in_order(joints)
    )


class Body:
    """All joints of one rig on its bus, or its buses as one.

    names: of the joints, in the order of every sequence of them

    Args:
        bus: made with ``setups`` of the same joints.
        joints: the joints by name.
        park_rad: as in ``setups``.
        gentle_deg_s: as in ``setups``.
        pairs: as in ``setups``.
    """

    def __init__(
        self,
        bus: ServoBus,
        joints: Mapping[str, JointParams],
        park_rad: Mapping[str, float] | None = None,
        gentle_deg_s: float = ENTRY_DEG_S,
        pairs: Sequence[CoupledPair] = (),
    ) -> None:
        self.bus = bus
        self.names = in_order(joints)
        self._pairs = tuple(pairs)
        self._coupled = CoupledServos(pairs, self.names) if pairs else None
        self._park_rad = dict(park_rad or {})
        self._torque_off = False
        self._gentle_deg_s = gentle_deg_s
        self._set_up = tuple(joints[name] for name in self.names)
        self._take(self._set_up)
        # Before the first answer: the centre, of an age that says so.
        self._nothing = Feedback.of_none(len(self.names))
        self._last = self._nothing._replace(
            position_steps=tuple(self._steps((0.0,) * len(self.names))),
            velocity_steps_s=(0.0,) * len(self.names),
            load=(0.0,) * len(self.names),
            torque=(True,) * len(self.names),  # it was switched on, and no servo says otherwise
            measured=tuple([joint.facts.measured for joint in self._joints]),
        )

    def _take(self, joints: tuple[JointParams, ...]) -> None:
        self._joints = joints
        linkages = [joint.made() for joint in joints]
        # All joints at once as if every linkage were straight; then those that are not.
        lines = [linkage.line or Line(0.0, 0.0, 0.0) for linkage in linkages]
        self._zeros, self._slopes, self._rates = zip(*lines, strict=True)
        self._bent = [(i, one) for i, one in enumerate(linkages) if one.line is None]

    def retune(
        self, joints: Mapping[str, JointParams], gentle_deg_s: float
    ) -> dict[int, tuple[float, float]]:
        """Count angles otherwise from now on; the servos are set up again when torque comes on.

        Gives, for each joint whose angles are other ones now, (factor, offset in radians):
        what was x is factor x + offset.
        """
        before, self._gentle_deg_s = self._joints, gentle_deg_s
        self._take(tuple(joints[name] for name in self.names))
        self.bus.retune(setups(joints, self._park_rad, self._gentle_deg_s, self._pairs))
        return {
            i: (
                now.angle_rad(old.steps(1.0)) - now.angle_rad(old.steps(0.0)),
                now.angle_rad(old.steps(0.0)),
            )
            for i, (old, now) in enumerate(zip(before, self._joints, strict=True))
            if not _counts_alike(old, now)
        }

    def reach(self) -> tuple[JointLimit, ...]:
        """Return the ranges and speeds that servos were set up to keep, as angles of now."""
        return tuple(map(_as_set_up, self._set_up, self._joints))

    def start(self) -> JointAngles:
        """Open the bus and switch torque on where the joints are; give the goals in force.

        Raises:
            SetupError: port or servos are not as configured.
        """
        self.bus.open()
        try:
            return self.enable_torque()
        except BaseException:
            self.stop()
            raise

    def read(self, t_s: float) -> JointState:
        """Read all joints; one that does not answer keeps its last value and its age.

        Raises:
            BusLost: no servo has answered for too long, and torque was not let
                go of; after that the bus may stay away for as long as it likes.
        """
        try:
            feedback = self.bus.read(t_s)
        except BusLost:
            if not self._torque_off:
                raise
            feedback = self._nothing
        if feedback.missing:
            feedback = feedback.filled(self._last)
        self._last = feedback
        if self._coupled is not None:
            feedback = self._coupled.completed(feedback, self._torque_off)
        steps, speeds, load, at_s, celsius, volts, torque, fault, measured, rearmed, gone = feedback
        rates = tuple(map(mul, speeds, self._rates))
        if self._bent or self._coupled is not None:
            angles = self.angles(steps)
            rates = self._bent_rates(rates, speeds, steps)
            if self._coupled is not None:
                rates = tuple(self._coupled.speeds(angles, rates))
        else:
            angles = tuple(map(mul, map(sub, steps, self._zeros), self._rates))
        missing = tuple([self.names[i] for i in gone]) if gone else ()
        # Without the call of a function written in Python that the class itself would cost.
        return tuple.__new__(
            JointState,
            (
                angles, rates, at_s, missing, torque, fault, load, celsius, volts, rearmed, measured,
            ),
        )  # fmt: skip

    def _bent_rates(
        self, rates: tuple[float, ...], speeds: Sequence[float], steps: Sequence[float]
    ) -> tuple[float, ...]:
        """Return the rates of all joints, right for linkages that are not straight, too."""
        right = list(rates)
        for i, linkage in self._bent:
            right[i] = speeds[i] * linkage.rate_rad(steps[i])
        return tuple(right)

    def write(self, command_rad: JointAngles) -> None:
        """Send one goal to every servo.

        Raises:
            ValueError: an angle is not a number, or there are not as many as joints.
        """
        if self._bent or self._coupled is not None or len(command_rad) != len(self._zeros):
            self.bus.write(self._steps(command_rad))
        else:
            lines = map(add, self._zeros, map(mul, self._slopes, command_rad))
            self.bus.write([*map(round, lines)])

    def _steps(self, angles_rad: JointAngles) -> list[int]:
        """Return the servo positions of joint angles."""
        if len(angles_rad) != len(self.names):
            raise ValueError(f"{len(angles_rad)} angles for {len(self.names)} joints")
        angles: Sequence[float] = angles_rad
        if self._coupled is not None:
            angles = self._coupled.shafts(angles_rad)
        steps = [*map(round, map(add, self._zeros, map(mul, self._slopes, angles)))]
        for i, linkage in self._bent:
            steps[i] = round(linkage.steps(angles[i]))
        return steps

    def angles(self, steps: Sequence[float]) -> JointAngles:
        """Return the joint angles of servo positions."""
        shafts = self._shafts(steps)
        return tuple(shafts if self._coupled is None else self._coupled.joints(shafts))

    def _shafts(self, steps: Sequence[float]) -> list[float]:
        """Return the angles of servo positions, those of coupled servos at their own shafts."""
        angles = [*map(mul, map(sub, steps, self._zeros), self._rates)]
        for i, linkage in self._bent:
            angles[i] = linkage.angle_rad(steps[i])
        return angles

    def disable_torque(self) -> None:
        """Torque off at once; the bus stays open and readings go on.

        Raises:
            BusLost: the port is gone; the torque is taken off when it is back.
        """
        self._torque_off = True
        self.bus.disable_torque()

    def enable_torque(self) -> JointAngles:
        """Torque on again where the joints are; give the goals in force.

        Raises:
            SetupError: a servo does not answer, refuses or has latched a fault.
            BusLost: the port is gone.
        """
        goals = self.bus.enable_torque()
        self._torque_off = False
        if self._coupled is not None:
            self._coupled.held(self._shafts(goals))
        self._set_up = self._joints
        return self.angles(goals)

    def stop(self) -> tuple[str, ...]:
        """Torque off and close the bus; return what the bus says of the torque that went off.

        e.g. "left_lid (servo 7): torque-off not confirmed: cut the servo power"
        """
        try:
            with contextlib.suppress(Exception):  # nothing may keep the torque on
                self.bus.events()  # what was before is no word about this
            self._release()
            with contextlib.suppress(Exception):
                return self.bus.events()
            return ()
        finally:
            self.bus.close()

    def _release(self) -> None:
        try:
            self.bus.disable_torque()
        except DriverError:
            raise
        except Exception:  # no fault of the bus, such as no memory: it is tried once more
            self.bus.disable_torque()
        except BaseException:
            self.bus.disable_torque()
            raise


def _counts_alike(one: JointParams, other: JointParams) -> bool:
    """Return whether both make the same angle of the same step."""
    return (one.sign, one.ratio, one.zero, one.transmission_points) == (
        other.sign,
        other.ratio,
        other.zero,
        other.transmission_points,
    )


def _as_set_up(set_up: JointParams, now: JointParams) -> JointLimit:
    """Return the limits of a servo that was set up with other parameters than are in force."""
    limit = set_up.limit()
    if _counts_alike(set_up, now):
        return limit
    was, made = set_up.made(), now.made()
    ends = sorted(made.angle_rad(was.steps(end)) for end in (limit.low_rad, limit.high_rad))
    speed = limit.speed_rad_s * was.steepest / made.steepest
    return limit._replace(low_rad=ends[0], high_rad=ends[1], speed_rad_s=speed)
