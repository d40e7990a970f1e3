"""Range of what has no measured depth, and what perception costs a picture."""

import pytest
from seeing import row_01_range as row
from seeing import row_04_perception_cost as cost


@pytest.mark.parametrize("swings", [False, True])
@pytest.mark.parametrize("noise_deg", row.NOISES_DEG)
def test_e81_range_stays_as_assumed_whatever_the_direction_does(
    noise_deg: float, swings: bool
) -> None:
    ratios = row.still_thing(noise_deg, swings, 150, seed=1)
    assert ratios.min() >= 0.95 and ratios.max() <= 1.05


def test_e81_walkers_are_not_at_the_nose_and_the_gaze_is_not_beside_the_picture() -> None:
    figures = row.believed(8.0, seed=1).figures()
    assert figures["walkers: things a picture"] > 4.0
    for name, (low, high) in row.WANTED.items():
        if name in figures:
            assert low <= figures[name] <= high, name


def test_e84_twenty_people_cost_less_than_twenty_times_one() -> None:
    """Counted, not timed: pairs of all with all are judged in one expression of arrays."""
    counts = {}
    for people in cost.PEOPLE:
        see, poses = cost.perception()
        counts[people] = [cost.calls(see, poses, found) for found in cost.crowd(people, 12)][-1]
    assert counts[20] < 20 * counts[1]
    assert counts[6] < 6 * counts[1]
    # Of which each takes a share of a microsecond.
    assert counts[1] < 400 and counts[20] < 4000
