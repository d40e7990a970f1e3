"""Shapes of a world for a process that draws it: geoms of its model and segments of people.

MuJoCo is loaded in the process that creates the shapes, not in the sender.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from gazerig.features.world.opponent_motion import Opponent
from gazerig.features.world.world_spec import WorldSpec
from gazerig.gaze.types import Vec3
from gazerig.robot.dashboard.feed.world_shapes import WorldPart
from gazerig.robot.model.frames import Quaternion

_SKIN = ("head", "neck", "lips", "left_hand", "right_hand", "left_lid", "right_lid")


class SpecShapes(NamedTuple):
    """The shapes of a world without its rig, which the page draws from measurements.

    spec: the world, without the body of its rig
    rig_joints: a body of a user's world at one of these joints belongs to the rig
    """

    spec: WorldSpec
    rig_joints: frozenset[str] = frozenset()

    def parts(self) -> Sequence[WorldPart]:
        """Return the room and all segments of people; see ``WorldShapes.parts``."""
        model = self.spec.compile()
        from gazerig.features.world.figure_model import figure_shapes
        from gazerig.features.world.geom_shapes import fixed_parts

        figures = self.spec.figures
        moving = {} if figures is None else figure_shapes(figures)
        return (
            *fixed_parts(model.mj, moving, self.rig_joints),
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
        if figures is None:
            return {}
        now = figures.segments(world_s)
        rows = zip(figures.names, now.quat.tolist(), now.p_m.tolist(), strict=True)
        return {name: ((w, x, y, z), (p, q, r)) for name, (w, x, y, z), (p, q, r) in rows}


def shapes_of(spec: WorldSpec) -> SpecShapes:
    """Return the shapes of a world; they are small to send."""
    joints = {name for rig in spec.rigs for name in rig.stops_rad}
    places = tuple(
        rig._replace(body=_no_body, stops_rad={}, start_rad={}, servos=()) for rig in spec.rigs
    )
    return SpecShapes(spec._replace(rigs=places), frozenset(joints))


def _no_body() -> tuple[str, Mapping[str, bytes]]:
    return "<mujoco/>", {}
