"""Servo steps to joint angles and back, straight and through measured places."""

from math import isclose, radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.robot.model.joint import JointParams, Linkage

ROD = [[-30.0, 1900.0], [-10.0, 1640.0], [0.0, 1500.0], [15.0, 1350.0], [30.0, 1100.0]]


@st.composite
def curves(draw: st.DrawFn) -> Linkage:
    n = draw(st.integers(2, 8))
    gaps = draw(st.lists(st.floats(0.02, 0.5), min_size=n, max_size=n))
    climbs = draw(st.lists(st.floats(5.0, 400.0), min_size=n, max_size=n))
    way = draw(st.sampled_from((1.0, -1.0)))
    angles, places = [draw(st.floats(-1.5, 0.0))], [6000.0]
    for gap, climb in zip(gaps[1:], climbs[1:], strict=True):
        angles.append(angles[-1] + gap)
        places.append(places[-1] + way * climb)
    return Linkage(angles, places)


@given(curves(), st.floats(-2.0, 2.0))
def test_there_and_back_is_where_one_was(curve, angle_rad):
    assert curve.angle_rad(curve.steps(angle_rad)) == pytest.approx(angle_rad, abs=1e-9)


@given(curves(), st.floats(-2.0, 2.0), st.floats(1e-4, 0.2))
def test_a_larger_angle_is_farther_on_the_same_way(curve, angle_rad, more):
    climb = curve.steps(angle_rad + more) - curve.steps(angle_rad)
    assert (climb > 0.0) == curve.rising
    assert abs(climb) <= curve.steepest * more * (1.0 + 1e-6)


@given(curves(), st.floats(-2.0, 2.0))
def test_the_rate_is_the_slope_of_the_angle(curve, angle_rad):
    steps = curve.steps(angle_rad)
    rate = curve.rate_rad(steps)
    tiny = 1e-5 / abs(rate) * 1e-3
    near = [curve.angle_rad(steps + s * tiny) for s in (-1, 1)]
    slopes = [(near[1] - curve.angle_rad(steps)) / tiny, (curve.angle_rad(steps) - near[0]) / tiny]
    # At a measured place the slopes before and behind differ: it is one of the two.
    assert any(isclose(rate, slope, rel_tol=1e-3) for slope in slopes)


def test_measured_places_are_met_and_lines_lie_between():
    curve = Linkage([radians(a) for a, _ in ROD], [4.0 * us for _, us in ROD])
    for angle, us in ROD:
        assert curve.steps(radians(angle)) == pytest.approx(4.0 * us)
    assert curve.steps(radians(7.5)) == pytest.approx(4.0 * 1425.0)
    assert curve.steps(radians(36.0)) == pytest.approx(4.0 * 1000.0)  # the last line goes on
    assert not curve.rising


@pytest.mark.parametrize(
    ("angles", "steps", "words"),
    [
        ([0.0], [1.0], "at least two points"),
        ([0.0, 0.0], [1.0, 2.0], "angles of a linkage must increase; point 2"),
        ([0.0, 0.1, 0.2], [1.0, 2.0, 1.5], "all increase or all decrease; point 3"),
        ([0.0, 0.1], [1.0, 1.0], "all increase or all decrease"),
    ],
)
def test_places_that_cannot_be_are_refused(angles, steps, words):
    with pytest.raises(ValueError, match=words):
        Linkage(angles, steps)


def hobby(**other: object) -> JointParams:
    given = {"transmission_points": tuple((a, us) for a, us in ROD), **other}
    return JointParams(3, "hobby", -28.0, 28.0, 400.0, 20000.0, **given)  # type: ignore[arg-type]


def test_a_hobby_joint_is_set_up_in_quarter_microseconds():
    setup = hobby(servo_speed_deg_s=600.0).setup("eyes_pan", radians(10.0))
    made = hobby().make_linkage()
    assert (setup.min_steps, setup.max_steps) == (
        -(-made.steps(radians(28.0)) // 1),
        made.steps(radians(-28.0)) // 1,
    )
    assert setup.rest_steps == round(made.steps(radians(10.0)))
    assert setup.max_speed_steps_s == pytest.approx(radians(400.0) * made.steepest)
    assert setup.max_accel_steps_s2 == pytest.approx(radians(20000.0) * made.steepest)


@pytest.mark.parametrize(
    ("other", "words"),
    [
        ({"transmission_points": ((-20.0, 1900.0), (20.0, 1100.0))}, "measured from -20 to 20 deg"),
        (
            {"transmission_points": ((-30.0, 1900.0), (30.0, 400.0))},
            "400|outside the servo's 500..2500 us",
        ),
        ({"transmission_points": (), "zero_step": 2400}, "outside the servo's 500..2500 us"),
    ],
)
def test_a_joint_beyond_its_servo_or_its_measuring_is_refused(other, words):
    with pytest.raises(ValueError, match=words):
        hobby(**other)


def test_the_shipped_rods_give_every_joint_its_whole_range(maker_rig):
    for name, joint in maker_rig.joints.items():
        setup = joint.setup(name, 0.0)
        assert setup.max_steps - setup.min_steps > 4 * 250, name
        assert 2000 <= setup.min_steps < setup.max_steps <= 10000, name
        assert joint.servo_speed_deg_s is not None
        own = joint.servo_speed_deg_s / 90.0 * 4000.0
        # What the joint may do at its steepest is near what its servo can, so that it is seldom
        # behind its pulse for long.
        assert setup.max_speed_steps_s < 1.25 * own, name
