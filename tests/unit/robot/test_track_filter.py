"""One step of the filter of a track, and its place and velocity while it is not seen."""

from typing import Any

import pytest
from text_table import rows

from gazerig.gaze.types import Vec3
from gazerig.robot.perception.kalman import (
    NEAREST_M,
    ProcessNoise,
    TrackFilter,
    Variances,
    view_and_range,
)

FINE = 0.002, 0.002
CAMERA = (-2.0, 0.0, 0.0)
DT_S = 1.0 / 30.0


def walking() -> TrackFilter:
    """Follow a person at 1.8 m/s for a second."""
    track = TrackFilter((0.0, 0.0, 0.0), CAMERA, FINE, 0.7, ProcessNoise(0.12, 10.0))
    for k in range(1, 31):
        track.predict(DT_S)
        track.correct((0.0, 1.8 * k * DT_S, 0.0), *FINE)
    return track


def walked(unseen_pictures: int, stops_after: int) -> TrackFilter:
    """Follow a walking person who is then unseen, stops meanwhile, and is seen again."""
    track = walking()
    assert track.v_m_s[1] == pytest.approx(1.8, abs=0.05)
    for k in range(unseen_pictures):
        track.predict(DT_S, seen=k == 0)
    track.correct((0.0, 1.8 * (30 + stops_after) * DT_S, 0.0), *FINE)
    return track


@pytest.mark.parametrize("unseen", [4, 6, 8])
def test_who_stopped_while_out_of_sight_is_not_said_to_rush_back(unseen):
    """The way it did not go is no sudden speed of the last picture alone."""
    track = walked(unseen, stops_after=1)
    assert abs(track.v_m_s[1]) < 1.8
    assert track.p_m[1] == pytest.approx(1.8 * 31 * DT_S, abs=0.01)


def test_who_went_on_out_of_sight_is_as_fast_as_before():
    assert walked(5, stops_after=5).v_m_s[1] == pytest.approx(1.8, abs=0.4)


# Single steps, computed by hand


ORIGIN: Vec3 = (0.0, 0.0, 0.0)
KNOWN = Variances(4.0, 2.0, 3.0)


def test_a_measurement_has_its_gains_and_what_remains_uncertain():
    assert KNOWN.measured(0, 4.0) == (0.5, 0.25, Variances(2.0, 1.0, 2.5))
    assert KNOWN.measured(1, 5.0) == (0.25, 0.375, Variances(3.5, 1.25, 1.875))
    assert KNOWN.after(0.5, 0.5) == Variances(6.75, 1.75, 0.75)
    assert KNOWN.with_noise(2.0, 0.5) == pytest.approx((4.0 + 0.05 / 3.0, 2.05, 3.2))


