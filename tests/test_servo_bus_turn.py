"""The turn of a position of an STS servo."""

from hypothesis import given
from hypothesis import strategies as st

from gazerig.drivers.servo_bus.feedback import nearest_turn as nearest

STEPS = st.integers(-40000, 40000)
RANGE = st.tuples(st.integers(0, 4095), st.integers(0, 4095)).map(lambda pair: tuple(sorted(pair)))


def nearest_turn(steps, low, high):
    return nearest(steps, low, high, 4096)


def away(steps, low, high):
    return max(low - steps, steps - high, 0)


@given(STEPS, RANGE)
def test_it_is_the_same_place_and_none_is_nearer(steps, span):
    turned = nearest_turn(steps, *span)
    assert (turned - steps) % 4096 == 0
    assert away(turned, *span) <= min(away(turned - 4096, *span), away(turned + 4096, *span))


@given(STEPS, RANGE)
def test_inside_the_range_nothing_changes(steps, span):
    low, high = span
    inside = low + steps % (high - low + 1)
    assert nearest_turn(inside, low, high) == inside


def test_by_hand():
    assert nearest_turn(4090, 100, 1500) == -6
    assert nearest_turn(-6, 100, 1500) == -6
    assert nearest_turn(3200, 1000, 3000) == 3200
    assert nearest_turn(5000, 0, 4095) == 904
    assert nearest_turn(20, 100, 1500) == 20
