"""Row 12 of seeing in a short form: on film, the gaze is on the face that is there."""

import pytest
from seeing.material import at_hand, carphone
from seeing.row_12_balance import OUTSIDE, SIGNERS, WANTED, film


def test_a_man_who_talks_is_looked_at() -> None:
    share = film(carphone(), 4.0)
    assert share.there > 0.8 * share.ticks
    low, high = WANTED["talks in a car, % on the face"]
    assert low <= share.percent <= high
    assert share.outside_percent <= WANTED[OUTSIDE][1]


def test_a_person_who_signs_is_looked_at() -> None:
    path = at_hand(SIGNERS[2])
    if path is None:
        pytest.skip(f"no film {SIGNERS[2]} beside the project")
    share = film(path, 6.0)
    low, high = WANTED[f"{SIGNERS[2]}, % on the face"]
    assert share.there > 0.8 * share.ticks and low <= share.percent <= high
    assert share.outside_percent <= WANTED[OUTSIDE][1]
