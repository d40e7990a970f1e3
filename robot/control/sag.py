"""Goals that make up for the sag of a heavy neck: feed-forward from the masses of the rig.

A servo without an integral part holds a load only where its error is large enough. This error
follows from the load and the servo's P gain, so the goal is moved by it to the other side.
"""

from collections.abc import Mapping, Sequence
from math import degrees

from gazerig.robot.description.statics import Statics
from gazerig.robot.model.joint import JointParams

BLEND_S = 1.0
"""Time from torque on until the whole sag is made up for, so that the head does not jump."""
MOST_DEG = 4.0
"""Largest change of a goal, whatever masses the rig's file gives."""
_NEW_RAD = 0.002
"""Turn of a joint of the neck after which the torques are computed again."""


class SagCompensation:
    """Changes of the goals of the neck's servos.

    Args:
        statics: of the rig; only its neck is used.
        names: of the joints, in the order of the goals.
        share: of the sag that is made up for.
    """

    def __init__(self, statics: Statics, names: Sequence[str], share: float) -> None:
        self._statics = statics.of_neck()
        self._places = tuple(
            (i, name) for i, name in enumerate(names) if name in self._statics.joints
        )
        self._share = share
        self._at: tuple[float, ...] = ()
        self._found: tuple[tuple[int, float], ...] = ()
        self._since_s: float | None = None

    def restart(self) -> None:
        """Begin with unchanged goals: the torque has just been switched on."""
        self._since_s = None

    def offsets(
        self, command_rad: Sequence[float], joints: Mapping[str, JointParams], t_s: float
    ) -> tuple[tuple[int, float], ...]:
        """Return the change of goals in steps, by the number of the joint.

        Args:
            command_rad: wanted joint angles.
            joints: present parameters of the joints.
            t_s: time of the last reading.
        """
        if self._since_s is None:
            self._since_s = t_s
        at = tuple([command_rad[i] for i, _ in self._places])
        if not self._at or max(map(_distance, at, self._at), default=0.0) > _NEW_RAD:
            self._at = at
            self._found = self._all(at, joints)
        blend = min(1.0, (t_s - self._since_s) / BLEND_S)
        if blend == 1.0:
            return self._found
        return tuple((i, blend * steps) for i, steps in self._found)

    def _all(
        self, at: Sequence[float], joints: Mapping[str, JointParams]
    ) -> tuple[tuple[int, float], ...]:
        pose = {name: angle for (_, name), angle in zip(self._places, at, strict=True)}
        shares, found = self._statics.drive_shares(pose), []
        for i, name in self._places:
            joint = joints[name]
            stiff = joint.facts.stiffness(joint.gains)
            if stiff and shares[name]:
                linkage = joint.made()
                most = linkage.steepest * MOST_DEG / degrees(1.0)
                steps = min(max(-self._share * shares[name] / stiff, -most), most)
                found.append((i, steps if linkage.rising else -steps))
        return tuple(found)


def _distance(a: float, b: float) -> float:
    return abs(a - b)
