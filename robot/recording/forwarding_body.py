"""A body that stands before another one."""

from collections.abc import Mapping, Sequence

from gazerig.robot.control.body import Body
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.joint_limit import JointLimit
from gazerig.robot.model.types import JointAngles


class ForwardingBody(Body):
    """Forwards every call to the body behind it; subclasses add to that."""

    def __init__(self, body: Body) -> None:
        # Not set up as a body of its own: it has no joints, only the other's.
        self.bus, self.names = body.bus, body.names
        self._body = body

    def retune(
        self, joints: Mapping[str, JointParams], gentle_deg_s: float
    ) -> dict[int, tuple[float, float]]:
        """Count angles otherwise from now on."""
        return self._body.retune(joints, gentle_deg_s)

    def reach(self) -> tuple[JointLimit, ...]:
        """Return the ranges and speeds that servos keep to as they were set up."""
        return self._body.reach()

    def write(self, command_rad: JointAngles) -> None:
        """Send one goal to every servo."""
        self._body.write(command_rad)

    def angles(self, steps: Sequence[float]) -> JointAngles:
        """Return the joint angles of servo positions."""
        return self._body.angles(steps)

    def disable_torque(self) -> None:
        """Torque off at once.

        Raises:
            BusLost: the port is gone.
        """
        self._body.disable_torque()

    def stop(self) -> tuple[str, ...]:
        """Torque off and close the bus; return what the bus says of it."""
        return self._body.stop()
