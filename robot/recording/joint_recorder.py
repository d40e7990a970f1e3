"""Recording of the servos' inputs to a run other than the reading of each tick.

The goals at torque-on, a second reading in one tick and a refused torque also affect
decisions. With them a recorded run can be repeated bit for bit.
"""

from collections.abc import Callable, Mapping, Sequence

from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.robot.loop.body import Body
from gazerig.robot.loop.tick import BodyRecord, MeasuredJoints, TorqueEnabled, TorqueRefused
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.joint import JointLimit, JointParams
from gazerig.robot.model.types import JointAngles, JointState


class ForwardingBody(Body):
    """A body that forwards every call to the wrapped body."""

    def __init__(self, body: Body) -> None:
        # The initializer of Body is not called: the joints are those of the wrapped body.
        self.bus, self.names = body.bus, body.names
        self._body = body

    def retune(self, joints: Mapping[str, JointParams], gentle_deg_s: float) -> None:
        """Apply new limits of joints."""
        self._body.retune(joints, gentle_deg_s)

    def configured_limits(self) -> tuple[JointLimit, ...]:
        """Return the ranges and speeds in the servos' configuration."""
        return self._body.configured_limits()

    def write(self, command_rad: JointAngles) -> None:
        """Send one goal to every servo."""
        self._body.write(command_rad)

    def angles(self, steps: Sequence[float]) -> JointAngles:
        """Return the joint angles of servo positions."""
        return self._body.angles(steps)

    def disable_torque(self) -> None:
        """Switch the torque off immediately.

        Raises:
            BusLost: The port is gone.
        """
        self._body.disable_torque()

    def stop(self) -> tuple[str, ...]:
        """Switch the torque off and close the bus; return the bus's messages."""
        return self._body.stop()


class JointRecorder(ForwardingBody):
    """A body that forwards every call and records the results."""

    def __init__(self, body: Body, note: Callable[[BodyRecord], None]) -> None:
        super().__init__(body)
        self._note = note

    def start(self, clock: Clock) -> JointAngles:
        """Start the machine and record the goals."""
        goals = self._body.start(clock)
        self._note(TorqueEnabled(goals))
        return goals

    def read(self, t_s: float) -> JointState:
        """Read all joints and record them."""
        joints = self._body.read(t_s)
        self._note(MeasuredJoints(t_s, joints))
        return joints

    def enable_torque(self) -> JointAngles:
        """Switch the torque on again and record the goals or the refusal.

        Raises:
            SetupError: A servo does not answer, refuses or has latched a fault.
            BusLost: The port is gone.
        """
        try:
            goals = self._body.enable_torque()
        except (SetupError, ServoFault) as error:
            self._note(TorqueRefused(str(error)))
            raise
        self._note(TorqueEnabled(goals))
        return goals
