"""Compensation of the sag of a heavy neck: feed-forward to the goals from the rig's masses.

A servo without an integral part holds a load only with a sufficiently large error. This error
follows from the load and the servo's P gain, so the goal is moved by it in the opposite direction.
"""

from collections.abc import Iterable, Iterator, Sequence
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
        statics: statics of the neck.
        names: names of the joints, in the order of the goals.
    """

    def __init__(self, statics: Statics, names: Sequence[str]) -> None:
        found = [(i, name) for i, name in enumerate(names) if name in statics.joints]
        self._numbers, self._names = [i for i, _ in found], [name for _, name in found]
        self._at = [inf] * len(found)
        self._wanted: list[float] = []
        self._statics = statics
        joints = [statics.joints[name] for name in self._names]
        self._stiffness = [joint.model_facts.stiffness(joint.gains) for joint in joints]
        linkages = [joint.make_linkage() for joint in joints]
        self._steepest = [linkage.steepest for linkage in linkages]
        self._rising = [linkage.rising for linkage in linkages]
        self.restart()

    def restart(self) -> None:
        """Start with unchanged goals, because torque has just been switched on."""
        self._now = [0.0] * len(self._names)
        self._last_s: float | None = None

    def offsets(self, command_rad: Sequence[float], t_s: float) -> Iterable[tuple[int, float]]:
        """Return the change of goals in steps, by the number of the joint.

        Args:
            command_rad: desired joint angles.
            t_s: time of the last reading.
        """
        for i, at in zip(self._numbers, self._at, strict=True):
            if abs(command_rad[i] - at) > _NEW_RAD:
                self._at = [command_rad[k] for k in self._numbers]
                self._wanted = [*self._wanted_steps(self._at)]
                break
        if self._now != self._wanted:
            since = 0.0 if self._last_s is None else max(0.0, t_s - self._last_s)
            room = radians(FASTEST_DEG_S) * since
            rows = zip(self._now, self._wanted, self._steepest, strict=True)
            self._now = [_approach(now, wanted, room * steep) for now, wanted, steep in rows]
        self._last_s = t_s
        return zip(self._numbers, self._now, strict=True)

    def _wanted_steps(self, at: Sequence[float]) -> Iterator[float]:
        shares = self._statics.drive_shares(dict(zip(self._names, at, strict=True)))
        for name, stiff, steepest, rising in zip(
            self._names, self._stiffness, self._steepest, self._rising, strict=True
        ):
            if not stiff:
                yield 0.0
                continue
            most = steepest * radians(MOST_DEG)
            steps = min(max(-shares[name] / stiff, -most), most)
            yield steps if rising else -steps


def _approach(now: float, wanted: float, room: float) -> float:
    if abs(wanted - now) <= room:
        return wanted
    return now + room if wanted > now else now - room
