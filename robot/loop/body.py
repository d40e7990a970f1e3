"""The joints on their bus, the only place that converts steps to joint angles, and their stops.

A stop switches the torque off in the tick that executes it; on a lost bus that happens when the bus
reconnects. Times are those of the ticks, so a repeated run is stopped and resumed as recorded.
"""

import contextlib
from collections.abc import Callable, Collection, Mapping, Sequence
from math import isfinite
from typing import Any

from gazerig.drivers.errors import BusLost, DriverError, ServoFault, ServoMissing, SetupError
from gazerig.drivers.types import Feedback, ServoBus
from gazerig.robot.description.statics import SagCompensation
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.commands import Resume, Stop
from gazerig.robot.model.coupling import CouplingParams, find_far_outside
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.model.types import JointAngles, JointState, order_joints

_FIRST_S = 0.5
"""Longest time until every servo has reported its position before torque is switched on."""
_AGAIN_S = 0.02


class Body:
    """All joints of a rig on its bus, or on its buses as one.

    Attributes:
        names: Names of the joints, in the order of every sequence of joints.

    Args:
        bus: Bus with the configuration from ``servo_setups``.
        joints: The joints by name.
        pairs: As in ``servo_setups``.
        sag: Changes of the goals that make up for the weight; None: none.
        recover: Receives a line about each joint that is far outside its range, which then moves
            inside slowly; None: such a joint prevents the torque of all.
    """

    def __init__(
        self,
        bus: ServoBus,
        joints: Mapping[str, JointParams],
        pairs: Collection[CouplingParams] = (),
        sag: SagCompensation | None = None,
        recover: Callable[[str], object] | None = None,
    ) -> None:
        self.bus = bus
        self._sag, self._read_s = sag, 0.0
        self._recover = recover
        self.names = order_joints(joints)
        self._pairs = tuple(pairs)
        self._coupled = CoupledServos(pairs, self.names)
        self._torque_off = False
        self._joints = {name: joints[name] for name in self.names}
        self._linkages = [joint.make_linkage() for joint in self._joints.values()]
        # Before the first answer: the centre, infinitely old.
        self._nothing = Feedback.create_missing(len(self.names))
        self._last = self._nothing._replace(
            position_steps=tuple(self._steps((0.0,) * len(self.names))),
            velocity_steps_s=(0.0,) * len(self.names),
            load=(0.0,) * len(self.names),
            torque=(True,) * len(self.names),  # it was switched on, and no servo reports otherwise
            measured=tuple([one.model_facts.measures_position for one in self._joints.values()]),
        )

    def start(self, clock: Clock) -> JointAngles:
        """Open the bus and switch the torque on at the present angles; return the goals.

        Raises:
            SetupError: The port or the servos do not match the configuration, or a joint is far
                outside its range.
        """
        self.bus.open()
        try:
            self._read_first(clock)
            return self.enable_torque()
        except BaseException:
            self.stop()
            raise

    def _read_first(self, clock: Clock) -> None:
        """Read every servo that measures its position.

        Raises:
            ServoMissing: One does not answer.
        """
        if True not in self._last.measured:
            return
        end_s = clock.now_s() + _FIRST_S
        while True:
            now_s = clock.now_s()
            self.read(now_s)
            unread = [
                name
                for name, measured, at_s in zip(
                    self.names, self._last.measured, self._last.at_s, strict=True
                )
                if measured and not isfinite(at_s)
            ]
            if not unread:
                return
            if now_s >= end_s:
                raise ServoMissing(f"no position from {', '.join(unread)}: check its cable")
            clock.sleep_until(now_s + _AGAIN_S)

    def read(self, t_s: float) -> JointState:
        """Read all joints; a joint that does not answer keeps its last value and its age.

        Raises:
            BusLost: No servo has answered for too long while the torque was on. With the torque
                off, a lost bus is not an error.
        """
        self._read_s = t_s
        try:
            feedback = self.bus.read(t_s)
        except BusLost:
            if not self._torque_off:
                raise
            feedback = self._nothing
        if feedback.missing:
            feedback = feedback.fill_missing(self._last)
        self._last = feedback
        feedback = self._coupled.share_feedback(feedback, self._torque_off)
        steps, speeds, load, at_s, celsius, volts, torque, fault, measured, rearmed, gone = feedback
        rows = zip(self._linkages, speeds, steps, strict=True)
        shaft_rates = [speed * linkage.rate_rad(at) for linkage, speed, at in rows]
        angles, rates = self.angles(steps), tuple(self._coupled.joints(shaft_rates))
        missing = tuple([self.names[i] for i in gone]) if gone else ()
        return JointState(
            angles, rates, at_s, missing, torque, fault, load, celsius, volts, rearmed, measured
        )

    def write(self, command_rad: JointAngles) -> None:
        """Send one goal to every servo.

        Raises:
            ValueError: An angle is not a number, or the number of angles is wrong.
        """
        steps = self._steps(command_rad)
        if self._sag is not None:
            for i, offset in self._sag.offsets(command_rad, self._read_s):
                steps[i] += round(offset)
        self.bus.write(steps)

    def _steps(self, angles_rad: JointAngles) -> list[int]:
        """Return the servo positions of joint angles."""
        if len(angles_rad) != len(self.names):
            raise ValueError(f"{len(angles_rad)} angles for {len(self.names)} joints")
        rows = zip(self._linkages, self._coupled.shafts(angles_rad), strict=True)
        return [round(linkage.steps(angle)) for linkage, angle in rows]

    def angles(self, steps: Sequence[float]) -> JointAngles:
        """Return the joint angles of servo positions."""
        rows = zip(self._linkages, steps, strict=True)
        return tuple(self._coupled.joints([linkage.angle_rad(at) for linkage, at in rows]))

    def disable_torque(self) -> None:
        """Switch the torque off immediately; the bus stays open and reading continues.

        Raises:
            BusLost: The port is lost; the torque is switched off when it reconnects.
        """
        self._torque_off = True
        self.bus.disable_torque()

    def enable_torque(self) -> JointAngles:
        """Switch the torque on again at the present angles; return the goals.

        Raises:
            SetupError: A servo does not answer, refuses or has latched a fault, or a joint is far
                outside its range.
            BusLost: The port is gone.
        """
        self._refuse_far_outside()
        if self._sag is not None:
            self._sag.restart()
        goals = self.bus.enable_torque()
        self._torque_off = False
        # A servo that has not answered since then has torque.
        self._last = self._last._replace(torque=(True,) * len(self.names))
        return self.angles(goals)

    def _refuse_far_outside(self) -> None:
        """Refuse torque if a joint is far outside its range, or report that it moves inside.

        Raises:
            SetupError: A joint is far outside, and its recovery was not requested.
        """
        rows = zip(self.names, self._last.measured, self._last.position_steps, strict=True)
        steps = {name: at for name, measured, at in rows if measured}
        far = find_far_outside(self._joints, self._pairs, steps)
        if not far:
            return
        where = [f"{name} {text}" for name, text in far.items()]
        if self._recover is None:
            raise SetupError(
                f"{'; '.join(where)} Torque stays off: gazerig doctor RIG examines it, gazerig run "
                "RIG --recover moves it slowly into its range"
            )
        for text in where:
            self._recover(f"{text} It moves slowly into its range")

    def stop(self) -> tuple[str, ...]:
        """Switch the torque off and close the bus; return the bus's messages about it.

        A message is, e.g., "left_lid (servo 7): torque-off not confirmed: cut the servo power".
        """
        try:
            with contextlib.suppress(Exception):  # nothing may prevent switching the torque off
                self.bus.events()  # discards earlier messages
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
        except BaseException as error:  # not a fault of the bus, such as no memory: try once more
            self.bus.disable_torque()
            if not isinstance(error, Exception):
                raise


