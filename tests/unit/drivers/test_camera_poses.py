"""Orientations written by one process are there for another, at any time between two of them."""

import multiprocessing
from math import cos, radians, sin

import numpy as np
import pytest

from gazerig.drivers.camera.shared_slots import PoseBuffer


def turn(deg: float) -> np.ndarray:
    """Turn about the vertical axis of the picture."""
    c, s = cos(radians(deg)), sin(radians(deg))
    return np.array([[c, 0.0, s], [0.0, 1.0, 0.0], [-s, 0.0, c]])


def filled(count: int, rate_deg_s: float = 100.0) -> PoseBuffer:
    ring = PoseBuffer()
    for k in range(count):
        ring.record(10.0 + k * 0.005, turn(rate_deg_s * k * 0.005).tolist())
    return ring


@pytest.mark.parametrize("t_s", [10.0, 10.005, 10.0125, 10.1, 10.195])
def test_orientation_between_ticks(t_s):
    found = filled(40).rotation_at(t_s)
    assert found == pytest.approx(turn(100.0 * (t_s - 10.0)), abs=1e-6)
    assert np.linalg.det(found) == pytest.approx(1.0)


def test_only_times_that_are_remembered_have_an_answer():
    ring = filled(3000)
    newest_s = 10.0 + 2999 * 0.005
    assert ring.rotation_at(newest_s + 0.03) == pytest.approx(turn(100.0 * 2999 * 0.005))
    assert ring.rotation_at(newest_s + 0.1) is None
    assert ring.rotation_at(newest_s - 2.4) is not None
    assert ring.rotation_at(newest_s - 2.6) is None
    assert ring.rotation_at(10.0) is None


def test_another_process_shares_it():
    ring = filled(40)
    context = multiprocessing.get_context("spawn")
    other = context.Process(target=ring.record, args=(10.3, turn(42.0)))
    other.start()
    other.join()
    assert ring.rotation_at(10.3) == pytest.approx(turn(42.0), abs=1e-6)
    assert ring.rotation_at(10.05) == pytest.approx(turn(5.0), abs=1e-6)
