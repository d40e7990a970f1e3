"""Rig in a world: its body as MJCF, and the transmission from its servos to its joints."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from gazerig.robot.model.coupling import CouplingParams
from gazerig.robot.model.joint import LinearLinkage, Linkage

RELINEARISE_RAD = 0.003
"""A coupling is linearised again after a joint has turned this far. The error of the servo's
position is less than 1e-5 rad with any rods of a neck."""


class JointTransmission:
    """Transmission of a servo that turns one joint; line: of a linear transmission, else None."""

    def __init__(self, linkage: Linkage) -> None:
        self._linkage = linkage
        self.line = linkage.line

    def at(self, joints_rad: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        """Return the servo's position in steps, and the steps per radian of the joint."""
        if self.line is not None:
            return self.line.zero + self.line.slope * joints_rad[0], (self.line.slope,)
        steps = self._linkage.steps(joints_rad[0])
        return steps, (1.0 / self._linkage.rate_rad(steps),)


class PairTransmission:
    """Transmission of one of two servos that turn two joints together.

    Args:
        coupling: coupling of the pair.
        index: 0 for servo a, 1 for servo b.
        linkage: between the servo's steps and its angle in the coupling.
    """

    def __init__(self, coupling: CouplingParams, index: int, linkage: Linkage) -> None:
        self._coupling, self._index, self._linkage = coupling, index, linkage
        self.line: LinearLinkage | None = None
        self._at_rad: tuple[float, float] | None = None
        self._steps = 0.0
        self._slopes = (0.0, 0.0)

    def at(self, joints_rad: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        """Return the servo's position in steps, and the steps per radian of each joint."""
        first, second = joints_rad
        before = self._at_rad
        if before is None or max(abs(first - before[0]), abs(second - before[1])) > RELINEARISE_RAD:
            self._linearise((first, second))
            before = self._at_rad or (first, second)
        a, b = self._slopes
        return self._steps + a * (first - before[0]) + b * (second - before[1]), self._slopes

    def _linearise(self, joints_rad: tuple[float, float]) -> None:
        shaft_rad = self._coupling.servo_rad(joints_rad)[self._index]
        rates = self._coupling.rates[self._index]
        self._steps = self._linkage.steps(shaft_rad)
        slope = 1.0 / self._linkage.rate_rad(self._steps)
        self._slopes = slope * rates[0], slope * rates[1]
        self._at_rad = joints_rad


Transmission = JointTransmission | PairTransmission
"""Transmission from one servo to the joints that it helps to turn."""


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
