"""Joints that have no torque while nothing moves them."""

from collections.abc import Sequence
from math import radians

from gazerig.robot.model.types import JointAngles

_REST_RAD = radians(0.1)
"""Largest angle of an idle joint, which is at its neutral angle 0."""


class LimpJoints:
    """The choice of joints that are limp.

    Attributes:
        limp: Numbers of the joints that must have no torque.

    Args:
        after_s: Time at rest after which each joint becomes limp; None: never.
    """

    def __init__(self, after_s: Sequence[float | None]) -> None:
        self._after_s = {i: one for i, one in enumerate(after_s) if one is not None}
        self.reset()

    def reset(self) -> None:
        """Let all joints have torque."""
        self.limp: frozenset[int] = frozenset()
        self._since_s: dict[int, float] = {}

    def step(
        self, desired_rad: JointAngles, torque: Sequence[bool], t_s: float, held: bool
    ) -> bool:
        """Choose the joints of a tick; return whether they have changed.

        Args:
            desired_rad: Desired angles.
            torque: Whether the torque of each joint is on.
            t_s: Present time.
            held: Whether a client holds the joints.
        """
        if not self._after_s and not self.limp:
            return False
        before, limp = self.limp, self.limp.intersection(self._after_s)
        for i, after_s in self._after_s.items():
            if held or not abs(desired_rad[i]) <= _REST_RAD:  # also if it is not a number
                self._since_s.pop(i, None)
                limp -= {i}
            elif torque and torque[i]:
                # A limp joint with torque has been set up again, or has not confirmed.
                since_s = t_s if i in limp else self._since_s.get(i, t_s)
                self._since_s[i] = since_s
                limp = limp | {i} if t_s - since_s >= after_s else limp - {i}
        self.limp = limp
        return limp != before
