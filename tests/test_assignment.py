"""Pairs that cost least together, against every other way of pairing."""

from itertools import permutations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from gazerig.robot.perception.data_association import FORBIDDEN, assign

PRICES = st.sampled_from([0.0, 1.0, 2.5, 7.0, FORBIDDEN])
COSTS = st.tuples(st.integers(1, 4), st.integers(1, 4)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=PRICES)
)


def cheapest(costs: np.ndarray) -> tuple[int, float]:
    """Try all pairings: the most pairs that can be, and the least that so many cost."""
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
    """Somebody new beside one who is seen where expected, and another who is hidden."""
    costs = [[0.0, 28.0], [28.0, FORBIDDEN]]
    assert assign(costs) == [(0, 1), (1, 0)]
    assert assign(costs, unpaired=30.0) == [(0, 0)]
    assert assign([[28.0]], unpaired=30.0) == [(0, 0)]
