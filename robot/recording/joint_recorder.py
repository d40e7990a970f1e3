"""Recording of the servos' inputs to a run other than the reading of each tick.

The goals at torque-on, a second reading in one tick and a refused torque also affect
decisions. With them a recorded run can be repeated bit for bit.
"""

from collections.abc import Callable

from gazerig.drivers.errors import ServoFault, SetupError
from gazerig.robot.control.body import Body
from gazerig.robot.model.types import JointAngles, JointState
from gazerig.robot.recording.forwarding_body import ForwardingBody
from gazerig.robot.recording.tick_record import (
    BodyRecord,
    MeasuredJoints,
    TorqueEnabled,
    TorqueRefused,
)


class JointRecorder(ForwardingBody):
    """A body that forwards every call and records the results."""

    def __init__(self, body: Body, note: Callable[[BodyRecord], None]) -> None:
        super().__init__(body)
        self._note = note

    def start(self) -> JointAngles:
        """Start the machine and record the goals."""
        goals = self._body.start()
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
