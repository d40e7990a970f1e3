"""Colours of vertices as a texture: the same triangles in the same colours."""

from collections.abc import Callable

import numpy as np
import pytest

from gazerig.gaze.types import Floats
from gazerig.robot.description.mesh import (
    Painted,
    TexturedMesh,
    add_texture,
    move_mesh,
    stored_shape,
)
from gazerig.robot.description.people import head, torso

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


@pytest.mark.parametrize("shape", SHAPES)
def test_every_corner_has_its_place_colour_and_normal(shape: str):
    one = SHAPES[shape]()
    mesh = add_texture(one)
    assert mesh.uv.min() > 0.0 and mesh.uv.max() < 1.0
    assert len(mesh.faces) == len(one.mesh.faces)
    corners = one.mesh.faces.reshape(-1)
    assert (mesh.faces.reshape(-1) == np.arange(len(corners))).all()
    assert (mesh.vertices == one.mesh.vertices[corners]).all()
    assert (mesh.normals == one.normals[corners]).all()
    assert np.abs(_seen(mesh, mesh.uv) - one.colours[corners]).max() < 0.51
