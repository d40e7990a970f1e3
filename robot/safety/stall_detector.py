"""Detection of joints that do not follow their commands: a jam, a blocked lid, a finger.

A servo pushes harder the farther away its goal is, so a stalled joint must not be pushed: its
command returns to the joint's position, waits, and tries again softly.
"""

from math import nan, radians

from gazerig.robot.model.guard_params import StallParams


class StallDetector:
    """A detector of stalled joints.

    Attributes:
        far_rad: Largest normal distance between joint and command.
        lead_rad: Largest distance of the command ahead of a joint that tries again.
        watched: Per joint, the side on which its command is far away (1 or -1), 0 if it is near.
    """

    def __init__(self, params: StallParams, count: int) -> None:
        """Start with no joint stalled."""
        self.retune(params)
        self.watched = [0] * count
        self._since_s = [0.0] * count
        self._anchor_rad = [0.0] * count
        self._until_s = [nan] * count

    def retune(self, params: StallParams) -> None:
        """Set new thresholds; stalled joints continue to wait."""
        self._stuck_s = params.detection_ms / 1e3
        self._retry_s = params.retry_ms / 1e3
        self._moved_rad = radians(params.moved_deg)
        self.far_rad = radians(params.position_error_deg)
        self.lead_rad = radians(params.retry_deg)

    def forget(self, i: int) -> None:
        """Clear a joint's stall, as its command is at its position."""
        self.watched[i] = 0
        self._until_s[i] = nan

    def is_waiting(self, i: int, t_s: float) -> bool:
        """Return whether a joint is stalled and still waits."""
        if t_s >= self._until_s[i]:
            self.forget(i)
        return t_s < self._until_s[i]

    def has_stalled(self, i: int, command: float, position: float, at_s: float, t_s: float) -> bool:
        """Update with a new measurement; return whether the joint has stalled.

        Only motion towards the command counts: a joint that a hand moves the other way must
        give way.

        Args:
            i: Number of the joint.
            command: Commanded angle in rad.
            position: Measured angle in rad.
            at_s: Time of the measurement.
            t_s: Present time.
        """
        lead = command - position
        if -self.far_rad <= lead <= self.far_rad:
            self.watched[i] = 0
            return False
        side = 1 if lead > 0.0 else -1
        begins = side != self.watched[i]
        if begins or (position - self._anchor_rad[i]) * side > self._moved_rad:
            self.watched[i], self._since_s[i], self._anchor_rad[i] = side, at_s, position
            return False
        if at_s - self._since_s[i] < self._stuck_s:
            return False
        self.watched[i] = 0
        self._until_s[i] = t_s + self._retry_s
        return True
