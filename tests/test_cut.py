"""Meshes cut along a line on their surface, and the jaw that is cut out of a head so."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.robot.description import head_mesh
from gazerig.robot.description.head_shape import JAW_BOUNDS, JAW_HALF
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


def test_what_is_on_one_side_stays_whole() -> None:
    everything, nothing = cut_mesh(BALL, np.full(len(BALL.mesh.vertices), -1.0))
    assert np.array_equal(everything.mesh.vertices, BALL.mesh.vertices)
    assert np.array_equal(everything.mesh.faces, BALL.mesh.faces)
    assert not len(nothing.mesh.faces)


def test_colours_on_the_edge_are_in_between() -> None:
    height = BALL.mesh.vertices[:, 2]
    shaded = BALL._replace(colours=np.stack([100.0 + 100.0 * height] * 3, axis=1))
    within, _ = cut_mesh(shaded, height - 0.123)
    edge = np.isclose(within.mesh.vertices[:, 2], 0.123)
    assert edge.sum() > 10
    assert np.allclose(within.colours[edge], 112.3)


def test_a_jaw_slides_between_the_cheeks() -> None:
    jaw, head = head_mesh.skin().jaw.mesh, head_mesh.skin().head.mesh
    aside = np.abs(jaw.vertices[:, 1])
    # Plane sides, from the mouth to below the chin; nothing of the jaw is beyond them.
    assert aside.max() < JAW_HALF + 1e-9
    side = jaw.vertices[np.isclose(jaw.vertices[:, 1], JAW_HALF)]
    assert len(side) > 12 and np.ptp(side[:, 2]) > 0.5
    assert jaw.vertices[:, 2].max() < -0.75
    # The head's skin has its edges there too: nothing of it is below the mouth between them.
    bounds = np.stack([bound(head.vertices) for bound in JAW_BOUNDS])
    front = head.vertices[:, 0] > -0.3
    assert bounds.max(axis=0)[front].min() > -0.12  # the upper lip ends on the line


def test_the_walls_beside_a_jaw_face_each_other() -> None:
    cheeks = head_mesh.skin().cheeks
    left = cheeks.mesh.vertices[:, 1] > 0.0
    out = np.asarray(cheeks.normals)[:, 1]
    assert np.allclose(out[left], -1.0) and np.allclose(out[~left], 1.0)
