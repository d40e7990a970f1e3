"""Meshes cut along a line on their surface, and the jaw that is cut out of a head so."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.robot.description.mesh import Painted, ellipsoid, merge_meshes, paint
from gazerig.robot.description.solid import cut_mesh

BALL = paint(ellipsoid((0.3, 0.5, 0.4)), (200, 100, 50))


def _area_vector_and_area(one: Painted) -> tuple[np.ndarray, float]:
    """Return what the faces' areas add up to as vectors, and as numbers."""
    a, b, c = (one.mesh.vertices[one.mesh.faces[:, i]] for i in range(3))
    across = 0.5 * np.cross(b - a, c - a)
    return across.sum(axis=0), float(np.linalg.norm(across, axis=1).sum())


@given(st.floats(-0.45, 0.45), st.integers(0, 2))
@settings(deadline=None, max_examples=60)
def test_the_two_parts_of_a_cut_are_the_whole(at: float, axis: int) -> None:
    within, rest = cut_mesh(BALL, BALL.mesh.vertices[:, axis] - at)
    whole, parts = _area_vector_and_area(BALL), _area_vector_and_area(merge_meshes([within, rest]))
    # The same surface, with the same rotation.
    assert np.allclose(whole[0], parts[0], atol=1e-12)
    assert parts[1] == pytest.approx(whole[1], rel=1e-9)
    assert (within.mesh.vertices[:, axis] <= at + 1e-12).all()
    assert (rest.mesh.vertices[:, axis] >= at - 1e-12).all()
    for part in (within, rest):
        assert np.allclose(np.linalg.norm(np.asarray(part.normals), axis=1), 1.0)
