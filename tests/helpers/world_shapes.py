"""A small world for the page: a floor, a textured wall, and one person who comes and goes."""

from dataclasses import dataclass
from math import sin

import numpy as np

from gazerig.gaze.types import Vec3
from gazerig.robot.dashboard.feed.world_shapes import WorldPart
from gazerig.robot.description.mesh import Mesh, Painted, add_texture, paint
from gazerig.robot.description.people import head, torso
from gazerig.robot.model.frames import Quaternion

LEAVES_S = 60.0


def _plane(corner: Vec3, u: Vec3, v: Vec3) -> Mesh:
    along, up = np.array(u), np.array(v)
    points = np.array(corner) + (0.0 * up, up, along + up, along)
    return Mesh(points, np.array(((0, 1, 2), (0, 2, 3)), np.uint32))


def _chequered(mesh: Mesh) -> Painted:
    plain = paint(mesh, (150, 175, 210))
    dark = 1.0 - 0.3 * (np.arange(len(mesh.vertices)) // 2 % 2)
    return plain._replace(colours=plain.colours * dark[:, None])


@dataclass(frozen=True)
class SmallWorld:
    """A floor, a wall behind the head, a stool, and a person who walks along the floor."""

    colour: tuple[int, int, int] = (190, 160, 130)

    def parts(self) -> list[WorldPart]:
        floor = paint(_plane((-1.5, -2.0, -0.9), (0.0, 4.0, 0.0), (4.5, 0.0, 0.0)), self.colour)
        wall = _chequered(_plane((-1.5, -2.0, -0.9), (0.0, 0.0, 2.4), (0.0, 4.0, 0.0)))
        stool = paint(_plane((-0.3, -0.4, -0.09), (0.0, 0.8, 0.0), (0.6, 0.0, 0.0)), (90, 60, 40))
        return [
            WorldPart("floor", floor),
            WorldPart("stool", stool),
            WorldPart("wall", add_texture(wall)),
            WorldPart("ann/head", head(0), "skin", moves=True),
            WorldPart("ann/chest", torso(0, 0.34), "cloth", moves=True),
        ]

    def poses(self, world_s: float) -> dict[str, tuple[Quaternion, Vec3]]:
        if world_s >= LEAVES_S:
            return {}
        round_about = (0.0, 0.0, 0.0, 1.0)
        there = (1.1, 0.3 * sin(world_s), 0.25)
        return {"ann/head": (round_about, there), "ann/chest": (round_about, there)}
