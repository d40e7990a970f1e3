"""With a world the page shows its room and its people, and only marks what the rig has seen."""

import io
import pickle
from dataclasses import replace

import numpy as np
import pytest
import trimesh
import viser
from shown_page import SNAPSHOT
from test_page import face_at
from world_shapes import LEAVES_S, SmallWorld

from gazerig.robot.dashboard.view.head_view import HeadView
from gazerig.robot.dashboard.view.people import PeopleView
from gazerig.robot.dashboard.view.world_view import WorldView, room_glbs
from gazerig.robot.model.types import SeenBody


def shown(server: viser.ViserServer, start: str) -> set[str]:
    return {
        name
        for name, one in server.scene._handle_from_node_name.items()
        if one.visible and name.startswith(start) and not isinstance(one, viser.FrameHandle)
    }


def test_people_of_a_world_are_where_they_are_at_the_time() -> None:
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


def test_the_same_world_is_made_once_and_another_in_its_place() -> None:
    server = viser.ViserServer(port=0, verbose=False)
    try:
        view = WorldView(server.scene)
        view.show(SmallWorld(), 0.0)
        first = server.scene._handle_from_node_name["/room/0"]
        view.show(pickle.loads(pickle.dumps(SmallWorld())), 1.0)
        assert server.scene._handle_from_node_name["/room/0"] is first
        view.show(SmallWorld((10, 20, 30)), 2.0)
        assert server.scene._handle_from_node_name["/room/0"] is not first
        assert len(shown(server, "/room/")) == 2 and len(shown(server, "/world/")) == 2
    finally:
        server.stop()


def test_what_stands_still_is_few_files_that_need_no_light() -> None:
    plain, wall = (
        trimesh.load_scene(io.BytesIO(data), "glb") for data in room_glbs(SmallWorld().parts())
    )
    (floor_and_stool,), (textured,) = (scene.geometry.values() for scene in (plain, wall))
    assert len(floor_and_stool.faces) == 2 * 2 * 8 * 8
    assert floor_and_stool.bounds[0] == pytest.approx((-1.5, -2.0, -0.9))
    image = np.asarray(textured.visual.material.baseColorTexture)
    texels = image[
        np.rint((1.0 - textured.visual.uv[:, 1]) * image.shape[0] - 0.5).astype(int),
        np.rint(textured.visual.uv[:, 0] * image.shape[1] - 0.5).astype(int),
    ]
    # Every vertex finds its colour: chequered along the wall's height.
    light = np.isclose(texels[:, 2], 210, atol=3)
    assert 0.4 < light.mean() < 0.7 and np.isclose(texels[~light, 2], 147, atol=3).all()
    for data in room_glbs(SmallWorld().parts()):
        assert b"KHR_materials_unlit" in data


def test_with_a_world_what_was_seen_is_only_marked() -> None:
    server = viser.ViserServer(port=0, verbose=False)
    seen = replace(
        SNAPSHOT,
        faces=(face_at((0.9, 0.1, 0.25)),),
        bodies=(SeenBody(7, "hand", (0.6, 0.2, 0.1), 0.06), SeenBody(8, "thing", (0.6, 0, 0), 0.1)),
    )
    try:
        people, head = PeopleView(server.scene), HeadView(server.scene)
        people.show(seen)
        head.show(seen)
        assert {"/faces/3/head", "/bodies/7/hand", "/shades/3"} <= shown(server, "/")
        people.mark_only(True)
        head.on_table = True
        people.show(seen, parts=True)
        head.show(seen)
        marks = shown(server, "/")
        assert {
            "/faces/3/outline",
            "/faces/3/label",
            "/bodies/7/outline",
            "/bodies/8/outline",
        } <= marks
        assert not {"/faces/3/head", "/chests/3", "/bodies/7/hand", "/shade"} & marks
        assert not shown(server, "/shades")
        outline = server.scene._handle_from_node_name["/faces/3/outline"]
        assert isinstance(outline, viser.MeshHandle)
        assert outline.scale == pytest.approx((1.0, 0.8, 1.12), abs=0.02)
        people.mark_only(False)
        head.on_table = False
        people.show(seen)
        head.show(seen)
        assert {"/faces/3/head", "/chests/3", "/shade"} <= shown(server, "/")
    finally:
        server.stop()
