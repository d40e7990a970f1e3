"""Several standing people, seen by the whole robot: no one is left out."""

import pytest
from attention_scene import NO_STAYS
from seeing import row_08_several_people as row

from gazerig.gaze.attention.habituation import Habituation, HabituationParams


def sharing() -> Habituation:
    return Habituation(HabituationParams(), NO_STAYS)


@pytest.mark.usefixtures("ideal_servos")
def test_e88_everybody_of_six_is_looked_at_again_and_again() -> None:
    figures = row.figures("six alike", [1.6] * 6, seconds=32.0, seeds=1)
    for name, value in figures.items():
        if name in row.WANTED:
            low, high = row.WANTED[name]
            assert low <= value <= high, name


@pytest.mark.usefixtures("ideal_servos")
def test_e88_of_people_unlike_the_nearer_get_more_and_nobody_nothing() -> None:
    figures = row.figures("six unlike", row.UNLIKE_M, seconds=64.0, seeds=1)
    assert figures["six unlike: longest time without a look, s"] < 15.0
    assert figures["six unlike: correlation of share and salience"] > 0.7


def test_surpluses_grow_with_the_looks_and_are_those_over_the_one_looked_at_least() -> None:
    shared, three = sharing(), dict.fromkeys((1, 2, 3), 1.0)
    assert shared.surpluses(three, -1, 0.0) == {1: 0.0, 2: 0.0, 3: 0.0}
    assert shared.surpluses(three, 2, 0.5) == pytest.approx({1: 0.0, 2: 0.5, 3: 0.0})
    # A new person is behind no one; the heaviest of similar ones comes first.
    assert shared.surpluses({2: 0.5, 4: 1.0}, 4, 0.5)[4] == 0.0
    found = shared.surpluses({1: 1.0, 2: 0.5, 4: 1.0}, 1, 0.9)
    assert found[4] == 0.0 and found[1] == pytest.approx(0.4) and 0.45 < found[2] < 0.5


def test_a_look_at_a_body_of_half_the_weight_counts_twice() -> None:
    shared, two = sharing(), {1: 1.0, 2: 0.5}
    shared.surpluses(two, -1, 0.0)
    shared.surpluses(two, 1, 1.0)
    assert shared.surpluses(two, 2, 1.5)[1] == pytest.approx(0.0, abs=0.1)


def test_surpluses_are_bounded_fade_and_are_forgotten() -> None:
    shared, three = sharing(), dict.fromkeys((1, 2, 3), 1.0)
    for k in range(100):
        found = shared.surpluses(three, 1, 0.5 * k)
    assert found == {1: 8.0, 2: 0.0, 3: 0.0}
    assert 0.0 < shared.surpluses(three, -1, 60.0)[1] < 3.0
    shared.reset(60.0)
    assert shared.surpluses(three, -1, 60.0) == {1: 0.0, 2: 0.0, 3: 0.0}
