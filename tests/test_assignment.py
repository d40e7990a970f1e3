"""Pairs with the least total cost, against every other pairing."""

from itertools import permutations
from math import inf

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gazerig.robot.model.tracker_params import TrackerParams
from gazerig.robot.perception import data_association
from gazerig.robot.perception.data_association import (
    FORBIDDEN,
    DetectionRow,
    TrackRow,
    assign,
    pair_costs,
)

PRICES = st.sampled_from([0.0, 1.0, 2.5, 7.0, FORBIDDEN])
COSTS = st.tuples(st.integers(1, 4), st.integers(1, 4)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=PRICES)
)


def cheapest(costs: np.ndarray) -> tuple[int, float]:
    """Try all pairings: the highest possible number of pairs at the least cost."""
    if costs.shape[0] > costs.shape[1]:
        costs = costs.T
    ways = []
    for columns in permutations(range(costs.shape[1]), costs.shape[0]):
        kept = [costs[i, j] for i, j in enumerate(columns) if costs[i, j] < FORBIDDEN]
        ways.append((-len(kept), sum(kept)))
    pairs, cost = min(ways)
    return -pairs, cost


@given(COSTS)
def test_as_many_as_can_be_for_the_least(costs: np.ndarray) -> None:
    pairs = assign(costs.tolist())
    most, least = cheapest(costs)
    assert len(pairs) == most
    assert sum(costs[i, j] for i, j in pairs) == least
    assert len({i for i, _ in pairs}) == len({j for _, j in pairs}) == len(pairs)


def test_nobody_and_nothing_are_no_pairs() -> None:
    assert assign(np.zeros((0, 3)).tolist()) == assign(np.zeros((2, 0)).tolist()) == []
    assert assign([]) == []
    assert assign(np.full((2, 2), FORBIDDEN).tolist()) == []


ANY_COSTS = st.tuples(st.integers(1, 12), st.integers(1, 12)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.floats(-50.0, 50.0))
)


@given(ANY_COSTS)
def test_as_cheap_as_the_solver_of_scipy(costs: np.ndarray) -> None:
    from scipy.optimize import linear_sum_assignment

    pairs = assign(costs.tolist())
    rows, columns = linear_sum_assignment(costs)
    assert len(pairs) == len(rows) and pairs == sorted(pairs)
    ours = sum(costs[i, j] for i, j in pairs)
    assert abs(ours - costs[rows, columns].sum()) < 1e-9


def test_the_very_pairs_of_scipy_where_no_two_ways_cost_the_same() -> None:
    from scipy.optimize import linear_sum_assignment

    dice = np.random.default_rng(3)
    for _ in range(200):
        costs = dice.normal(0.0, 10.0, dice.integers(1, 9, 2))
        costs[dice.random(costs.shape) < 0.3] = FORBIDDEN
        rows, columns = linear_sum_assignment(costs)
        pairs = zip(rows.tolist(), columns.tolist(), strict=True)
        assert assign(costs.tolist()) == [(i, j) for i, j in pairs if costs[i, j] < FORBIDDEN]


def test_a_cost_that_is_no_number_is_a_pair_that_cannot_be() -> None:
    assert assign(np.array([[np.nan, 1.0], [2.0, np.inf]]).tolist()) == [(0, 1), (1, 0)]
    assert assign(np.array([[np.nan]]).tolist()) == []


def test_a_pair_too_many_is_not_made_at_the_cost_of_others() -> None:
    """A new person next to one at the expected place, and another one who is hidden."""
    costs = [[0.0, 28.0], [28.0, FORBIDDEN]]
    assert assign(costs) == [(0, 1), (1, 0)]
    assert assign(costs, unpaired=30.0) == [(0, 0)]
    assert assign([[28.0]], unpaired=30.0) == [(0, 0)]


def a_direction(rng: np.random.Generator) -> tuple[float, float, float]:
    """Return a direction near straight ahead."""
    v = np.array([1.0, *rng.normal(0.0, 0.08, 2)])
    x, y, z = (v / np.linalg.norm(v)).tolist()
    return x, y, z


def a_track(rng: np.random.Generator) -> TrackRow:
    """Return any track."""
    kind, mark, (across_m2, along_m2) = rng.integers(2), rng.integers(-1, 2), rng.uniform(-6, 0, 2)
    return TrackRow(
        int(kind), int(mark), *a_direction(rng), rng.uniform(1.0, 2.0), 10.0**across_m2,
        10.0**along_m2, rng.uniform(0.02, 0.4), rng.uniform(0.8, 1.2),
        rng.choice([0.0, 0.2, 1.5]), bool(rng.integers(2)), rng.choice([0.0, 0.5]),
        rng.choice([0.1, inf]), rng.choice([1e-3, inf]), bool(rng.integers(2)),
    )  # fmt: skip


def a_detection(rng: np.random.Generator) -> DetectionRow:
    """Return any detection."""
    kind, mark, (across_m, along_m) = rng.integers(2), rng.integers(-1, 2), rng.uniform(-5, 0, 2)
    return DetectionRow(
        int(kind), int(mark), *a_direction(rng), rng.uniform(1.0, 2.0), 10.0**across_m,
        10.0**along_m, rng.uniform(0.02, 0.4), int(rng.integers(2)),
    )  # fmt: skip


def test_pairs_cost_the_same_one_by_one_and_all_at_once() -> None:
    rng = np.random.default_rng(0)
    possible = 0
    for _ in range(400):
        tracks = [a_track(rng) for _ in range(rng.integers(1, 6))]
        found = [a_detection(rng) for _ in range(rng.integers(1, 6))]
        few = pair_costs(tracks, found, TrackerParams())
        many = data_association._all_pairs(tracks, found, TrackerParams(), None)
        np.testing.assert_allclose(few, many, rtol=1e-12, atol=1e-12)
        possible += sum(cost < FORBIDDEN for row in few for cost in row)
    assert possible > 500


def test_a_pair_among_many_costs_what_it_costs_alone() -> None:
    rng = np.random.default_rng(5)
    tracks, found = [], []
    for k in range(9):
        y = 0.05 * k + 0.02 * rng.random()
        tracks.append(TrackRow(k % 2, -1, 1.0, y, 0.0, 2.0, 1e-4, 1e-2, 0.1, 1.0, 0.0, False))
        found.append(DetectionRow(k % 2, -1, 1.0, y + 0.01, 0.0, 2.1, 0.01, 0.1, 0.1, 1))
    many = pair_costs(tracks, found, TrackerParams())
    alone = [[pair_costs([t], [d], TrackerParams())[0][0] for d in found] for t in tracks]
    np.testing.assert_allclose(many, alone, rtol=1e-12)
    assert 9 < sum(cost < FORBIDDEN for row in alone for cost in row) < 81
