"""A body that wraps another one."""

from collections.abc import Mapping, Sequence

from gazerig.robot.control.body import Body
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import JointAngles


class ForwardingBody(Body):
    """A body that forwards every call to the wrapped body."""

    def __init__(self, body: Body) -> None:
        # The initializer of Body is not called: the joints are those of the wrapped body.
        self.bus, self.names = body.bus, body.names
        self._body = body

    def retune(
        self, joints: Mapping[str, JointParams], gentle_deg_s: float
    ) -> dict[int, tuple[float, float]]:
        """Apply new joint parameters."""
        return self._body.retune(joints, gentle_deg_s)

    def reach(self) -> tuple[JointLimit, ...]:
        """Return the ranges and speeds that the servos are configured to keep."""
        return self._body.reach()

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