STEPS = """
# What is done with a track 2 m ahead; the quiet noise and the velocity before; position, velocity
# and both variances after it.
# A seen thing goes on; the noise is that of 1 m/s2, or 0.5 m/s2 if it is quieter.
predict:0.5:1
    1 1 2 1 | 2.5 1 0.5 | 1 2 1
    6.75417 3.5125 3.05 | 6.75417 3.5125 3.05
predict:0.5:1:1:1
    0.5 1 2 1 | 2.5 1 0.5 | 1 2 1
    6.75104 3.50312 3.0125 | 6.75104 3.50312 3.0125
# An unseen one slows down by exp(-0.5) and keeps its height if it is level.
predict:0.5:0
    0.5 1 2 1 | 2.5 1 0.5 | 0.606531 1.21306 0.606531
    6.75417 2.13536 1.15364 | 6.75417 2.13536 1.15364
predict:0.5:0:1:1
    2 1 2 1 | 2.5 1 0 | 0.606531 1.21306 0
    6.76667 2.17286 1.30364 | 6.76667 2.17286 1.30364
predict:0:0
    1 1 2 1 | 2 0 0 | 1 2 1
    4 2 3 | 4 2 3
# Of unknown range: 0.3 rad to the side, velocity turned; or exp(0.5) farther, all grown.
predict:1:1:0
    1 0 0.6 0 | 1.91067 0.59104 0 | -0.177312 0.573202 0
    11.0333 5.05 3.1 | 11.0333 5.05 3.1
predict:1:1:0
    1 1 0 0 | 3.29744 0 0 | 1.64872 0 0
    29.9344 13.6414 8.25484 | 29.9344 13.6414 8.25484
predict:1:1:0
    1 0.5 0 -0.6 | 2.45335 0 -0.758911 | 0.385665 0 -0.925733
    18.1693 8.29361 5.04616 | 18.1693 8.29361 5.04616
# No change of the range beyond exp(3), none below 0.05 m.
predict:1:1:0
    1 99 0 0 | 40.1711 0 0 | 1988.47 0 0
    4437.75 2017.19 1210.39 | 4437.75 2017.19 1210.39
predict:1:1:0
    1 -99 0 0 | 0.0995741 0 0 | -4.92892 0 0
    0.0605996 0.0623938 0.107436 | 0.0605996 0.0623938 0.107436
predict:1:1:0 predict:1:1:0
    1 -99 0 0 | 0.05 0 0 | -2.475 0 0
    0.107167 0.0928214 0.127089 | 0.107167 0.0928214 0.127089
predict:1
    1 -1.99 0 0 | 0.05 0 0 | -1.99 0 0
    11.0333 5.05 3.1 | 11.0333 5.05 3.1
predict:1
    1 -9 0.02 0 | 0.05 0 0 | -9 0.02 0
    11.0333 5.05 3.1 | 11.0333 5.05 3.1
predict:1
    1 -1.99 0.06 0 | 0.01 0.06 0 | -1.99 0.06 0
    11.0333 5.05 3.1 | 11.0333 5.05 3.1
predict:1
    1 -1.94 0.01 0 | 0.06 0.01 0 | -1.94 0.01 0
    11.0333 5.05 3.1 | 11.0333 5.05 3.1
predict:1
    1 -3 0.06 0 | -1 0.06 0 | -3 0.06 0
    11.0333 5.05 3.1 | 11.0333 5.05 3.1
# Half of 1 m deeper by log range, and a quarter as speed; half of 0.3 and 2.5 rad to the side.
correct:3.297442541:0:0:9:3.297442541
    1 0 0 0 | 2.56805 0 0 | 0.321006 0 0
    5.81438 2.90719 4.75104 | 3.29744 1.64872 4.1218
correct:1.910672978:-0.591040413:0:2:2
    1 0 0 0 | 1.97754 -0.298876 0 | -0.0224157 -0.148316 0
    2 1 2.5 | 2 1 2.5
correct:-3.204574462:0:2.393888576:4:1e6
    1 0 0 0 | 0.630645 0 1.89797 | -1.18623 0 0.394153
    2 1 2.5 | 4 2 3
# Surprises after 1 s raise the noise to 1, 2, 4, 8 or 10 m/s2, and less if it may be covered.
predict:1 known:0.01:0:0.01 correct:1.960133156:0.397338662:0:0.1:0.1 predict:0.5
    1 0 0 0 | 1.99001 0.199667 0 | 0 0 0
    0.0116667 0.0175 0.06 | 0.0116667 0.0175 0.06
predict:1 known:0.01:0:0.01 correct:1.910672978:0.591040413:0:0.1:0.1 predict:0.5
    1 0 0 0 | 1.82302 0.904003 0 | -0.20366 0.721819 0
    0.0564583 0.08625 0.1725 | 0.0564583 0.08625 0.1725
predict:1 known:0.01:0:0.01 correct:1.842121988:0.778836685:0:0.1:0.1 predict:0.5
    1 0 0 0 | 1.62749 1.29774 0 | -0.44114 1.06619 0
    0.14032 0.255625 0.536538 | 0.14032 0.255625 0.536538
predict:1 known:0.01:0:0.01 correct:1.319966292:1.502560810:0:0.1:0.1 predict:0.5
    1 0 0 0 | 0.380484 2.33459 0 | -1.89099 1.67467 0
    0.468295 0.937914 2.06265 | 0.468295 0.937914 2.06265
predict:1 known:0.01:0:0.01 correct:0.141474403:1.994989973:0:0.1:0.1 predict:0.5
    1 0 0 0 | -2.07962 2.16261 0 | -4.46021 0.336555 0
    0.713701 1.44894 3.20641 | 0.713701 1.44894 3.20641
predict:1 known:0.01:0:0.01 covered correct:1.942675950:0.475405253:0:0.1:0.1 predict:0.5
    1 0 0 0 | 1.98683 0.229161 0 | 0 0 0
    0.011882 0.0175 0.06 | 0.0165686 0.0175 0.06
predict:1 known:0.01:0:0.01 covered correct:1.910672978:-0.591040413:0:0.1:0.1 predict:0.5
    1 0 0 0 | 1.82562 -0.897581 0 | -0.200677 -0.716858 0
    0.0585815 0.0879715 0.173896 | 0.311109 0.292723 0.339911
predict:1 known:0.01:0:0.01 covered correct:1.960133156:0.397338662:0:0.1:0.1 predict:0.5
    1 0 0 0 | 1.99001 0.199667 0 | 0 0 0
    0.0116667 0.0175 0.06 | 0.0116667 0.0175 0.06
predict:0.5 predict:0.5 known:0.01:0:0.01 correct:1.910672978:0.591040413:0:0.1:0.1
    1 0 0 0 | 1.92485 0.543094 0 | -0.20366 0.721819 0
    0.00916667 0.0125 0.1225 | 0.00916667 0.0125 0.1225
# A velocity at 4 m counts half at 2 m; gains of 1/4 and 3/8 across, 1/8 and 3/16 along.
velocity:4:0:0:2:1:0:4.472135955:7.211102551
    1 0.5 0.1 0 | 2.06091 0.103131 0 | 0.598941 0.288231 0
    3.72573 1.33062 1.99593 | 3.99185 1.7298 2.5947
velocity:0:3:0:0:2:1:3:3
    1 0.5 0.1 0 | 2.24241 -0.0321338 0.214225 | 0.931347 0.0508076 0.412231
    4.35027 1.45009 2.17514 | 4.35027 1.45009 2.17514
# Seen from an eighth of a turn aside, both variances mix; from the same place nothing changes.
along:5:6:7 look:1:-1:0 correct:2:0:0:2:9
    1 1 2 3 | 2 0 0 | 1 2 3
    2.06061 1.45454 2.90909 | 4.26316 3.78947 4.81287
look:0:0:0
    1 1 2 3 | 2 0 0 | 1 2 3
    4 2 3 | 4 2 3
slow:2.5
    1 3 4 0 | 2 0 0 | 1.5 2 0
    4 2 3 | 4 2 3
slow:5
    1 3 4 0 | 2 0 0 | 3 4 0
    4 2 3 | 4 2 3
"""


