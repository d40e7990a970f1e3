"""Shapes of a simulated world for another process to draw: its room, and people as they move."""

from collections.abc import Mapping, Sequence
from typing import Literal, NamedTuple, Protocol

from gazerig.gaze.types import Vec3
from gazerig.robot.description.mesh import Painted
from gazerig.robot.description.texture import TexturedMesh
from gazerig.robot.model.frames import Quaternion

WorldFinish = Literal["skin", "plastic", "cloth", "flat"]
"""How a surface answers light; what is flat is shown in its own colours."""


class WorldPart(NamedTuple):
    """Something of a world that is rigid: a piece of the room, or one segment of a person.

    name: no other part's; with "/" between the names of a thing and of its part
    shape: its surface in the world, or in its own frame if it moves
    moves: it has a pose of its own at every time
    """

    name: str
    shape: Painted | TexturedMesh
    finish: WorldFinish = "cloth"
    moves: bool = False


class WorldShapes(Protocol):
    """Tells how a world looks; can be sent to another process, which alone makes the shapes."""

    def parts(self) -> Sequence[WorldPart]:
        """Return all visible shapes except the rig itself."""
        ...

    def poses(self, world_s: float) -> Mapping[str, tuple[Quaternion, Vec3]]:
        """Return how parts that move are turned and where they are in the world, by their names.

        Args:
            world_s: time since the world began, seconds.

        Returns:
            The parts that are there; others are not to be seen now.
        """
        ...
