"""Listens to the machine: notes what enters a run beside the reading of every tick.

The goals at torque-on, a second reading in one tick and a refusal are decisions' food as
well; with them a recorded run can be done again to the bit.
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
    """A body before a body: every call goes on to it, and what it gives is noted."""

    def __init__(self, body: Body, note: Callable[[BodyRecord], None]) -> None:
        super().__init__(body)
        self._note = note

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

    def enable_torque(self) -> JointAngles:
        """Torque on again; note the goals, or why there are none.

        Raises:
            SetupError: a servo does not answer, refuses or has latched a fault.
            BusLost: the port is gone.
        """
        try:
            goals = self._body.enable_torque()
        except (SetupError, ServoFault) as error:
            self._note(TorqueRefused(str(error)))
            raise
        self._note(TorqueEnabled(goals))
        return goals
