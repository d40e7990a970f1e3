"""With a world the page shows its room and its people, and what the rig has seen only without."""

from dataclasses import dataclass
from math import sin

import numpy as np
import pytest
import viser
from seen_things import seen

from gazerig.gaze.types import Vec3
from gazerig.robot.dashboard.feed.world_shapes import WorldPart
from gazerig.robot.dashboard.view.head_view import HeadView
from gazerig.robot.dashboard.view.people import PeopleView
from gazerig.robot.dashboard.view.world_view import WorldView
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


def shown(server: viser.ViserServer, start: str) -> set[str]:
    return {
        name
        for name, one in server.scene._handle_from_node_name.items()
        if one.visible and name.startswith(start) and not isinstance(one, viser.FrameHandle)
    }


def test_people_of_a_world_are_where_they_are_at_the_time():
    server = viser.ViserServer(port=0, verbose=False)
    try:
        view, world = WorldView(server.scene), SmallWorld()
        for world_s in (0.0, 1.0, 4.0):
            view.show(world, world_s)
            head = server.scene._handle_from_node_name["/world/ann/head"]
            assert head.position == pytest.approx((1.1, 0.3 * np.sin(world_s), 0.25), abs=1e-4)
            assert np.abs(head.wxyz) == pytest.approx((0.0, 0.0, 0.0, 1.0), abs=1e-6)
        assert shown(server, "/world/") == {"/world/ann/head", "/world/ann/chest"}
        view.show(world, LEAVES_S)
        assert shown(server, "/world/") == set()
        view.show(world, 2.0)
        assert len(shown(server, "/world/")) == 2
    finally:
        server.stop()


def test_with_a_world_what_was_seen_is_not_drawn_again():
    server = viser.ViserServer(port=0, verbose=False)
    rig = seen("hand")
    drawn = {"/faces/3/head", "/chests/3", "/bodies/7/hand", "/shades/3", "/shade"}
    try:
        people, head = PeopleView(server.scene), HeadView(server.scene)
        for has_world in (False, True, False):
            head.on_table = has_world
            people.show(rig.tick, people=not has_world)
            head.show(rig)
            found = shown(server, "/")
            assert drawn.isdisjoint(found) if has_world else drawn <= found
            assert "/target/point" in found
    finally:
        server.stop()
