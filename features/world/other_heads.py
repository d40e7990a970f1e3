"""Shapes of the other heads of a world for the page: every body at its true pose.

The emulator's process writes the newest state. The process that draws reads the joints in it and
computes the poses of the bodies with its own model.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from gazerig.features.world.rig_in_world import RigInWorld
from gazerig.features.world.state_file import StateReader
from gazerig.gaze.types import Vec3
from gazerig.robot.description.world_shapes import WorldPart
from gazerig.robot.model.frames import Quaternion

if TYPE_CHECKING:
    from gazerig.features.world.model import WorldModel

Poses = Mapping[str, tuple[Quaternion, Vec3]]


class HeadInState(NamedTuple):
    """A head other than the page's own.

    Attributes:
        rig: with all of its visible parts.
        joints: index of each joint in the state of the world.
    """

    rig: RigInWorld
    joints: Mapping[str, int]


class OtherHeads:
    """Several heads of a world, as a value that is small to send."""

    def __init__(self, state: Path, heads: Sequence[HeadInState]) -> None:
        self._state, self._heads = state, tuple(heads)
        self._reader: StateReader | None = None
        self._model: WorldModel | None = None
        self._data: Any = None
        self._bodies: dict[str, int] = {}

    def __reduce__(self) -> tuple[Any, ...]:
        return type(self), (self._state, self._heads)

    @property
    def rigs(self) -> tuple[RigInWorld, ...]:
        """Return the heads as rigs without servos."""
        return tuple(head.rig._replace(servos=()) for head in self._heads)

    def parts(self, model: "WorldModel", first: int) -> Iterator[WorldPart]:
        """Yield all parts of the heads, each in the frame of its body."""
        import mujoco

        from gazerig.features.world.geom_shapes import body_parts

        self._model, self._data = model, mujoco.MjData(model.mj)
        self._rigs = model.rigs[first:]
        for placed, head in zip(self._rigs, self._heads, strict=True):
            for name, angle in head.rig.start_rad.items():
                self._data.qpos[placed.qpos[name]] = angle
        for body, part in body_parts(model.mj, self.bodies(model, first)):
            self._bodies[part.name] = body
            yield part

    @staticmethod
    def bodies(model: "WorldModel", first: int) -> list[int]:
        """Return the numbers of all bodies of the heads in a model."""
        names = tuple(rig.names for rig in model.rigs[first:])
        there = range(1, model.mj.nbody)
        return [i for i in there if names and model.mj.body(i).name.startswith(names)]

    def poses(self) -> Poses:
        """Return the poses of all parts; none before a call of ``parts``."""
        if self._model is None:
            return {}
        import mujoco

        if self._reader is None:
            with suppress(OSError):  # the emulator has ended, or not started
                self._reader = StateReader(self._state)
        newest = None if self._reader is None else self._reader.newest()
        if newest is not None:
            for placed, head in zip(self._rigs, self._heads, strict=True):
                for name, at in head.joints.items():
                    self._data.qpos[placed.qpos[name]] = newest.qpos[at]
        mujoco.mj_kinematics(self._model.mj, self._data)
        places, turns = self._data.xpos.tolist(), self._data.xquat.tolist()
        return {name: (tuple(turns[i]), tuple(places[i])) for name, i in self._bodies.items()}
