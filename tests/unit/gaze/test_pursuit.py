"""Following in gaze space: a point in the world after another, seen from one eye centre."""

from math import atan2, degrees, exp, radians

import numpy as np
import pytest

from gazerig.gaze.angles import add, direction, scale
from gazerig.gaze.oculomotor.binocular import MAX_RAD_S
from gazerig.gaze.oculomotor.pursuit import Pursuit, PursuitParams, line_of_sight_to
from gazerig.gaze.types import Vec3

DT = 0.005
EYE = (0.0, 0.0, 0.0)
STILL = (0.0, 0.0, 0.0)


def point(yaw_deg, distance=1.0):
    return scale(direction((radians(yaw_deg), 0.0)), distance)


def circling(yaw_deg, speed_deg_s) -> tuple[Vec3, Vec3]:
    """Return a point on a circle of 1 m and its velocity."""
    place = point(yaw_deg)
    return place, scale((-place[1], place[0], 0.0), radians(speed_deg_s))


def step(
    gaze, target, v, eye=EYE, dt=DT, closing=True,
    known=True,
):  # fmt: skip
    """Return the gaze point a tick later."""
    sights = line_of_sight_to(gaze, eye), line_of_sight_to(target, eye)
    return Pursuit(PursuitParams()).follow(*sights, target, v, eye, dt, closing, known)


def test_a_point_is_seen_in_a_direction_and_no_nearer_than_5_cm():
    eye = (1.0, 2.0, 3.0)
    for place, sight in (
        ((3.0, 4.0, 0.0), (0.6, 0.8, 0.0, 0.2)), ((0.0, 0.0, -0.5), (0.0, 0.0, -1.0, 2.0)),
        ((0.0, 0.0, 0.02), (0.0, 0.0, 1.0, 20.0)), (EYE, (1.0, 0.0, 0.0, 20.0)),
    ):  # fmt: skip
        assert line_of_sight_to(add(place, eye), eye) == pytest.approx(sight)


def test_slip_is_what_pursuit_does_not_adopt():
    """Of a target 2 m above the eye, whose approach is no slip."""
    eye, pursuit = (1.0, 2.0, 3.0), Pursuit(PursuitParams())
    for speed, known, slip in (
        (0.1, True, 0.005), (0.4, False, 0.02), (1.0, False, 1.0 - 0.95 * radians(28.0)),
        (1.5, True, 1.5 - 0.95 * radians(58.0)), (2.0, True, 2.0),
    ):  # fmt: skip
        v = (2.0 * speed, 0.0, 0.7)
        seen = pursuit.slip((2.0, 2.0, 3.0), (1.0, 2.0, 5.0), v, eye, known)
        assert seen.error_rad == pytest.approx((-1.0, 0.0, 1.0))
        assert seen.slip_rad_s == pytest.approx((slip, 0.0, 0.0))


@pytest.mark.parametrize(
    ("closing", "near", "rate"), [(False, 0.5, 4.0), (True, 0.5, 4.0), (True, 0.8, 3.0)]
)
def test_e26_direction_adopts_motion_and_closes_an_error_and_depth_by_itself(closing, near, rate):
    """Depth is closed by nearness, more slowly outwards, whatever the direction does."""
    eye, v, now = (np.array(one) for one in ((1.0, 2.0, 3.0), (0.1, -0.3, 0.4), (0.8, 0.9, 1.1)))
    then = now - v * DT
    far, far_then = np.linalg.norm(now), np.linalg.norm(then)
    start = then / far_then + (0.02, 0.01, -0.03)
    start /= np.linalg.norm(start)
    way = start + 0.95 * (now / far - then / far_then)
    way += closing * (1.0 - exp(-8.0 * DT)) * (then / far_then - start)
    nearer = near + 1.0 / far - 1.0 / far_then
    nearer += (1.0 / far_then - near) * (1.0 - exp(-rate * DT))
    moved = step(tuple(eye + start / near), tuple(eye + now), tuple(v), tuple(eye), closing=closing)
    assert moved == pytest.approx(tuple(eye + way / np.linalg.norm(way) / nearer), abs=1e-9)


def yaw(p):
    return degrees(atan2(p[1], p[0]))


def follow(speed_deg_s, seconds, dt=DT):
    """Return the speed and the lag behind a circling target at the end, in degrees."""
    gaze, before = point(0.0), 0.0
    for k in range(1, round(seconds / dt) + 1):
        before = yaw(gaze)
        gaze = step(gaze, *circling(speed_deg_s * k * dt, speed_deg_s), dt=dt)
    return (yaw(gaze) - before) / dt, speed_deg_s * seconds - yaw(gaze)


def test_following_and_closing_together_are_no_faster_than_people():
    most = degrees(MAX_RAD_S)
    gaze = step(point(0.0), *circling(5.0, most))
    assert yaw(gaze) / DT == pytest.approx(most, rel=5e-3)


@pytest.mark.parametrize("speed", [10.0, 20.0, 30.0, 50.0])
@pytest.mark.parametrize("dt", [0.010, 0.005, 0.002])
def test_ramp_is_followed_at_its_speed_with_the_lag_of_the_gains(speed, dt):
    now, lag = follow(speed, 2.0, dt)
    assert now == pytest.approx(speed, rel=0.02)
    # (1 - Gp) / Kc, and one period in which the rest is closed.
    assert lag == pytest.approx(speed * 0.05 / 8.0, abs=0.05 * speed * dt + 0.01)


def test_error_of_direction_closes_at_its_rate_and_no_faster_than_five_degrees_do():
    gaze = point(-1.0)
    for _ in range(25):
        gaze = step(gaze, point(0.0), STILL, EYE, DT)
    assert yaw(gaze) == pytest.approx(-exp(-8.0 * 0.125), abs=0.01)
    far = step(point(-30.0), point(0.0), STILL, EYE, DT)
    assert (yaw(far) + 30.0) / DT <= 40.0


def test_a_still_target_is_held_whatever_the_eye_centre_does():
    gaze = point(20.0, 0.5)
    for k in range(200):
        eye = (0.0, 0.05 * float(np.sin(0.1 * k)), 0.0)
        gaze = step(gaze, point(20.0, 0.5), STILL, eye, DT)
        assert gaze == pytest.approx(point(20.0, 0.5), abs=1e-9)


def catch_up(speed_deg_s, behind_deg, known):
    """Return the speed of a gaze that is behind a circling target; degrees."""
    gaze = point(-behind_deg)
    moved = step(gaze, *circling(0.0, speed_deg_s), known=known)
    return (yaw(moved) - yaw(gaze)) / DT


@pytest.mark.parametrize("speed", [5.0, 10.0, 50.0])
def test_pursuit_does_not_outrun_a_target_to_catch_up(speed):
    assert catch_up(speed, 1.5, False) == pytest.approx(min(speed, 28.0), rel=0.01)
    assert catch_up(speed, 1.5, True) > speed + 5.0
    assert catch_up(speed, -1.5, False) < speed, "a gaze that is ahead waits"


def test_a_slow_or_still_target_is_caught_up_with_freely():
    assert catch_up(0.0, 1.0, False) == pytest.approx(catch_up(0.0, 1.0, True))
    assert catch_up(1.0, 1.0, False) > 5.0
