"""Rows of seeing about faces, in their short form: how far, how hard to see, how large."""

from types import ModuleType

from seeing import row_03_far_faces, row_05_finding_and_placing, row_10_full_hd


def as_wanted(row: ModuleType) -> None:
    figures = row.measure(False)
    assert figures
    for name, value in figures.items():
        low, high = row.WANTED[name]
        assert low <= value <= high, f"{name}: {value}"


def test_e83_faces_are_found_far_away_and_in_crowds() -> None:
    as_wanted(row_03_far_faces)


def test_e85_hard_faces_are_found_and_all_are_placed_truly() -> None:
    as_wanted(row_05_finding_and_placing)


def test_e90_a_large_frame_is_not_converted() -> None:
    as_wanted(row_10_full_hd)
