"""With a world the page shows its room and its people, and what the rig has seen only without."""

import numpy as np
import pytest
import viser
from seen_things import seen
from world_shapes import LEAVES_S, SmallWorld

from gazerig.robot.dashboard.view.head_view import HeadView
from gazerig.robot.dashboard.view.people import PeopleView
from gazerig.robot.dashboard.view.world_view import WorldView


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