class CoupledServos:
    """The pairs of servos of one body that together move two joints.

    Args:
        pairs: The pairs with the names of their joints.
        names: Names of all joints in their order.
    """

    def __init__(self, pairs: Collection[CouplingParams], names: Sequence[str]) -> None:
        # The positions of both joints in every sequence, and their coupling.
        self._pairs = [(names.index(one.first), names.index(one.second), one) for one in pairs]
        self._last: dict[int, Feedback] = {}

    def joints(self, shafts_rad: Sequence[float]) -> list[float]:
        """Return the joint angles of servo angles, or the joint speeds of servo speeds."""
        angles = list(shafts_rad)
        for i, j, coupling in self._pairs:
            angles[i], angles[j] = coupling.joint_rad((shafts_rad[i], shafts_rad[j]))
        return angles

    def shafts(self, joints_rad: Sequence[float]) -> list[float]:
        """Return the servo angles of joint angles."""
        angles = list(joints_rad)
        for i, j, coupling in self._pairs:
            angles[i], angles[j] = coupling.servo_rad((joints_rad[i], joints_rad[j]))
        return angles

    def share_feedback(self, feedback: Feedback, released: bool) -> Feedback:
        """Return feedback in which both servos of a pair share the values for both joints.

        If one servo did not answer, both joints are stale, at their last common position. The
        higher load, a fault, and torque that was switched on again apply to both. The torque is on
        if both servos have it; after a release (``released``), if one has it.
        """
        if not self._pairs:
            return feedback
        column: dict[str, list[Any]] = {
            name: list(values) for name, values in feedback._asdict().items()
        }
        for i, j, _ in self._pairs:
            both = [i, j]
            if {*both}.isdisjoint(feedback.missing):
                self._last[i] = feedback
            else:
                column["missing"] = sorted({*column["missing"], *both})
            last = self._last.get(i, feedback)
            for k in both:
                column["position_steps"][k] = last.position_steps[k]
                column["velocity_steps_s"][k] = last.velocity_steps_s[k]
                if fault := feedback.fault[i + j - k]:
                    column["fault"][k] = feedback.fault[k] or f"{fault} (of its coupled servo)"
            on = [feedback.torque[k] for k in both]
            shared = {
                "at_s": min(last.at_s[i], last.at_s[j]),
                "load": max((feedback.load[k] for k in both), key=abs),
                "torque": any(on) if released else all(on),
                "rearmed": any(feedback.rearmed[k] for k in both),
            }
            for name, value in shared.items():
                column[name][i] = column[name][j] = value
        return Feedback(**{name: tuple(values) for name, values in column.items()})


