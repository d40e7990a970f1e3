"""The shapes of a world in the frame of the neck base of a rig other than the first."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from gazerig.features.world.heads_scene import RigFrame
from gazerig.features.world.rotations import rotation_matrix
from gazerig.gaze.types import Vec3
from gazerig.robot.description.paint import Painted
from gazerig.robot.description.texture import TexturedMesh
from gazerig.robot.description.world_shapes import WorldPart, WorldShapes
from gazerig.robot.model.quaternion import Quaternion, quaternion


class ShapesFrom(NamedTuple):
    """The shapes of a world in the frame of a rig.

    Attributes:
        shapes: in the world's own frame.
        frame: of the rig.
    """

    shapes: WorldShapes
    frame: RigFrame

    def parts(self) -> Sequence[WorldPart]:
        """Return all visible parts; see ``WorldShapes.parts``."""
        return tuple(part if part.moves else self._turned(part) for part in self.shapes.parts())

    def poses(self, world_s: float) -> Mapping[str, tuple[Quaternion, Vec3]]:
        """Return the poses of all moving parts; see ``WorldShapes.poses``."""
        back = np.array(self.frame.R).T
        found = {}
        for name, (turn, p_m) in self.shapes.poses(world_s).items():
            a, b, c = (tuple(row) for row in (back @ rotation_matrix(np.array(turn))).tolist())
            found[name] = quaternion((a, b, c)), self.frame.point(p_m)
        return found

    def _turned(self, part: WorldPart) -> WorldPart:
        """Return a static part in the frame of the rig."""
        R, p_m, shape = np.array(self.frame.R), np.array(self.frame.p_m), part.shape
        if isinstance(shape, TexturedMesh):
            return part._replace(
                shape=shape._replace(vertices=(shape.vertices - p_m) @ R, normals=shape.normals @ R)
            )
        vertices = (shape.mesh.vertices - p_m) @ R
        normals = None if shape.normals is None else shape.normals @ R
        return part._replace(
            shape=Painted(shape.mesh._replace(vertices=vertices), shape.colours, normals)
        )
