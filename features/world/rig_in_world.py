"""A rig as a world needs it: its body as MJCF, and what lies between its servos and its joints."""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple, Protocol

from gazerig.robot.model.coupling import Coupling, Unreachable
from gazerig.robot.model.transmission import Line, Linkage

RELINEARISE_RAD = 0.003
"""A coupling is computed anew when a joint has turned so far; between it is a straight line.
The servo's position is then wrong by less than 1e-5 rad with any rods of a neck."""


class Gearing(Protocol):
    """What lies between one servo and the joints that it helps to turn.

    line: where it turns one joint by a straight gear; else None
    """

    line: Line | None

    def at(self, joints_rad: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        """Return the servo's position in its steps, and the steps a radian of each joint."""
        ...


class JointGearing:
    """A servo that turns one joint."""

    def __init__(self, linkage: Linkage) -> None:
        self._linkage = linkage
        self.line = linkage.line

    def at(self, joints_rad: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        """Return the servo's position in its steps, and the steps a radian of the joint."""
        if self.line is not None:
            return self.line.zero + self.line.slope * joints_rad[0], (self.line.slope,)
        steps = self._linkage.steps(joints_rad[0])
        return steps, (1.0 / self._linkage.rate_rad(steps),)


class PairGearing:
    """One of two servos that turn two joints together.

    Args:
        coupling: of the pair.
        index: 0 for servo a, 1 for servo b.
        linkage: between the servo's steps and its angle in the coupling.
    """

    def __init__(self, coupling: Coupling, index: int, linkage: Linkage) -> None:
        self._coupling, self._index, self._linkage = coupling, index, linkage
        self.line: Line | None = None
        self._at_rad: tuple[float, float] | None = None
        self._steps = 0.0
        self._slopes = (0.0, 0.0)

    def at(self, joints_rad: Sequence[float]) -> tuple[float, tuple[float, ...]]:
        """Return the servo's position in its steps, and the steps a radian of each joint.

        Where the rods cannot follow, a little beyond the joints' range, their last slope goes on.
        """
        first, second = joints_rad
        before = self._at_rad
        if before is None or max(abs(first - before[0]), abs(second - before[1])) > RELINEARISE_RAD:
            self._linearise((first, second))
            before = self._at_rad or (first, second)
        a, b = self._slopes
        return self._steps + a * (first - before[0]) + b * (second - before[1]), self._slopes

    def _linearise(self, joints_rad: tuple[float, float]) -> None:
        try:
            shaft_rad = self._coupling.servo_rad(joints_rad)[self._index]
            rates = self._coupling.rates(joints_rad)[self._index]
        except Unreachable:
            return
        self._steps = self._linkage.steps(shaft_rad)
        slope = 1.0 / self._linkage.rate_rad(self._steps)
        self._slopes = slope * rates[0], slope * rates[1]
        self._at_rad = joints_rad


class ServoInWorld(NamedTuple):
    """One servo of a rig.

    name: of the joint that its entry in the rig's file stands under
    bus: name of its bus; id: on it
    joints: that it turns, one, or both of a coupled pair
    gearing: between it and them
    steps_per_turn: of its shaft
    """

    name: str
    bus: str
    id: int
    joints: tuple[str, ...]
    gearing: Gearing
    steps_per_turn: float


class RigInWorld(NamedTuple):
    """A rig and where it stands.

    body: returns its body as MJCF with the rig's joint names, and the files that this names; can
        be sent, so that only those processes pay for it that have MuJoCo
    stops_rad: hard stops of each joint
    start_rad: angle of each joint at first, 0 where not given
    servos: that turn the joints
    prefix: of its names in the world, "" for the first rig
    p_m, yaw_rad: place of its neck base in the world, and how far it is turned left there
    """

    body: Callable[[], tuple[str, Mapping[str, bytes]]]
    stops_rad: Mapping[str, tuple[float, float]]
    start_rad: Mapping[str, float]
    servos: tuple[ServoInWorld, ...]
    prefix: str = ""
    p_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    yaw_rad: float = 0.0
