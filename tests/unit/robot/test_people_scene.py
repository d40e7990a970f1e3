"""Visitors on the page are people with a face, where they were seen; hands are hands."""

import pytest
import viser
from page_feed import shown
from seen_things import seen

from gazerig.robot.dashboard.view.people import PeopleView
from gazerig.robot.description.people import LOOKS, head
from gazerig.robot.model.face_geometry import PARTS_FACE_M


def scene() -> tuple[viser.ViserServer, PeopleView]:
    server = viser.ViserServer(port=0, verbose=False)
    return server, PeopleView(server.scene)


def nodes(server: viser.ViserServer) -> set[str]:
    handles = server.scene._handle_from_node_name
    return {name for name, handle in handles.items() if handle.visible}


@pytest.mark.parametrize("part", ["LE", "RE", "M", "N", "DN", "UP", "FL", "FR"])
def test_a_person_has_the_parts_of_a_face_where_the_canonical_face_has_them(part):
    import trimesh  # half a second of a processor, which no other test needs at collection
    from trimesh.proximity import closest_point_naive

    for number in range(LOOKS):
        mesh = trimesh.Trimesh(*head(number).mesh, process=False)
        _, (away_m,), _ = closest_point_naive(mesh, [PARTS_FACE_M[part]])
        assert away_m < 0.006, number


def test_a_person_a_hand_and_a_thing_are_drawn_and_go():
    server, people = scene()
    try:
        people.show(seen("hand").tick)
        assert {"/faces/3/head", "/chests/3", "/bodies/7/hand", "/bodies/8/ball"} <= nodes(server)
        head = server.scene._handle_from_node_name["/faces/3/head"]
        assert isinstance(head, viser.GlbHandle) and head.scale == pytest.approx(1.0, abs=0.02)
        people.show(seen("thing").tick)
        assert "/bodies/7/ball" in nodes(server) and "/bodies/7/hand" not in nodes(server)
        people.show(shown(percept=None).tick)
        left = nodes(server)
        assert not any(
            name.startswith(("/faces/", "/chests/", "/bodies/", "/shades/")) for name in left
        )
    finally:
        server.stop()
