"""The order of conditions for each participant, balanced over the participants.

Williams' squares (E. J. Williams, "Experimental designs balanced for the estimation of residual
effects of treatments", Australian Journal of Scientific Research A 2, 1949, 149-168): with an even
number n of conditions, n orders in which each condition is at each position once and follows each
other condition once; with an odd number, 2n orders in which it does so twice.
"""

from functools import cache
from itertools import combinations

import numpy as np

from gazerig.features.study.design import StudyDesign

PAIR = "|"
"""Separator of the first and the second presentation of a pair."""
_ORDERS, _PRACTICE = 0, 1
"""Random streams of one seed."""


def williams(n: int) -> tuple[tuple[int, ...], ...]:
    """Return Williams' orders of ``n`` conditions 0..n-1: n of them if n is even, else 2n.

    Raises:
        ValueError: ``n`` is below 1.
    """
    if n < 1:
        raise ValueError(f"{n} conditions; at least one is needed")
    # 0, 1, n-1, 2, n-2, ...: neighbours differ by every number except 0, each once if n is even.
    first = [0] + [(i + 1) // 2 if i % 2 else n - i // 2 for i in range(1, n)]
    square = [tuple((one + row) % n for one in first) for row in range(n)]
    mirrored = [row[::-1] for row in square] if n % 2 and n > 1 else []
    return (*square, *mirrored)


def balanced_group_size(design: StudyDesign) -> int:
    """Return the number of participants that use every order once; 1 for random orders.

    Multiples of this number of participants are fully balanced.
    """
    return len(_table(design)) if design.trials.order == "williams" else 1


def block_trials(design: StudyDesign) -> tuple[str, ...]:
    """Return the trials of one block: the conditions, or their pairs as "a|b"."""
    keys = tuple(design.conditions)
    if design.task == "rating":
        return keys
    return tuple(f"{a}{PAIR}{b}" for a, b in combinations(keys, 2))


def participant_order(design: StudyDesign, participant: int) -> tuple[str, ...]:
    """Return the trials of a participant in order, each a condition key or a pair "a|b".

    Each repetition is a separate block with another order of the same balanced set. The last
    condition of a block differs from the first of the next one if possible.

    Args:
        design: a checked design.
        participant: from 1; it selects the row of the table, or the random order.

    Raises:
        ValueError: the number is below 1.
    """
    if participant < 1:
        raise ValueError(f"participant {participant}: participants are counted from 1")
    repetitions = design.trials.repetitions
    if design.trials.order == "random":  # consecutive trials differ if there are two
        rng = np.random.default_rng((design.trials.seed, participant, _ORDERS))
        there, out = block_trials(design), list[str]()
        for _ in range(repetitions):
            block = [there[i] for i in rng.permutation(len(there))]
            if out and len(block) > 1 and _show_same(block[0], out[-1]):
                at = int(rng.integers(1, len(block)))
                block[0], block[at] = block[at], block[0]
            out += [_orient_pair(one, bool(rng.integers(2))) for one in block]
        return tuple(out)
    table = _table(design)
    step = _step(table)
    chosen = (table[(participant - 1 + k * step) % len(table)] for k in range(repetitions))
    return tuple(one for row in chosen for one in row)


def practice_trials(design: StudyDesign, participant: int) -> tuple[str, ...]:
    """Return the practice trials of a participant, drawn at random; they do not count."""
    rng = np.random.default_rng((design.trials.seed, participant, _PRACTICE))
    drawn = rng.permutation(len(block_trials(design)))
    return tuple(
        _orient_pair(block_trials(design)[drawn[i % len(drawn)]], bool(rng.integers(2)))
        for i in range(design.trials.practice)
    )


def _table(design: StudyDesign) -> tuple[tuple[str, ...], ...]:
    """Return the orders that are assigned to participants cyclically, as trials.

    The seed assigns conditions to the squares. Pairs are ordered as conditions are; over the table
    each is seen in both orders equally often, at every position.
    """
    there = block_trials(design)
    letters = np.random.default_rng((design.trials.seed, 0, _ORDERS)).permutation(len(there))
    squares = [tuple(int(letters[one]) for one in row) for row in williams(len(there))]
    if design.task == "rating":
        return tuple(tuple(there[one] for one in row) for row in squares)
    if len(squares) == len(there):  # of an even number, or one pair: the square again, reversed
        squares = 2 * squares
    return tuple(
        tuple(_orient_pair(there[one], bool((number // len(there) + one) % 2)) for one in row)
        for number, row in enumerate(squares)
    )


@cache
def _step(table: tuple[tuple[str, ...], ...]) -> int:
    """Return the offset of rows between a participant's blocks."""
    n = len(table)
    if len(table[0]) == 1:  # one pair: the other order
        return 1
    for step in range(1, n):
        if all(not _show_same(table[i][-1], table[(i + step) % n][0]) for i in range(n)):
            return step
    return 0


def _show_same(one: str, other: str) -> bool:
    """Return whether two trials show the same conditions, in either order."""
    return set(one.split(PAIR)) == set(other.split(PAIR))


def _orient_pair(trial: str, turned: bool) -> str:
    """Return a pair in the other order if ``turned``; a condition is returned unchanged."""
    return PAIR.join(reversed(trial.split(PAIR))) if turned else trial
