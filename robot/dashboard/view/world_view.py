"""Draw a simulated world: its room, and people at their true positions."""

from collections.abc import Iterable
from typing import Final

import viser

from gazerig.robot.dashboard.feed.world_shapes import WorldFinish, WorldPart, WorldShapes
from gazerig.robot.dashboard.view.glb import FINISHES, painted_glb, textured_glb
from gazerig.robot.dashboard.view.scene_node import set_pose
from gazerig.robot.description.mesh import Painted, merge_meshes

_FOG_M: Final = (1.2, 10.0)
"""Distances at which the room begins to fade and is fully faded, m; the head stays the subject."""
_FOG_COLOUR: Final = (233, 236, 240)


class WorldView:
    """Room of the scene, and all moving objects."""

    def __init__(self, scene: viser.SceneApi) -> None:
        self._scene = scene
        self._shapes: WorldShapes | None = None
        self._still: list[viser.GlbHandle] = []
        self._moving: dict[str, viser.GlbHandle] = {}

    def show(self, shapes: WorldShapes, world_s: float) -> None:
        """Move all objects to their poses at a time; draw a new world if it has changed."""
        if self._shapes is None or shapes != self._shapes:
            self._build(shapes)
        poses = shapes.poses(world_s)
        for name, handle in self._moving.items():
            pose = poses.get(name)
            if handle.visible != (pose is not None):
                handle.visible = pose is not None
            if pose is not None:
                turn, p_world_m = pose
                set_pose(handle, p_world_m, turn)

    def _build(self, shapes: WorldShapes) -> None:
        for handle in (*self._still, *self._moving.values()):
            handle.remove()
        self._shapes = shapes
        parts = shapes.parts()
        self._moving = {
            part.name: self._add(f"/world/{part.name}", part_glb(part))
            for part in parts
            if part.moves
        }
        self._still = [
            self._add(f"/room/{number}", data) for number, data in enumerate(room_glbs(parts))
        ]
        near_m, far_m = _FOG_M
        self._scene.configure_fog(near_m, far_m, color=_FOG_COLOUR)

    def _add(self, name: str, data: bytes) -> viser.GlbHandle:
        return self._scene.add_glb(name, data, cast_shadow=False, receive_shadow=False)


def room_glbs(parts: Iterable[WorldPart]) -> list[bytes]:
    """Return the static objects as a few files: one for each finish and each texture."""
    files: list[bytes] = []
    plain: dict[WorldFinish, list[Painted]] = {}
    for part in parts:
        if part.moves:
            continue
        shape = part.shape
        if isinstance(shape, Painted):
            plain.setdefault(part.finish, []).append(shape)
        else:
            files.append(part_glb(part))
    return [
        painted_glb(merge_meshes(shapes), FINISHES[finish]) for finish, shapes in plain.items()
    ] + files


def part_glb(part: WorldPart) -> bytes:
    """Return one part as a binary glTF file."""
    finish = FINISHES[part.finish]
    if isinstance(part.shape, Painted):
        return painted_glb(part.shape, finish)
    return textured_glb(part.shape, finish)
