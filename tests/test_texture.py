"""Colours of vertices as a texture: the same triangles in the same colours."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.gaze.types import Floats
from gazerig.robot.dashboard.view.glb import glow_disc
from gazerig.robot.description import head_mesh, person_shape
from gazerig.robot.description.mesh import (
    Mesh,
    Painted,
    cap,
    merge_meshes,
    mirror_mesh,
    mix,
    move_mesh,
    paint,
    smooth_normals,
    uniform_colours,
)
from gazerig.robot.description.texture import TexturedMesh, add_texture

SHAPES: dict[str, Callable[[], Painted]] = {
    "eye": head_mesh.eye,
    "lid": lambda: head_mesh.eyelid(False),
    "other brow": lambda: mirror_mesh(head_mesh.brow()),
    "skin": lambda: head_mesh.skin().head,
    "jaw": lambda: head_mesh.skin().jaw,
    "person": lambda: person_shape.head(1, 0.6),
    "torso": lambda: person_shape.torso(2, 0.4),
    "glow": lambda: glow_disc((20, 24, 34, 140), 10),
}


def _seen(mesh: TexturedMesh, uv: Floats) -> Floats:
    """Return the image's colours at points (n, 2), interpolated between texels as engines do."""
    rows, columns = mesh.image.shape[:2]
    x = uv[:, 0] * columns - 0.5
    y = uv[:, 1] * rows - 0.5
    left, top = np.floor(x + 1e-9).astype(int), np.floor(y + 1e-9).astype(int)
    a, b = (x - left)[:, None], (y - top)[:, None]
    image = mesh.image.astype(float)
    right, below = np.minimum(left + 1, columns - 1), np.minimum(top + 1, rows - 1)
    above = image[top, left] * (1 - a) + image[top, right] * a
    return (1 - b) * above + b * (image[below, left] * (1 - a) + image[below, right] * a)


def _corners(vertices: Floats, faces: np.ndarray, values: Floats) -> np.ndarray:
    """Return places and values of the corners of all triangles, in an order of their own."""
    rows = np.concatenate((vertices[faces], values[faces]), axis=-1).reshape(len(faces), -1)
    return rows[np.lexsort(np.round(rows, 6).T[::-1])]


@pytest.mark.parametrize("shape", SHAPES)
def test_every_corner_has_its_place_colour_and_normal(shape: str) -> None:
    one = SHAPES[shape]()
    mesh = add_texture(one)
    assert mesh.uv.min() > 0.0 and mesh.uv.max() < 1.0
    assert len(mesh.faces) == len(one.mesh.faces)
    out = smooth_normals(one.mesh) if one.normals is None else one.normals
    # The ends of a lid are points, whose faces have no size and no normal.
    out = np.where(np.linalg.norm(out, axis=1, keepdims=True) > 0.0, out, (0.0, 0.0, 1.0))
    before = _corners(one.mesh.vertices, one.mesh.faces, np.concatenate((out, one.colours), axis=1))
    now = np.concatenate((mesh.normals, _seen(mesh, mesh.uv)), axis=1)
    after = _corners(mesh.vertices, mesh.faces, now)
    width = 9 + one.colours.shape[1] - 3
    assert np.allclose(before.reshape(-1, width)[:, :6], after.reshape(-1, width)[:, :6], atol=1e-9)
    assert np.abs(before.reshape(-1, width)[:, 6:] - after.reshape(-1, width)[:, 6:]).max() < 0.51


@pytest.mark.parametrize("shape", ["eye", "skin", "person"])
def test_the_middle_of_a_triangle_is_between_its_corners(shape: str) -> None:
    one = SHAPES[shape]()
    mesh = add_texture(one)
    corners = _seen(mesh, mesh.uv)[mesh.faces]
    middle = _seen(mesh, mesh.uv[mesh.faces].mean(axis=1))
    # A grid is interpolated between four corners, of which a triangle has three.
    least, most = corners.min(axis=1), corners.max(axis=1)
    off = np.maximum(least - middle, middle - most).max(axis=1)
    assert np.mean(off > 2.0) < 0.03


def test_a_plain_mesh_needs_no_more_than_a_few_texels() -> None:
    mesh = add_texture(paint(cap(0.1, 1.0), (10, 20, 30)))
    assert mesh.image.shape[0] * mesh.image.shape[1] <= 36
    assert (mesh.image == (10, 20, 30)).all()


def test_parts_do_not_bleed_into_each_other() -> None:
    ball = cap(0.1, 3.0)
    red = Painted(
        ball, mix(uniform_colours(ball, (255, 0, 0)), (200, 0, 0), ball.vertices[:, 2] * 10)
    )
    blue = red._replace(colours=red.colours[:, ::-1])
    both = merge_meshes([one._replace(normals=smooth_normals(ball)) for one in (red, blue)])
    image = add_texture(both).image.astype(int)
    # Half a texel outside the vertices every colour is still the part's own.
    assert not ((image[..., 0] > 0) & (image[..., 2] > 0)).any()
    assert (image.sum(axis=-1) > 0).mean() > 0.5


@settings(max_examples=40, deadline=None)
@given(st.integers(1, 60), st.integers(0, 10**6))
def test_any_triangles_keep_their_colours(count: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vertices = rng.uniform(-1.0, 1.0, (count + 2, 3))
    faces = np.stack([rng.permutation(count + 2)[:3] for _ in range(count)]).astype(np.uint32)
    colours = np.rint(rng.uniform(0.0, 255.0, (count + 2, 3)))
    one = Painted(Mesh(vertices, faces), colours, np.tile((0.0, 0.0, 1.0), (count + 2, 1)))
    mesh = add_texture(move_mesh(one, (0.0, 0.0, 0.0)))
    before = _corners(vertices, faces, colours)
    after = _corners(mesh.vertices, mesh.faces, _seen(mesh, mesh.uv))
    assert np.allclose(before, after, atol=0.51)
