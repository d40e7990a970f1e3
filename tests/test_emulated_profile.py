"""The profile generator: shapes, new goals in motion."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.sim_mock.smart_servo.profile import (
    RECTANGLE,
    STEP,
    TRAPEZOID,
    TRIANGLE,
    PositionProfile,
)


def path(made: PositionProfile, most: int = 200_000, stride: int = 1) -> list[float]:
    """Return all positions until the profile is done, or up to a stride more."""
    out = [made.r]
    while made.running:
        out += made.advance(stride)
        assert len(out) < most
    return out


def speeds(positions: list[float]) -> list[float]:
    return [b - a for a, b in zip(positions, positions[1:], strict=False)]


@pytest.mark.parametrize(
    ("cruise", "ramp", "kind", "ms"),
    [
        (0.0, 0.5, STEP, 1),  # no velocity: the acceleration does not count
        (2.0, 0.0, RECTANGLE, 500),
        (2.0, 0.01, TRAPEZOID, 700),
        (50.0, 0.01, TRIANGLE, 633),
    ],
)
def test_the_shapes_of_the_manual(cruise, ramp, kind, ms):
    made = PositionProfile(0.0)
    made.plan_by_velocity(1000.0, cruise, ramp)
    assert made.kind == kind
    positions = path(made)
    assert positions[-1] == 1000.0 and made.v == 0.0
    assert len(positions) - 1 == ms
    if kind:
        assert max(speeds(positions)) <= cruise + 1e-9


FLOATS = st.floats(-5000, 5000)


@given(FLOATS, FLOATS, st.integers(0, 400), st.floats(0.2, 20), st.floats(0.001, 1.0))
@settings(max_examples=100, deadline=None)
def test_a_new_goal_starts_from_the_present_speed_and_keeps_to_the_limits(
    first, second, after, cruise, ramp
):
    made = PositionProfile(0.0)
    made.plan_by_velocity(first, cruise, ramp)
    positions = [0.0, *made.advance(after + 1)]
    made.plan_by_velocity(second, cruise, ramp)
    positions += path(made, stride=100)[1:]
    assert positions[-1] == second
    v = speeds(positions)
    assert max(abs(x) for x in v) <= cruise + 1e-6
    # Average speeds of neighbouring milliseconds differ by one ramp, two where phases meet.
    changes = [abs(b - a) for a, b in zip([0.0, *v], [*v, 0.0], strict=False)]
    assert max(changes) <= 2.0 * ramp + 1e-6