MIN_HOLD_S = 2.0
"""Shortest duration of a stop, also for the client that stopped."""
MIN_RESUME_GAP_S = 1.0
"""A resume within this time of the same client's last one is refused, and counts as the last."""
_MAX_ASKERS = 32
_RELEASE_AGAIN_S = 0.5
"""Interval at which servos that still report torque after a stop are switched off again."""


class StopControl:
    """The latch of a stop: who stopped, for how long at least, and who may resume.

    Attributes:
        reason: Reason for the newest stop, "" while the robot moves.

    Args:
        body: The joints on their bus.
        messages: Receives a line about each event.
    """

    def __init__(self, body: Body, messages: list[str]) -> None:
        self.reason = ""
        self._body, self._messages = body, messages
        self._stoppers: set[str] = set()
        self._asked_s: dict[tuple[str, bool], float] = {}
        self._stopped_s = self._released_s = 0.0
        self._refused = ""

    def halt(self, command: Stop, t_s: float) -> None:
        """Switch the torque off immediately; a repeated stop renews the present one."""
        if not self.reason:
            self._stoppers.clear()
            self._messages.append(f"stopped{_by(command)}: {command.why or 'stopped'}; torque off")
        if len(self._stoppers) < _MAX_ASKERS:
            self._stoppers.add(command.who)
        self.reason, self._stopped_s = command.why or "stopped", t_s
        self._release(t_s)

    def keep_released(self, joints: JointState, t_s: float) -> None:
        """Switch the torque off again if a servo still reports it after a stop."""
        if True not in joints.torque or t_s - self._released_s < _RELEASE_AGAIN_S:
            return
        names = zip(self._body.names, joints.torque, strict=True)
        if holding := [name for name, on in names if on and name not in joints.missing]:
            self._messages.append(
                f"stopped, but {', '.join(holding)} still had torque: switched off again"
            )
            self._release(t_s)

    def resume(self, command: Resume, t_s: float) -> JointAngles | CommandReply:
        """Switch the torque on at the present angles; return the goals, or the refusal."""
        if refusal := self._refusal(command, t_s):
            if refusal != self._refused:  # repeated refusals give one line
                self._messages.append(f"resume{_by(command)} refused: {refusal}")
            self._refused = refusal
            return CommandReply(refusal)
        try:
            goals = self._body.enable_torque()
        except (SetupError, ServoFault, BusLost) as error:
            self._messages.append(f"still stopped: {error}")
            return CommandReply(self._messages[-1])
        self.reason = self._refused = ""
        self._messages.append(f"torque on again{_by(command)}: continuing slowly")
        return goals

    def _refusal(self, command: Resume, t_s: float) -> str:
        """Return the reason for a refusal of a resume, "" to accept; each call is an attempt."""
        asker = (command.who, command.confirmed)
        last_s = self._asked_s.pop(asker, None)
        self._asked_s[asker] = t_s
        while len(self._asked_s) > _MAX_ASKERS:
            del self._asked_s[next(iter(self._asked_s))]
        if last_s is not None and t_s - last_s < MIN_RESUME_GAP_S:
            return f"too many requests to resume: wait {MIN_RESUME_GAP_S:g} s between two"
        left_s = self._stopped_s + MIN_HOLD_S - t_s
        if left_s > 0.0:
            return f"a stop lasts at least {MIN_HOLD_S:g} s: try again in {left_s:.1f} s"
        if not command.confirmed and self._stoppers != {command.who}:
            names = " and ".join(sorted(filter(None, self._stoppers)))
            by = f"stopped by {names}" if names else "another client stopped it"
            return f"{by}: another client must confirm that no hand is in the mechanism"
        return ""

    def _release(self, t_s: float) -> None:
        """Switch the torque off; on a lost bus this happens when it reconnects."""
        self._released_s = t_s
        try:
            self._body.disable_torque()
        except DriverError as error:
            self._messages.append(f"the stop is pending, torque is NOT YET off: {error}")


def _by(command: Stop | Resume) -> str:
    return f" by {command.who}" if command.who else ""
