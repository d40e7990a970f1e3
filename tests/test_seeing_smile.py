"""A smile is read as a smile: row 6 in its short form (check E86)."""

import pytest
from seeing.row_06_smile import WANTED, measure


@pytest.fixture(scope="module")
def figures() -> dict[str, float]:
    return measure(full=False)


@pytest.mark.parametrize("name", WANTED)
def test_e86_a_smile_is_no_nod(figures: dict[str, float], name: str) -> None:
    low, high = WANTED[name]
    assert low <= figures[name] <= high
