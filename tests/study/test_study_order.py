"""Orders of trials: each condition in each place, after each other one, as often as all others."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from itertools import permutations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.features.study.design import Condition, StudyDesign, Trials
from gazerig.features.study.order import (
    PAIR,
    balanced_group_size,
    block_trials,
    orders,
    practice,
    williams,
)


def design_of(n: int, **trials: object) -> StudyDesign:
    conditions: Mapping[str, Condition] = {f"c{i}": Condition() for i in range(n)}
    return StudyDesign("t", conditions, ("q",), trials=Trials(**trials))  # type: ignore[arg-type]


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_williams_balances_places_and_what_comes_before(n: int) -> None:
    table = williams(n)
    assert len(table) == (n if n % 2 == 0 else 2 * n)
    places = Counter((i, one) for row in table for i, one in enumerate(row))
    assert set(places.values()) == {len(table) // n} and len(places) == n * n
    follows = Counter(pair for row in table for pair in zip(row, row[1:], strict=False))
    assert set(follows) == set(permutations(range(n), 2))
    assert set(follows.values()) == {1 if n % 2 == 0 else 2}


def test_the_squares_of_four_are_those_of_williams_construction() -> None:
    assert williams(4) == ((0, 1, 3, 2), (1, 2, 0, 3), (2, 3, 1, 0), (3, 0, 2, 1))
    assert williams(1) == ((0,),)
    with pytest.raises(ValueError, match="at least one"):
        williams(0)


@given(st.integers(2, 6), st.integers(1, 4), st.integers(0, 2**31 - 1), st.sampled_from([1, 2, 3]))
@settings(deadline=None, max_examples=60)
def test_multiples_of_the_rows_are_balanced_to_the_last_cell(
    n: int, repetitions: int, seed: int, times: int
) -> None:
    design = design_of(n, repetitions=repetitions, seed=seed)
    every = [orders(design, p) for p in range(1, times * balanced_group_size(design) + 1)]
    for k in range(repetitions):
        blocks = [order[k * n : (k + 1) * n] for order in every]
        assert all(sorted(block) == sorted(design.conditions) for block in blocks)
        places = Counter((i, one) for block in blocks for i, one in enumerate(block))
        follows = Counter(p for block in blocks for p in zip(block, block[1:], strict=False))
        assert len(set(places.values())) == 1 and len(places) == n * n
        assert len(set(follows.values())) == 1 and len(follows) == n * (n - 1)


@pytest.mark.parametrize("n", [3, 4, 5, 6])
def test_no_condition_is_shown_twice_in_a_row_across_blocks(n: int) -> None:
    for order in ("williams", "random"):
        design = design_of(n, repetitions=4, order=order)
        for participant in range(1, 30):
            trials = orders(design, participant)
            assert all(a != b for a, b in zip(trials, trials[1:], strict=False))


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_pairs_are_seen_both_ways_round_equally_often_in_every_place(n: int) -> None:
    design = replace(design_of(n), task="pairwise")
    assert balanced_group_size(design) == n * (n - 1)
    every = [orders(design, p) for p in range(1, balanced_group_size(design) + 1)]
    cells = Counter((i, one) for order in every for i, one in enumerate(order))
    pairs = len(block_trials(design))
    assert len(cells) == pairs * pairs * 2 and set(cells.values()) == {1}
    for order in every:
        unordered = [frozenset(one.split(PAIR)) for one in order]
        assert len(set(unordered)) == pairs
    if n > 2:  # nobody could learn that the first is always the same one
        assert all(len({one in block_trials(design) for one in order}) == 2 for order in every)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_repeated_pairs_stay_balanced_and_one_pair_is_turned(n: int) -> None:
    design = replace(design_of(n, repetitions=3), task="pairwise")
    every = [orders(design, p) for p in range(1, balanced_group_size(design) + 1)]
    pairs = len(block_trials(design))
    for k in range(3):
        cells = Counter((i, o[k * pairs + i]) for o in every for i in range(pairs))
        assert set(cells.values()) == {1} and len(cells) == 2 * pairs * pairs
    for order in every:
        for one, two in zip(order, order[1:], strict=False):
            assert one != two and (n == 2 or set(one.split(PAIR)) != set(two.split(PAIR)))


def test_the_participant_and_the_seed_decide_and_nothing_else() -> None:
    design = design_of(5, order="random", seed=4)
    assert orders(design, 3) == orders(design, 3)
    assert len({orders(design, p) for p in range(1, 40)}) > 20
    assert orders(design_of(5, order="random", seed=5), 3) != orders(design, 3)
    assert balanced_group_size(design) == 1
    squares = {orders(design_of(4, seed=seed), 1) for seed in range(30)}
    assert len(squares) > 5, "which condition has which letter is drawn by the seed"
    with pytest.raises(ValueError, match="counted from 1"):
        orders(design, 0)


def test_practice_shows_what_counts_later_and_is_not_the_first_trial_for_all() -> None:
    design = design_of(3, practice=5)
    drawn = practice(design, 1)
    assert len(drawn) == 5 and set(drawn) == set(design.conditions)
    assert drawn == practice(design, 1)
    assert len({practice(design, p)[0] for p in range(1, 20)}) == 3
    assert practice(design_of(3, practice=0), 1) == ()
