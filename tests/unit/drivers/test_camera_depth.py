"""Distances come out of depth pictures with holes, edges, zeros and nonsense."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gazerig.drivers.camera.depth_roi import depth_at, resize_depth, to_metres, to_millimetres

BOX = (20.0, 10.0, 40.0, 40.0)


def scene(thing_m: float = 1.2, wall_m: float = 3.0) -> np.ndarray:
    """A round thing in the box before a wall, with noise of a centimetre."""
    y, x = np.mgrid[0:60, 0:80]
    depth = np.where((x - 40) ** 2 + (y - 30) ** 2 < 18**2, thing_m, wall_m)
    return (depth + np.random.default_rng(0).normal(0.0, 0.01, depth.shape)).astype(np.float32)


def test_distance_and_spread_of_a_whole_thing():
    found = depth_at(scene(), BOX)
    assert found.distance_m == pytest.approx(1.2, abs=0.003)
    assert found.spread_m == pytest.approx(0.01, abs=0.002)
    assert found.valid_share == pytest.approx(1.0, abs=0.05)


@pytest.mark.parametrize("hole", [np.nan, 0.0, np.inf, -1.0])
def test_holes_do_not_count(hole):
    depth = scene()
    depth[np.random.default_rng(1).random(depth.shape) < 0.6] = hole
    found = depth_at(depth, BOX)
    assert found.distance_m == pytest.approx(1.2, abs=0.005)
    assert found.valid_share == pytest.approx(0.4, abs=0.06)


@settings(max_examples=100, deadline=None)
@given(
    arrays(
        np.float32, st.tuples(st.integers(1, 8), st.integers(1, 8)), elements=st.floats(width=32)
    ),
    st.tuples(*[st.floats(-20.0, 20.0)] * 4),
)
def test_whatever_the_picture_the_answer_is_a_distance_in_it_or_none(depth, box):
    found = depth_at(depth, box)
    if found.distance_m is not None:
        low, high = depth[np.isfinite(depth)].min(), depth[np.isfinite(depth)].max()
        assert low <= found.distance_m <= high
    assert 0.0 <= found.valid_share <= 1.0
    assert np.isfinite(found.spread_m)


def test_millimetres_are_whole_and_0_is_unknown():
    metres = np.array([np.nan, -1.0, 0.0004, 0.001, 1.2346, 65.535, 65.536, np.inf], np.float32)
    found = to_millimetres(metres)
    assert found.tolist() == [0, 0, 0, 1, 1235, 65535, 0, 0]
    assert to_metres(found)[2:5] == pytest.approx([np.nan, 0.001, 1.235], nan_ok=True)


def test_resizing_invents_no_distance():
    depth = np.array([[1.0, 3.0], [np.nan, 3.0]], np.float32)
    big = resize_depth(depth, 8, 4)
    assert big.shape == (4, 8)
    assert set(big[np.isfinite(big)].tolist()) == {1.0, 3.0}
    assert np.isnan(big).sum() == 8
    assert resize_depth(depth, 2, 2) is depth
