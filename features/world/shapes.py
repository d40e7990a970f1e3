"""Shapes of a world for a process that draws it: geoms of its model and segments of people.

MuJoCo is loaded in the process that creates the shapes, not in the sender.
"""

from collections.abc import Mapping, Sequence
from math import radians
from typing import NamedTuple

import numpy as np

from gazerig.features.world.figure import Figures
from gazerig.features.world.opponent_motion import Opponent
from gazerig.features.world.other_heads import OtherHeads
from gazerig.features.world.rig_in_world import RigInWorld
from gazerig.features.world.rotations import rotation_matrix
from gazerig.features.world.world_scene import RigFrame
from gazerig.features.world.world_spec import WorldSpec
from gazerig.gaze.types import Vec3
from gazerig.robot.description.mesh import Painted
from gazerig.robot.description.texture import TexturedMesh
from gazerig.robot.description.world_shapes import WorldPart, WorldShapes
from gazerig.robot.model.frames import Quaternion, quaternion

_SKIN = ("head", "neck", "lips", "left_hand", "right_hand", "left_lid", "right_lid")

_FINENESS = 0.6
"""People on the page are farther away than those before the rig's camera."""


class SpecShapes(NamedTuple):
    """The shapes of a world without its first rig, which the page draws from measurements.

    spec: the world, with rigs that are only placements
    rig_joints: a body of a user's world at one of these joints belongs to the rig
    others: the other heads in it, None if they are not shown
    """

    spec: WorldSpec
    rig_joints: frozenset[str] = frozenset()
    others: OtherHeads | None = None

    def parts(self) -> Sequence[WorldPart]:
        """Return the room, other heads and all segments of people; see ``WorldShapes.parts``."""
        own, rigs = self.spec.rigs, () if self.others is None else self.others.rigs
        spec = self.spec if self.others is None else self.spec._replace(rigs=(own[0], *rigs))
        model = spec.compile()
        from gazerig.features.world.figure_model import figure_shapes
        from gazerig.features.world.geom_shapes import fixed_parts

        figures = self.spec.figures
        moving = {} if figures is None else figure_shapes(figures, _FINENESS)
        heads = () if self.others is None else tuple(self.others.parts(model, 1))
        bodies = [] if self.others is None else self.others.bodies(model, 1)
        elsewhere = {*moving, *(model.mj.body(i).name for i in bodies)}
        return (
            *fixed_parts(model.mj, elsewhere, self.rig_joints),
            *heads,
            *(
                WorldPart(
                    name, shape, "skin" if name.split("/")[-1] in _SKIN else "cloth", moves=True
                )
                for name, shape in moving.items()
            ),
        )

    @property
    def opponent(self) -> Opponent | None:
        """Return the boxer that a person can move, None without one."""
        return None if self.spec.figures is None else self.spec.figures.opponent

    def poses(self, world_s: float) -> Mapping[str, tuple[Quaternion, Vec3]]:
        """Return the poses of all moving parts; see ``WorldShapes.poses``."""
        figures = self.spec.figures
        heads = {} if self.others is None else self.others.poses()
        if figures is None:
            return heads
        now = figures.segments(world_s)
        rows = zip(figures.names, now.quat.tolist(), now.p_m.tolist(), strict=True)
        people = {name: ((w, x, y, z), (p, q, r)) for name, (w, x, y, z), (p, q, r) in rows}
        return {**people, **heads}


def shapes_of(spec: WorldSpec, others: OtherHeads | None = None) -> SpecShapes:
    """Return the shapes of a world; they are small to send."""
    joints = {rig.prefix + name for rig in spec.rigs for name in rig.stops_rad}
    places = tuple(
        rig._replace(body=_no_body, stops_rad={}, start_rad={}, servos=()) for rig in spec.rigs
    )
    return SpecShapes(spec._replace(rigs=places), frozenset(joints), others)


def script_shapes(figures: Figures) -> SpecShapes:
    """Return the shapes of a script's world without any rig; they are small to send."""
    first = RigInWorld(_no_body, {}, {}, ())
    heads = [
        first._replace(
            prefix=f"{name}_", p_m=(head.x_m, head.y_m, 0.0), yaw_rad=radians(head.facing_deg)
        )
        for name, head in figures.script.heads.items()
    ]
    return SpecShapes(WorldSpec(figures, (first, *heads)))


def _no_body() -> tuple[str, Mapping[str, bytes]]:
    return "<mujoco/>", {}


class ShapesInFrame(NamedTuple):
    """The shapes of a world in the frame of a rig."""

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
