"""Joints that are commanded to move and do not: a jam, a blocked lid, a finger.

A servo pushes harder the farther its goal is away, so what does not move must not be
pushed: the command comes back to where the joint is, waits, and tries again softly.
"""

from math import nan, radians

from gazerig.robot.model.guard_params import StallParams


class StallDetector:
    """Watches how joints follow their commands.

    far_rad: joints nearer to their commands than this are well
    lead_rad: how far a command may be ahead of a joint that tries again
    watched: side of the joint on which its command is far away, 0 where it is near
    """

    def __init__(self, params: StallParams, count: int) -> None:
        """Find all joints well."""
        self.retune(params)
        self.watched = [0] * count
        self._since_s = [0.0] * count
        self._anchor_rad = [0.0] * count
        self._until_s = [nan] * count

    def retune(self, params: StallParams) -> None:
        """Watch otherwise; joints that wait to try again still do."""
        self._stuck_s = params.detection_ms / 1e3
        self._retry_s = params.retry_ms / 1e3
        self._moved_rad = radians(params.moved_deg)
        self.far_rad = radians(params.position_error_deg)
        self.lead_rad = radians(params.retry_deg)

    def forget(self, i: int) -> None:
        """Find a joint well: it rests on its command."""
        self.watched[i] = 0
        self._until_s[i] = nan

    def holds(self, i: int, t_s: float) -> bool:
        """Return whether a joint was found stuck and has not waited long enough."""
        if t_s >= self._until_s[i]:
            self.forget(i)
        return t_s < self._until_s[i]

    def found(self, i: int, command: float, position: float, at_s: float, t_s: float) -> bool:
        """Update with one new measurement; return whether the joint is stalled from now on.

        Only motion towards the command counts: who drags a joint the other way is to be
        given way to.

        at_s: when the answer came
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
