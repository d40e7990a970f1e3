"""Marked places of a joint behind a push rod, made into its linkage and range."""

from dataclasses import replace
from math import radians

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gazerig.config.schema import load_rig
from gazerig.features.bringup.calibration.joint_calibration import CalibrationRefused, changes
from gazerig.features.bringup.calibration.linkage_calibration import (
    angle_now,
    between,
    likely_angle,
    places,
)
from gazerig.robot.model.joint import JointParams

MAKER = load_rig("maker")
PAN, LID = MAKER.joints["eyes_pan"], MAKER.joints["left_lower_lid"]


@given(
    left=st.floats(6.0, 60.0),
    right=st.floats(6.0, 60.0),
    zero=st.integers(1200, 1800),
    reach=st.integers(100, 600),
    rising=st.booleans(),
    margin=st.floats(0.0, 3.0),
)
def test_the_range_lies_inside_what_was_marked(
    left: float, right: float, zero: int, reach: int, rising: bool, margin: float
) -> None:
    way = reach if rising else -reach
    marked = [(0.0, float(zero)), (left, float(zero + way)), (-right, float(zero - way))]
    made = places("eyes_pan", marked, PAN, margin)
    assert [at for _, at in made.transmission_points] == sorted(
        (at for _, at in marked), reverse=not rising
    )
    assert -right - 0.051 + margin <= made.min_deg < 0.0 < made.max_deg <= left + 0.051 - margin
    assert made.max_deg >= left - margin - 0.151 and made.min_deg <= margin - right + 0.151
    joint = replace(PAN, **made._asdict())
    assert joint.steps(0.0) == zero * 4
    assert joint.made().rising == rising


def test_a_lid_ends_where_it_was_marked_and_its_keys_are_its_own() -> None:
    made = places("left_lower_lid", [(20.0, 1250.0), (-9.0, 1600.0), (5.0, 1450.0)], LID, 2.0)
    assert (made.min_deg, made.max_deg) == (-9.0, 20.0)
    wanted = changes("left_lower_lid", LID, made, {"left_lower_lid": -12.0})
    assert wanted == {
        "joints.left_lower_lid.transmission_points": ((-9, 1600), (5, 1450), (20, 1250)),
        "joints.left_lower_lid.min_deg": -9.0,
        "joints.left_lower_lid.max_deg": 20.0,
        "lid_joints.left_lower_shut_deg": -9.0,
        "lid_joints.left_lower_open_deg": 20.0,
        "park_deg.left_lower_lid": -9.0,
    }


@pytest.mark.parametrize(
    ("name", "marked", "says"),
    [
        ("eyes_pan", [(0.0, 1500.0), (1.5, 1600.0), (-20.0, 1300.0)], "0 deg must lie within"),
        ("left_lower_lid", [(20.0, 1250.0), (3.0, 1600.0)], "call half open 0"),
        ("eyes_pan", [(0.0, 1500.0), (4.0, 1600.0), (-4.0, 1300.0)], "only 4.0 deg"),
        ("eyes_pan", [(0.0, 1500.0), (20.0, 1450.0), (-20.0, 1300.0)], "all rise or all fall"),
        ("eyes_pan", [(0.0, 1500.0), (0.0, 1700.0), (-20.0, 1300.0)], "must lie within|must rise"),
        ("eyes_pan", [(0.0, 1500.0), (20.0, 2900.0), (-20.0, 1300.0)], "outside the servo's"),
    ],
)
def test_what_makes_no_linkage_is_refused_with_the_rule(
    name: str, marked: list[tuple[float, float]], says: str
) -> None:
    with pytest.raises(CalibrationRefused, match=says):
        places(name, marked, MAKER.joints[name], 2.0)


def test_proposals_keep_the_shape_of_the_curve_and_meet_the_marks() -> None:
    assert angle_now(PAN, 1500.0) == 0.0 and angle_now(PAN, 1776.0) == 20.0
    one, other = (0.0, 1500.0), (40.0, 1776.0)
    assert likely_angle(PAN, 1500.0, one, other) == 0.0
    assert likely_angle(PAN, 1776.0, one, other) == 40.0
    # What was 10 deg of 20 is 20 of 40 now.
    assert likely_angle(PAN, 1634.0, one, other) == pytest.approx(20.0, abs=0.1)
    assert likely_angle(PAN, 1634.0, (0.0, 1776.0), (-40.0, 1500.0)) == pytest.approx(-20, abs=0.1)


def test_places_between_are_evenly_spread() -> None:
    assert between(1500.0, 1800.0, 2) == [1600.0, 1700.0]
    assert between(1800.0, 1500.0, 0) == []


def test_a_smart_servo_behind_a_push_rod_is_measured_in_steps() -> None:
    smart = JointParams(
        1, "sts3215", -20.0, 20.0, 300.0, 20000.0, transmission_points=((-25, 1800), (25, 2300))
    )
    made = places("eyes_pan", [(0.0, 2050.0), (22.0, 2300.0), (-21.0, 1790.0)], smart, 1.0)
    joint = replace(smart, **made._asdict())
    assert joint.steps(radians(-21.0)) == pytest.approx(1790.0)
    assert (made.min_deg, made.max_deg) == (-20.0, 21.0)
