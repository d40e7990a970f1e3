"""The page opens on a face: how much of the canvas the head fills, and whether its lids shut."""

import io
import json
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import trimesh
from shown_page import SNAPSHOT
from viser import transforms

from gazerig.config.load import shipped_path
from gazerig.config.schema import load_rig
from gazerig.gaze.types import Floats
from gazerig.robot.app.gaze_models import rig_kinematics
from gazerig.robot.app.rig_description import shape_of
from gazerig.robot.dashboard.view.glb import EYE, SKIN, Finish, glow_disc, painted_glb
from gazerig.robot.dashboard.view.head_view import head_dimensions, lid_edges, with_shown_face
from gazerig.robot.dashboard.view.scene_node import pitch_up
from gazerig.robot.dashboard.view.viewpoints import BOTH, FACE, SHOULDER, View, named_view
from gazerig.robot.description import head_mesh
from gazerig.robot.description.head_shape import EYE_RADIUS, eye_rim, field, measures_of, surface
from gazerig.robot.description.mesh import Mesh, Painted, grid, merge_meshes
from gazerig.robot.description.parts import LOWER_LID, UPPER_LID
from gazerig.robot.description.person_shape import hand, head, torso
from gazerig.robot.model.types import JointState, Snapshot

RIGS = sorted(path.stem for path in shipped_path("rigs", "desk").parent.glob("*.yaml"))
CANVASES = (1.6, 1280 / 720, 1.0, 0.9, 390 / 380)


@cache
def at_rest(name: str) -> Snapshot:
    """A snapshot of a shipped rig with all joints at 0."""
    rig = load_rig(name)
    kinematics = rig_kinematics(rig)
    zero = (0.0,) * len(kinematics.names)
    pose = kinematics.forward(JointState(zero, zero, zero, ()))
    own, _ = kinematics.body_volumes(pose.R_world_head, pose.p_world_head_m)
    return replace(
        SNAPSHOT,
        joints=kinematics.names,
        measured_rad=zero,
        R_world_head=pose.R_world_head,
        p_world_head_m=pose.p_world_head_m,
        p_world_eyes_m=(pose.p_world_eye_left_m, pose.p_world_eye_right_m),
        p_world_pivot_m=own.start_m,
    )


