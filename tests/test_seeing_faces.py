"""Rows of seeing about faces, in their short form: how far, how hard to see, how large."""

import pytest
from seeing import row_03_far_faces, row_05_finding_and_placing, row_10_full_hd


@pytest.mark.parametrize("row", [row_03_far_faces, row_05_finding_and_placing, row_10_full_hd])
def test_the_row_is_as_wanted(row) -> None:
    figures = row.measure(False)
    assert figures
    for name, value in figures.items():
        low, high = row.WANTED[name]
        assert low <= value <= high, f"{name}: {value}"
