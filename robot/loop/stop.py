"""Stops and resumes: the torque of the body, and the rules for a resume.

A stop switches the torque off in the tick that executes it; on a lost bus that happens when the bus
reconnects. Times are those of the ticks, so a repeated run is stopped and resumed as recorded.
"""

from gazerig.drivers.errors import BusLost, DriverError, ServoFault, SetupError
from gazerig.robot.loop.body import Body
from gazerig.robot.model.commands import Resume, Stop
from gazerig.robot.model.reply import CommandReply
from gazerig.robot.model.types import JointAngles, JointState

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
