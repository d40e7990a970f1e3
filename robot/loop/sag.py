"""Compensation of the sag of a heavy neck: feed-forward to the goals from the rig's masses.

A servo without an integral part holds a load only with a sufficiently large error. This error
follows from the load and the servo's P gain, so the goal is moved by it in the opposite direction.
"""

from collections.abc import Iterable, Sequence
from math import inf, radians

from gazerig.robot.description.statics import Statics

FASTEST_DEG_S = 3.0
"""Speed of a change of a goal, so that nothing jumps when torque is switched on or a gain changes.
"""
MOST_DEG = 4.0
"""Largest change of a goal, for any masses in the rig's file."""
_NEW_RAD = 0.002
"""Turn of a joint of the neck after which the torques are computed again."""


class SagCompensation:
    """Changes of the goals of the neck's servos.

    Args:
        statics: Statics of the neck.
        names: Names of the joints, in the order of the goals.
    """

    def __init__(self, statics: Statics, names: Sequence[str]) -> None:
        self._statics = statics
        self._joints = {name: i for i, name in enumerate(names) if name in statics.joints}
        self._at = dict.fromkeys(self._joints, inf)
        self._wanted: dict[str, float] = {}
        self._linkages = {name: statics.joints[name].make_linkage() for name in self._joints}
        self.restart()

    def restart(self) -> None:
        """Start with unchanged goals, because torque has just been switched on."""
        self._now = dict.fromkeys(self._joints, 0.0)
        self._last_s: float | None = None

    def offsets(self, command_rad: Sequence[float], t_s: float) -> Iterable[tuple[int, float]]:
        """Return the change of goals in steps, by the number of the joint.

        Args:
            command_rad: Desired joint angles.
            t_s: Time of the last reading.
        """
        if any(abs(command_rad[i] - self._at[name]) > _NEW_RAD for name, i in self._joints.items()):
            self._at = {name: command_rad[i] for name, i in self._joints.items()}
            self._wanted = self._wanted_steps()
        since_s = 0.0 if self._last_s is None else max(0.0, t_s - self._last_s)
        self._last_s = t_s
        for name, wanted in self._wanted.items():
            room = radians(FASTEST_DEG_S) * since_s * self._linkages[name].steepest
            now = self._now[name]
            self._now[name] = min(max(wanted, now - room), now + room)
        return [(i, self._now[name]) for name, i in self._joints.items()]

    def _wanted_steps(self) -> dict[str, float]:
        shares, wanted = self._statics.drive_shares(self._at), dict.fromkeys(self._joints, 0.0)
        for name, linkage in self._linkages.items():
            joint = self._statics.joints[name]
            if stiffness := joint.model_facts.stiffness(joint.gains):
                most = linkage.steepest * radians(MOST_DEG)
                steps = min(max(-shares[name] / stiffness, -most), most)
                wanted[name] = steps if linkage.rising else -steps
        return wanted
