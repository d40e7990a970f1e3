"""Pairs with the least total cost, against every other pairing."""

import numpy as np

from gazerig.robot.perception.data_association import FORBIDDEN, assign


def test_nobody_and_nothing_are_no_pairs():
    assert assign(np.zeros((0, 3)).tolist()) == assign(np.zeros((2, 0)).tolist()) == []
    assert assign(np.full((2, 2), FORBIDDEN).tolist()) == []


def test_the_very_pairs_of_scipy_where_no_two_ways_cost_the_same():
    from scipy.optimize import linear_sum_assignment

    dice = np.random.default_rng(3)
    for _ in range(200):
        costs = dice.normal(0.0, 10.0, dice.integers(1, 9, 2))
        costs[dice.random(costs.shape) < 0.3] = FORBIDDEN
        rows, columns = linear_sum_assignment(costs)
        pairs = zip(rows.tolist(), columns.tolist(), strict=True)
        assert assign(costs.tolist()) == [(i, j) for i, j in pairs if costs[i, j] < FORBIDDEN]


def test_a_cost_that_is_no_number_is_a_pair_that_cannot_be():
    assert assign(np.array([[np.nan, 1.0], [2.0, np.inf]]).tolist()) == [(0, 1), (1, 0)]


def test_a_pair_too_many_is_not_made_at_the_cost_of_others():
    """A new person next to one at the expected place, and another one who is hidden."""
    costs = [[0.0, 28.0], [28.0, FORBIDDEN]]
    assert assign(costs) == [(0, 1), (1, 0)]
    assert assign(costs, unpaired=30.0) == [(0, 0)]
    assert assign([[28.0]], unpaired=30.0) == [(0, 0)]
