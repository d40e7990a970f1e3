"""Shapes of a simulated world for drawing in another process: its room, and moving people."""

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple, Protocol

from gazerig.gaze.types import Vec3
from gazerig.robot.description.mesh import Painted, TexturedMesh
from gazerig.robot.model.frames import Quaternion

WorldFinish = Literal["skin", "plastic", "cloth", "flat"]
"""Reflection of a surface; flat surfaces are shown in their own colours."""


class WorldPart(NamedTuple):
    """Rigid part of a world: a piece of the room, or one segment of a person.

    name: unique name; "/" separates the names of an object and of its part
    shape: its surface in the world, or in its own frame if it moves
    moves: whether it has a separate pose at every time
    """

    name: str
    shape: Painted | TexturedMesh
    finish: WorldFinish = "cloth"
    moves: bool = False


class WorldShapes(Protocol):
    """Appearance of a world; can be sent to another process, which creates the shapes."""

    def parts(self) -> Sequence[WorldPart]:
        """Return all visible shapes except the rig itself."""

    def poses(self, world_s: float) -> Mapping[str, tuple[Quaternion, Vec3]]:
        """Return the orientations and positions of moving parts in the world, by their names.

        Args:
            world_s: time since the start of the world, seconds.

        Returns:
            The parts that are visible now; the others are hidden.
        """
