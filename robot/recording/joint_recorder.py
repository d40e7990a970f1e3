"""Listens to the machine: notes what enters a run beside the reading of every tick.

The goals at torque-on, a second reading in one tick and a refusal are decisions' food as
well; with them a recorded run can be done again to the bit.
"""

from collections.abc import Callable, Mapping, Sequence

from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.robot.control.body import Body
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import JointAngles, JointState
from gazerig.robot.recording.tick_record import (
    BodyRecord,
    MeasuredJoints,
    TorqueEnabled,
    TorqueRefused,
)


class JointRecorder(Body):
    """A body before a body: every call goes on to it, and what it gives is noted."""

    def __init__(self, body: Body, note: Callable[[BodyRecord], None]) -> None:
        # Not set up as a body of its own: it has no joints, only the other's.
        self.bus, self.names = body.bus, body.names
        self._body = body
        self._note = note

    def retune(
        self, joints: Mapping[str, JointParams], gentle_deg_s: float
    ) -> dict[int, tuple[float, float]]:
        """Count angles otherwise from now on."""
        return self._body.retune(joints, gentle_deg_s)

    def reach(self) -> tuple[JointLimit, ...]:
        """Return the ranges and speeds that servos keep to as they were set up."""
        return self._body.reach()

    def start(self) -> JointAngles:
        """Start the machine; note the goals."""
        goals = self._body.start()
        self._note(TorqueEnabled(goals))
        return goals

    def read(self, t_s: float) -> JointState:
        """Read all joints; note them."""
        joints = self._body.read(t_s)
        self._note(MeasuredJoints(t_s, joints))
        return joints

    def write(self, command_rad: JointAngles) -> None:
        """Send one goal to every servo."""
        self._body.write(command_rad)

    def angles(self, steps: Sequence[float]) -> JointAngles:
        """Return the joint angles of servo positions."""
        return self._body.angles(steps)

    def let_go(self) -> None:
        """Torque off at once.

        Raises:
            BusLost: the port is gone.
        """
        self._body.let_go()

    def take_hold(self) -> JointAngles:
        """Torque on again; note the goals, or why there are none.

        Raises:
            SetupError: a servo does not answer, refuses or has latched a fault.
            BusLost: the port is gone.
        """
        try:
            goals = self._body.take_hold()
        except (SetupError, ServoFault) as error:
            self._note(TorqueRefused(str(error)))
            raise
        self._note(TorqueEnabled(goals))
        return goals

    def stop(self) -> None:
        """Torque off and close the bus."""
        self._body.stop()