def drawn(seen: View, points_m: Floats, aspect: float) -> Floats:
    """Where points are on the canvas: -1..1 from side to side and from below to above."""
    eye = np.array(seen.position_m)
    ahead = np.array(seen.look_at_m) - eye
    ahead /= np.linalg.norm(ahead)
    right = np.cross(ahead, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    away = points_m - eye
    half_height = np.tan(0.5 * seen.field_rad(aspect)) * (away @ ahead)
    return np.stack(
        (away @ right / (half_height * aspect), away @ np.cross(right, ahead) / half_height), axis=1
    )


@cache
def skin_and_cap() -> Floats:
    """Return all points of the head, in distances between the eyes."""
    parts = (head_mesh.skin().head.mesh, head_mesh.cap().mesh)
    return np.concatenate([part.vertices for part in parts])


@pytest.mark.parametrize("name", RIGS)
@pytest.mark.parametrize("aspect", CANVASES)
def test_the_head_fills_most_of_the_canvas_and_is_all_in_sight(name: str, aspect: float) -> None:
    shot = at_rest(name)
    unit = head_dimensions(shot).interocular_m
    points = skin_and_cap() * unit + shot.p_world_head_m
    on_canvas = drawn(named_view(FACE, shot), points, aspect)
    low, high = on_canvas.min(axis=0), on_canvas.max(axis=0)
    assert 0.60 <= 0.5 * (high[1] - low[1]) <= 0.8
    assert np.abs(on_canvas).max() < 1.0


def test_the_face_is_seen_from_the_front_and_not_past_the_visitor() -> None:
    seen = named_view(FACE, at_rest("desk"))
    off = np.subtract(seen.position_m, seen.look_at_m)
    assert abs(np.degrees(np.arctan2(off[1], off[0]))) <= 5.0
    assert 0.0 <= np.degrees(np.arctan2(off[2], np.hypot(off[0], off[1]))) < 10.0
    assert 0.4 < np.linalg.norm(off) < 0.8  # before the visitors of the shipped scenes


@pytest.mark.parametrize("name", [BOTH, SHOULDER])
def test_other_views_show_as_much_from_side_to_side_in_any_window(name: str) -> None:
    wide, tall = (np.tan(0.5 * named_view(name).field_rad(a)) * a for a in (1.6, 0.5))
    assert wide == pytest.approx(tall)


def met(mesh: Mesh, rays: Floats) -> np.ndarray:
    """Return which rays from the origin meet a triangle (Moeller and Trumbore)."""
    a, b, c = (mesh.vertices[mesh.faces[:, i]] for i in range(3))
    one, other = b - a, c - a
    found = np.zeros(len(rays), bool)
    for i, ray in enumerate(rays):
        p = np.cross(ray, other)
        det = (one * p).sum(axis=1)
        det[np.abs(det) < 1e-12] = np.inf
        u = -(a * p).sum(axis=1) / det
        q = np.cross(-a, one)
        v = q @ ray / det
        t = (other * q).sum(axis=1) / det
        found[i] = ((u >= -1e-9) & (v >= -1e-9) & (u + v <= 1 + 1e-9) & (t > 0.0)).any()
    return found


def covered(opening: float, lower: float) -> Floats:
    """Return which directions of the visible eye the lids hide; rows from below to above."""
    up, aside = np.meshgrid(np.radians(np.arange(-60, 61, 8)), np.radians(np.arange(-60, 61, 12)))
    rays = np.stack(
        (np.cos(up) * np.cos(aside), np.cos(up) * np.sin(aside), np.sin(up)), axis=-1
    ).reshape(-1, 3)
    hidden = np.zeros(len(rays), bool)
    edges = lid_edges(with_shown_face(shape_of(load_rig("maker"))))  # all lids move
    for upper, edge_rad in (
        (True, edges.elevation_rad("left_upper_lid", opening)),
        (False, edges.elevation_rad("left_lower_lid", lower)),
    ):
        painted = head_mesh.eyelid(upper)
        into_lid = (
            transforms.SO3(np.array(pitch_up(edge_rad))).inverse().apply(rays).astype(np.float64)
        )
        hidden |= met(painted.mesh, into_lid)
    return hidden


def test_lids_shut_fully_and_open_as_far_as_measured() -> None:
    assert covered(0.0, 0.0).all()
    assert covered(0.0, 1.0).mean() < 1.0  # the lower lid takes its part of the shutting
    opened = [covered(opening, opening).mean() for opening in (0.0, 0.3, 0.6, 1.0)]
    assert opened == sorted(opened, reverse=True) and opened[-1] < 0.45
    # A lid is outside the eyeball with its cornea, wherever the eye looks.
    tallest = np.linalg.norm(head_mesh.eye().mesh.vertices, axis=1).max()
    assert 1.0 < tallest < min(UPPER_LID, LOWER_LID) - 0.01


def test_the_skin_leaves_the_eyes_free() -> None:
    eyes = EYE_RADIUS
    yaw, pitch = np.meshgrid(np.radians(np.arange(-50, 51, 10)), np.radians(np.arange(-40, 41, 10)))
    front = np.stack(
        (np.cos(pitch) * np.cos(yaw), np.cos(pitch) * np.sin(yaw), np.sin(pitch)), axis=-1
    ).reshape(-1, 3)
    for side in (0.5, -0.5):
        assert (field(eyes * front + (0.0, side, 0.0)) > 0.0).all()
        assert field(np.array(((0.0, side, 0.0),)))[0] < 0.0  # and hides what holds them


def test_the_skin_about_an_eye_comes_from_the_lids_and_ends_in_the_face() -> None:
    points, normals = eye_rim()
    assert np.isfinite(points).all() and np.linalg.norm(normals, axis=-1) == pytest.approx(1.0)
    off = points - (0.0, 0.5, 0.0)
    # Its inmost edge is under the lids, the next just outside them, and all of it leaves the eye.
    assert (np.linalg.norm(off[0], axis=1) < EYE_RADIUS * LOWER_LID).all()
    assert (np.linalg.norm(off[1:], axis=2) > EYE_RADIUS * UPPER_LID).all()
    from_axis = np.degrees(np.arctan2(np.hypot(off[..., 1], off[..., 2]), off[..., 0]))
    assert from_axis[1:].min() > 50.0  # an upper lid opens to 48
    # There are no gaps: the skin continues at its end and is below it before.
    assert (field(points[-1]) < 0.0).all() and (field(points[1:-1].reshape(-1, 3)) > 0.0).all()


def test_the_head_is_as_wide_at_the_jaw_as_a_face_is() -> None:
    # Half its width, at the eyes, at the mouth and at the chin, between the ears and the tip.
    eyes, mouth, chin = (_half_width(z) for z in (0.0, -0.95, -1.45))
    assert 0.70 * eyes < mouth < 0.95 * eyes and 0.3 * eyes < chin < 0.65 * eyes


def _half_width(z: float) -> float:
    """Return the half width of the head at a height, in front of its neck."""
    x, y = np.meshgrid(np.linspace(-0.9, 0.3, 40), np.linspace(0.0, 1.4, 100))
    at = np.stack((x.ravel(), y.ravel(), np.full(x.size, z)), axis=1)
    return float(at[field(at) < 0.0, 1].max())


def test_the_surface_is_closed_and_faces_outwards() -> None:
    points, normals = surface()
    assert np.isfinite(points).all()
    out = points - points.reshape(-1, 3).mean(axis=0)
    assert ((out * normals).sum(axis=-1) > -0.3).all()
    assert field(points.reshape(-1, 3)) == pytest.approx(0.0, abs=0.02)


def test_measures_follow_the_rig() -> None:
    small = measures_of((0.0, 0.02, 0.0), (0.0, -0.02, 0.0))
    assert small.interocular_m == 0.04
    assert small.height_m == pytest.approx(
        0.04 / 0.0619 * measures_of((0, 0.03095, 0), (0, -0.03095, 0)).height_m, rel=1e-3
    )
    for name in RIGS:
        rig = load_rig(name)
        found = head_dimensions(at_rest(name))
        assert 1e3 * found.interocular_m == pytest.approx(rig.geometry.interocular_mm, abs=0.1)
        assert -1e3 * found.pivot_m[2] == pytest.approx(rig.geometry.eyes_above_mm, abs=0.1)


WHOLE: dict[str, Callable[[], Painted]] = {
    "cap": head_mesh.cap,
    "brow": head_mesh.brow,
    "eye": head_mesh.eye,
    "ear": head_mesh.ear,
    "neck": head_mesh.neck,
    "bust": head_mesh.bust,
    "skin": lambda: merge_meshes([head_mesh.skin().head, head_mesh.skin().jaw]),
    "person": lambda: head(0, 0.8),
    "chest": lambda: torso(0, 0.34),
    "hand": lambda: hand(0),
}


@pytest.mark.parametrize("part", WHOLE)
def test_faces_are_turned_outwards_for_their_backs_are_not_drawn(part: str) -> None:
    vertices, faces = WHOLE[part]().mesh
    a, b, c = (vertices[faces[:, i]] - vertices.mean(axis=0) for i in range(3))
    assert (a * np.cross(b, c)).sum() > 0.0  # six times the volume within


def test_the_skin_about_the_eyes_faces_outwards() -> None:
    points, outwards = eye_rim()
    vertices, faces = grid(points, closed=True)
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    flat = np.cross(b - a, c - a)
    assert ((flat * outwards.reshape(-1, 3)[faces[:, 0]]).sum(axis=1) > 0.0).mean() > 0.9


def test_the_dark_of_a_mouth_is_hidden_by_the_skin_until_it_opens() -> None:
    vertices = head_mesh.mouth().mesh.vertices
    below_eyes = vertices[vertices[:, 2] < -0.5]
    assert (field(below_eyes) < 0.03).all()  # the lips themselves are as far outside the skin


def test_the_head_is_drawn_of_few_triangles() -> None:
    one = ("cap", "brow", "eye", "ear", "neck", "bust", "skin")
    drawn_faces = sum(
        len(WHOLE[part]().mesh.faces) * (1 + (part in ("brow", "eye", "ear"))) for part in one
    )
    lids = 2 * sum(len(head_mesh.eyelid(upper).mesh.faces) for upper in (True, False))
    assert drawn_faces + lids < 25_000


def test_only_the_eyes_are_lit_by_the_browser() -> None:
    tree = _tree(painted_glb(head_mesh.eye(), EYE))
    (material,) = tree["materials"]
    assert "KHR_materials_unlit" not in material["extensions"]
    assert material["pbrMetallicRoughness"]["roughnessFactor"] < 0.3
    assert tree["meshes"][0]["primitives"][0]["material"] == 0
    assert {"COLOR_0", "NORMAL", "POSITION"} <= set(
        tree["meshes"][0]["primitives"][0]["attributes"]
    )
    assert "alphaMode" not in tree["materials"][0]
    brow = _tree(painted_glb(head_mesh.brow(), SKIN))
    assert "KHR_materials_unlit" in brow["materials"][0]["extensions"]
    assert "NORMAL" not in brow["meshes"][0]["primitives"][0]["attributes"]
    plain: Painted = glow_disc((0, 0, 0, 90))
    assert _tree(painted_glb(plain, SKIN))["materials"][0]["alphaMode"] == "BLEND"


@pytest.mark.parametrize(
    ("painted", "finish"), [(head_mesh.eye, EYE), (head_mesh.brow, SKIN)], ids=["eye", "brow"]
)
def test_another_reader_finds_the_mesh_in_the_file(
    painted: Callable[[], Painted], finish: Finish
) -> None:
    mesh, colours, normals = painted()
    data = painted_glb(Painted(mesh, colours, normals), finish._replace(is_lit=False))
    scene = trimesh.load_scene(io.BytesIO(data), "glb")
    (found,) = scene.geometry.values()
    assert np.asarray(found.vertices) == pytest.approx(mesh.vertices, abs=1e-6)
    assert (np.asarray(found.faces) == mesh.faces).all()
    on_screen = np.asarray(found.visual.vertex_attributes["color"], float)[:, :3] / 255.0
    linear = np.where(
        colours <= 10.31, colours / 255.0 / 12.92, ((colours / 255.0 + 0.055) / 1.055) ** 2.4
    )
    assert on_screen == pytest.approx(linear[:, :3], abs=0.003)
    if finish is EYE:
        assert np.asarray(found.vertex_normals) == pytest.approx(normals, abs=1e-6)


def _tree(data: bytes) -> dict:
    length = int.from_bytes(data[12:16], "little")
    return json.loads(data[20 : 20 + length])
