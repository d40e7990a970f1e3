"""Execution of stops and resumes on the body; a stop during a lost bus is applied later."""

from gazerig.drivers.errors import BusLost, DriverError, ServoFault, SetupError
from gazerig.robot.loop.body import Body
from gazerig.robot.model.commands import Resume, Stop, StopLatch
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.model.types import JointAngles, JointState

_RELEASE_AGAIN_S = 0.5
"""Interval at which servos that still report torque after a stop are switched off again."""


class StopControl:
    """The control of torque for stops and resumes.

    Args:
        messages: Receives a line about each event.
    """

    def __init__(self, messages: list[str]) -> None:
        self._messages = messages
        self._latch = StopLatch()
        self._refused = ""
        self._released_s = 0.0

    @property
    def stop_reason(self) -> str:
        """Return the reason for a stop, "" while the robot moves."""
        return self._latch.why

    def halt(self, command: Stop, body: Body, t_s: float) -> None:
        """Switch the torque off immediately."""
        if self._latch.stop(command, t_s):
            by = f" by {command.who}" if command.who else ""
            self._messages.append(f"stopped{by}: {command.why}; torque off")
        self._release(body, t_s)

    def keep_released(self, body: Body, joints: JointState, t_s: float) -> None:
        """Switch the torque off again if a servo still reports it after a stop."""
        if True not in joints.torque or t_s - self._released_s < _RELEASE_AGAIN_S:
            return
        names = zip(body.names, joints.torque, strict=True)
        holding = [name for name, on in names if on and name not in joints.missing]
        if holding:
            self._messages.append(
                f"stopped, but {', '.join(holding)} still had torque: switched off again"
            )
            self._release(body, t_s)

    def resume(self, command: Resume, body: Body, t_s: float) -> JointAngles | CommandReply:
        """Switch the torque on at the present angles; return the goals, or the refusal."""
        by = f" by {command.who}" if command.who else ""
        if refusal := self._latch.refusal(command, t_s):
            if refusal != self._refused:  # repeated refusals give one line
                self._messages.append(f"resume{by} refused: {refusal}")
            self._refused = refusal
            return CommandReply(refusal)
        try:
            goals = body.enable_torque()
        except (SetupError, ServoFault, BusLost) as error:
            self._messages.append(f"still stopped: {error}")
            return CommandReply(self._messages[-1])
        self._latch.lift()
        self._refused = ""
        self._messages.append(f"torque on again{by}: continuing slowly")
        return goals

    def _release(self, body: Body, t_s: float) -> None:
        """Switch the torque off; on a lost bus this happens when it reconnects."""
        self._released_s = t_s
        try:
            body.disable_torque()
        except DriverError as error:
            self._messages.append(f"the stop is pending, torque is NOT YET off: {error}")
