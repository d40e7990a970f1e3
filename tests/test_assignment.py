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
    pairs = assign(costs)
    most, least = cheapest(costs)
    assert len(pairs) == most
    assert sum(costs[i, j] for i, j in pairs) == least
    assert len({i for i, _ in pairs}) == len({j for _, j in pairs}) == len(pairs)


def test_nobody_and_nothing_are_no_pairs() -> None:
    assert assign(np.zeros((0, 3))) == assign(np.zeros((2, 0))) == []
    assert assign(np.zeros((0,))) == []
    assert assign(np.full((2, 2), FORBIDDEN)) == []
