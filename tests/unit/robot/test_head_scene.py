"""The page opens on a face: how much of the canvas the head fills, and whether its lids shut."""

from collections.abc import Callable, Iterator
from functools import cache, partial

import numpy as np
import pytest
import viser
from gaze_targets import joints_at
from msgspec import structs
from page_feed import visit
from viser import transforms

from gazerig.config.load import shipped_path
from gazerig.config.schema import load_rig
from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.feed.rig_feed import ShownHead
from gazerig.robot.dashboard.view.head_view import HeadView, head_dimensions
from gazerig.robot.dashboard.view.viewpoint import View, face_view
from gazerig.robot.description.mesh import Painted, merge_meshes, move_mesh, stored_shape
from gazerig.robot.description.people import head, part_of, torso
from gazerig.robot.run.models import rig_kinematics
from gazerig.robot.run.rig_description import shape_of

RIGS = sorted(path.stem for path in shipped_path("rigs", "desk").parent.glob("*.yaml"))
CANVASES = (1.6, 1280 / 720, 1.0, 0.9, 390 / 380)


@cache
def at_rest(name: str) -> ShownHead:
    """A shipped rig with all joints at 0."""
    rig = load_rig(name)
    return at(name, (0.0,) * len(rig_kinematics(rig).names))


def at(name: str, angles_rad: tuple[float, ...]) -> ShownHead:
    """A shipped rig with its joints at these angles."""
    rig, (made, tick) = load_rig(name), visit("desk")
    kinematics, joints = rig_kinematics(rig), joints_at(angles_rad)
    tick = structs.replace(tick, joints=joints, pose=kinematics.forward(joints))
    shown_rig = made.shown_rig()._replace(kinematics=kinematics, shape=shape_of(rig))
    return ShownHead(tick, shown_rig)


def drawn(seen: View, points_m: Floats, aspect: float) -> Floats:
    """Where points are on the canvas: -1..1 from side to side and from below to above."""
    eye = np.array(seen.position_m)
    ahead = np.array(seen.look_at_m) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    away = points_m - eye
    half_height = np.tan(0.5 * seen.fov_rad) * (away @ ahead)
    return np.stack(
        (away @ right / (half_height * aspect), away @ np.cross(right, ahead) / half_height), axis=1
    )


@cache
def skin_and_cap() -> Floats:
    """Return all points of the head, in distances between the eyes."""
    return merge_meshes([stored_shape("skin"), stored_shape("cap")]).mesh.vertices


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("aspect", CANVASES)
def test_the_head_fills_most_of_the_canvas_and_is_all_in_sight(name, aspect):
    shot = at_rest(name)
    unit = head_dimensions(shot).interocular_m
    points = skin_and_cap() * unit + shot.tick.pose.p_world_head_m
    on_canvas = drawn(face_view(shot), points, aspect)
    low, high = on_canvas.min(axis=0), on_canvas.max(axis=0)
    assert 0.60 <= 0.5 * (high[1] - low[1]) <= 0.8
    assert np.abs(on_canvas).max() < 1.0


def test_measures_follow_the_rig():
    for name in RIGS:
        rig = load_rig(name)
        found = head_dimensions(at_rest(name))
        assert 1e3 * found.interocular_m == pytest.approx(rig.geometry.interocular_mm, abs=0.1)
        assert -1e3 * found.pivot_m[2] == pytest.approx(rig.geometry.eyes_above_mm, abs=0.1)


WHOLE: dict[str, Callable[[], Painted]] = {
    **{name: partial(stored_shape, name) for name in ("cap", "brow", "eye", "ear", "neck", "bust")},
    "skin": lambda: merge_meshes([stored_shape("skin"), stored_shape("jaw")]),
    "other brow": lambda: move_mesh(stored_shape("brow"), scale=(1.0, -1.0, 1.0)),
    "person": lambda: head(0),
    "chest": lambda: torso(0, 0.34),
    "hand": lambda: part_of(0, "hand"),
}


@pytest.mark.parametrize("part", WHOLE)
def test_faces_are_turned_outwards_for_their_backs_are_not_drawn(part):
    vertices, faces = WHOLE[part]().mesh
    a, b, c = (vertices[faces[:, i]] - vertices.mean(axis=0) for i in range(3))
    assert (a * np.cross(b, c)).sum() > 0.0  # six times the volume within


# ---- The page's head is the rig's description: its links, where its joints put them.


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    made = viser.ViserServer(port=0, verbose=False)
    yield made
    made.stop()


def test_the_head_is_where_its_joints_put_it(server):
    """Every link is in its parent by the kinematics, at any angles of a shipped rig."""
    rig = load_rig("desk")
    view, count = HeadView(server.scene), len(rig_kinematics(rig).names)
    head = at("desk", tuple((0.3 * np.sin(np.arange(count))).tolist()))
    pose = head.tick.pose
    view.show(head)
    for link, p_world_m in (
        ("head", pose.p_world_head_m),
        ("left_eye", pose.p_world_eye_left_m),
        ("right_eye", pose.p_world_eye_right_m),
    ):
        where = _in_world(view, link)
        assert where.translation() == pytest.approx(p_world_m, abs=2e-4)
    yaw, pitch = pose.eye_left_rad
    in_head = (np.cos(yaw) * np.cos(pitch), np.sin(yaw) * np.cos(pitch), np.sin(pitch))
    ahead = _in_world(view, "left_eye").rotation().apply(np.array((1.0, 0.0, 0.0)))
    assert ahead == pytest.approx(np.array(pose.R_world_head) @ in_head, abs=2e-3)


def _in_world(view: HeadView, link: str) -> transforms.SE3:
    """Return the pose of a link in the scene, through its frames."""
    path = view.links[link].name
    found = transforms.SE3.identity()
    for one in view.links.values():
        if path == one.name or path.startswith(one.name + "/"):
            turn = transforms.SO3(np.array(one.wxyz))
            found = found @ transforms.SE3.from_rotation_and_translation(
                turn, np.array(one.position)
            )
    return found
