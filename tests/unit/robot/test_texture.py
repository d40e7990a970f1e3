"""Colours of vertices as a texture: the same triangles in the same colours."""

from collections.abc import Callable

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

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
    at = uv[:, ::-1].T * np.reshape(mesh.image.shape[:2], (2, 1)) - 0.5
    channels = np.moveaxis(mesh.image.astype(float), -1, 0)
    return np.stack([map_coordinates(one, at, order=1, mode="nearest") for one in channels], -1)


@pytest.mark.parametrize("shape", SHAPES)
def test_every_corner_has_its_place_colour_and_normal(shape):
    one = SHAPES[shape]()
    mesh = add_texture(one)
    assert mesh.uv.min() > 0.0 and mesh.uv.max() < 1.0
    assert len(mesh.faces) == len(one.mesh.faces)
    corners = one.mesh.faces.reshape(-1)
    assert (mesh.faces.reshape(-1) == np.arange(len(corners))).all()
    assert (mesh.vertices == one.mesh.vertices[corners]).all()
    assert (mesh.normals == one.normals[corners]).all()
    assert np.abs(_seen(mesh, mesh.uv) - one.colours[corners]).max() < 0.51
