"""Shapes of a world for a process that draws it: geoms of its model and segments of people.

MuJoCo is loaded in the process that creates the shapes, not in the sender.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from gazerig.features.world.figure import Figures
from gazerig.features.world.gl_context import import_mujoco
from gazerig.gaze.types import Vec3
from gazerig.robot.dashboard.feed.world_shapes import WorldPart
from gazerig.robot.model.frames import Quaternion

_SKIN = ("head", "neck", "lips", "left_hand", "right_hand", "left_lid", "right_lid")


class SpecShapes(NamedTuple):
    """The shapes of a world without its rig, which the page draws from measurements.

    figures, mjcf_file: as of ``WorldSpec``; they are small to send
    """

    figures: Figures
    mjcf_file: Path | None = None

    def parts(self) -> Sequence[WorldPart]:
        """Return the room and all segments of people; see ``WorldShapes.parts``."""
        import_mujoco()
        from gazerig.features.world.figure_model import figure_shapes
        from gazerig.features.world.geom_shapes import fixed_parts
        from gazerig.features.world.model import world_spec

        model = world_spec(self.figures, self.mjcf_file).compile()
        moving = figure_shapes(self.figures)
        return (
            *fixed_parts(model, moving),
            *(
                WorldPart(
                    name, shape, "skin" if name.split("/")[-1] in _SKIN else "cloth", moves=True
                )
                for name, shape in moving.items()
            ),
        )

    def poses(self, world_s: float) -> Mapping[str, tuple[Quaternion, Vec3]]:
        """Return the poses of all moving parts; see ``WorldShapes.poses``."""
        now = self.figures.segments(world_s)
        rows = zip(self.figures.names, now.quat.tolist(), now.p_m.tolist(), strict=True)
        return {name: ((w, x, y, z), (p, q, r)) for name, (w, x, y, z), (p, q, r) in rows}
