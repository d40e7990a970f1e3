"""True pose of the head in a world with physics, from the joints of the world's state."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from gazerig.features.world.state_file import StateReader, WorldState
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.clock import Clock
from gazerig.robot.model.kinematics import NECK, Kinematics

if TYPE_CHECKING:
    from gazerig.features.world.physics import World

_ABSENT = dict.fromkeys(NECK, 0.0)


class RigInState(NamedTuple):
    """The joints of a rig in the state of a world; can be sent to another process.

    Attributes:
        kinematics: kinematics of the rig as built, independent of later changes.
        joints: index of each joint in the state.
    """

    kinematics: Kinematics
    joints: Mapping[str, int]

    def head(self, state: WorldState) -> tuple[Mat3, Vec3]:
        """Return rotation and position of the head in the world."""
        angles = _ABSENT.copy()
        for name in angles.keys() & self.joints.keys():
            angles[name] = float(state.qpos[self.joints[name]])
        yaw, pitch, roll = (angles[name] for name in NECK)
        return self.kinematics.head_pose((yaw, pitch, roll))


class WorldPoses:
    """Head of a rig in a world of another process, from the state that the process writes.

    Attributes:
        state: the state of the last read, None before the first.
    """

    def __init__(self, path: Path, rig: RigInState) -> None:
        self._path, self._rig = path, rig
        self._reader: StateReader | None = None
        self.state: WorldState | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._path, self._rig)

    @property
    def begin_s(self) -> float | None:
        """Return the host's time at the start of the script of the people, None before."""
        return self._file().begin_s

    def newest(self) -> WorldState | None:
        """Return the newest state, None before the first."""
        self.state = self._file().newest() or self.state
        return self.state

    def head(self, t_s: float) -> tuple[Mat3, Vec3]:
        """Return the current pose of the head; upright before the first state."""
        newest = self.newest()
        if newest is None:
            return self._rig.kinematics.head_pose((0.0, 0.0, 0.0))
        return self._rig.head(newest)

    def _file(self) -> StateReader:
        if self._reader is None:
            self._reader = StateReader(self._path)
        return self._reader


class SimulatedPoses:
    """Head of a rig in a world of this process, on the clock of the run.

    Attributes:
        begin_s: start time of the people's script.
    """

    def __init__(self, world: "World", clock: Clock, rig: RigInState) -> None:
        self._world, self._clock, self._rig = world, clock, rig
        self.begin_s = clock.now_s()

    @property
    def state(self) -> WorldState:
        """Return the current state."""
        self._world.now_s()
        return self._world.state()

    def head(self, t_s: float) -> tuple[Mat3, Vec3]:
        """Return the current pose of the head."""
        return self._rig.head(self.state)
