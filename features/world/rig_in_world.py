"""Rig in a world: its body as MJCF, and the transmission from its servos to its joints."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from gazerig.robot.model.joint import Linkage


class Transmission(NamedTuple):
    """Transmission between a servo and the joints that it helps to turn.

    linkage: between the servo's steps and its angle, or that of its only joint
    ratios: turns of the servo for one turn of each joint
    """

    linkage: Linkage
    ratios: tuple[float, ...] = (1.0,)

    @property
    def line(self) -> tuple[float, float] | None:
        """Return zero and slope of a linear transmission to one joint, otherwise None."""
        return self.linkage.line if len(self.ratios) == 1 else None

    def at(self, joints_rad: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        """Return the servo's position in steps, and the steps per radian of each joint."""
        angle = sum(ratio * rad for ratio, rad in zip(self.ratios, joints_rad, strict=True))
        steps, line = self.linkage.steps(angle), self.linkage.line
        slope = 1.0 / self.linkage.rate_rad(steps) if line is None else line[1]
        return steps, tuple(slope * ratio for ratio in self.ratios)


class ServoInWorld(NamedTuple):
    """One servo of a rig.

    name: name of the joint of its entry in the rig's file
    bus: name of its bus; id: id on the bus
    joints: joints that it turns: one, or both of a coupled pair
    transmission: transmission from the servo to them
    steps_per_turn: steps per turn of its shaft
    """

    name: str
    bus: str
    id: int
    joints: tuple[str, ...]
    transmission: Transmission
    steps_per_turn: float


class RigInWorld(NamedTuple):
    """A rig at the origin of a world, unless the world is a user's.

    body: returns its body as MJCF with the rig's joint names, and the files that the MJCF names.
        It can be sent, so that only processes with MuJoCo compute it
    stops_rad: hard stops of each joint
    start_rad: initial angle of each joint, 0 if not given
    servos: the servos that turn the joints
    """

    body: Callable[[], tuple[str, Mapping[str, bytes]]]
    stops_rad: Mapping[str, tuple[float, float]]
    start_rad: Mapping[str, float]
    servos: tuple[ServoInWorld, ...]
