"""The order in which workers take the test files: long ones early, and not all at once.

Workers take file after file. One that began a long file last would go on alone, and where all wait
for other processes at the same time, nobody computes.
"""

from collections.abc import Sequence
from itertools import zip_longest

import pytest

LONG = {"browser", "own_timeouts", "pty", "slow"}
"""Marks of what takes long; most of it waits for other processes."""


def spread(items: Sequence[pytest.Item]) -> list[pytest.Item]:
    """Have every other file be a long one until there are none; the order is kept otherwise."""
    files: dict[str, list[pytest.Item]] = {}
    for item in items:
        files.setdefault(item.location[0], []).append(item)
    long = [file for file in files.values() if any(map(_takes_long, file))]
    short = [file for file in files.values() if not any(map(_takes_long, file))]
    nothing: list[pytest.Item] = []
    turns = zip_longest(long, short, fillvalue=nothing)
    return [item for turn in turns for file in turn for item in file]


def _takes_long(item: pytest.Item) -> bool:
    return any(mark.name in LONG for mark in item.iter_markers())
