"""Colours of vertices as a texture: the same triangles in the same colours."""

from collections.abc import Callable

import numpy as np
import pytest

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import Painted, move_mesh, stored_shape
from gazerig.robot.description.people import head, torso
from gazerig.robot.description.texture import TexturedMesh, add_texture

SHAPES: dict[str, Callable[[], Painted]] = {
    "eye": lambda: stored_shape("eye"),
    "other brow": lambda: move_mesh(stored_shape("brow"), scale=(1.0, -1.0, 1.0)),
    "person": lambda: head(1),
    "torso": lambda: torso(2, 0.4),
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
    around = np.concatenate((vertices[faces], values[faces]), axis=-1)
    # From the corner with the least numbers, as a triangle may begin at any.
    keys = np.round(around[..., :6], 6).tolist()
    first = np.array([key.index(min(key)) for key in keys])
    turns = (first[:, None] + np.arange(3)) % 3
    rows = np.take_along_axis(around, turns[..., None], axis=1).reshape(len(faces), -1)
    return rows[np.lexsort(np.round(rows, 6).T[::-1])]


@pytest.mark.parametrize("shape", SHAPES)
def test_every_corner_has_its_place_colour_and_normal(shape: str) -> None:
    one = SHAPES[shape]()
    mesh = add_texture(one)
    assert mesh.uv.min() > 0.0 and mesh.uv.max() < 1.0
    assert len(mesh.faces) == len(one.mesh.faces)
    out = one.normals
    before = _corners(one.mesh.vertices, one.mesh.faces, np.concatenate((out, one.colours), axis=1))
    now = np.concatenate((mesh.normals, _seen(mesh, mesh.uv)), axis=1)
    after = _corners(mesh.vertices, mesh.faces, now)
    width = 9 + one.colours.shape[1] - 3
    assert np.allclose(before.reshape(-1, width)[:, :6], after.reshape(-1, width)[:, :6], atol=1e-9)
    assert np.abs(before.reshape(-1, width)[:, 6:] - after.reshape(-1, width)[:, 6:]).max() < 0.51