def done(one: TrackFilter, action: str) -> None:
    name, *words = action.split(":")
    n: Any = list(map(float, words))
    match name:
        case "predict":
            one.predict(n[0], *map(bool, n[1:]))
        case "known":
            one.across = one.along = Variances(*n)
        case "along":
            one.along = Variances(*n)
        case "covered":
            one.is_covered = True
        case "correct":
            one.correct(tuple(n[:3]), *n[3:])
        case "velocity":
            one.correct_velocity(tuple(n[:3]), tuple(n[3:6]), *n[6:])
        case "look":
            one.look_from(tuple(n))
        case "slow":
            one.slow_to(*n)


LINES = rows(STEPS)


@pytest.mark.parametrize("k", range(0, len(LINES), 3))
def test_one_step(k):
    actions, (quiet, *v), after = LINES[k], LINES[k + 1][:4], LINES[k + 1][4:] + LINES[k + 2]
    one = TrackFilter((2.0, 0.0, 0.0), ORIGIN, (0.1, 0.5), 2.0, ProcessNoise(quiet, 10.0))
    assert (one.view, one.range_m, one.v_m_s) == ((1.0, 0.0, 0.0), 2.0, ORIGIN)
    assert (*one.across, *one.along) == pytest.approx((0.01, 0.0, 4.0, 0.25, 0.0, 4.0))
    one.v_m_s, one.across, one.along = (v[0], v[1], v[2]), KNOWN, KNOWN
    for action in actions:
        done(one, action)
    assert (*one.p_m, *one.v_m_s, *one.across, *one.along) == pytest.approx(
        tuple(after), rel=1e-5, abs=1e-6
    )


def test_a_direction_and_a_least_distance_are_those_of_every_place():
    assert view_and_range((1.0, 2.0, 3.0), (1.0, 2.0, 3.0)) == ((1.0, 0.0, 0.0), NEAREST_M)
    assert view_and_range((1.0, 2.0, 5.0), (0.0, 0.0, 3.0)) == ((1 / 3, 2 / 3, 2 / 3), 3.0)
    view, range_m = view_and_range((1.0, 2.01, 3.0), (1.0, 2.0, 3.0))
    assert view == pytest.approx((0.0, 1.0, 0.0)) and range_m == NEAREST_M
