"""Following in gaze space: a point in the world after another, seen from one eye centre."""

from math import atan2, degrees, exp, radians

import numpy as np
import pytest

from gazerig.gaze.angles import angle_between, direction, norm, scale
from gazerig.gaze.oculomotor.binocular import MAX_RAD_S
from gazerig.gaze.oculomotor.pursuit import Pursuit, PursuitParams, line_of_sight_to
from gazerig.gaze.types import Vec3

DT = 0.005
EYE = (0.0, 0.0, 0.0)
STILL = (0.0, 0.0, 0.0)


def point(yaw_deg: float, distance: float = 1.0) -> Vec3:
    return scale(direction((radians(yaw_deg), 0.0)), distance)


def circling(yaw_deg: float, speed_deg_s: float) -> tuple[Vec3, Vec3]:
    """Return a point on a circle of 1 m and its velocity."""
    place = point(yaw_deg)
    return place, scale((-place[1], place[0], 0.0), radians(speed_deg_s))


def step(
    gaze: Vec3, target: Vec3, v: Vec3, eye: Vec3 = EYE, dt: float = DT, closing: bool = True,
    known: bool = True,
) -> Vec3:  # fmt: skip
    """Return the gaze point a tick later."""
    sights = line_of_sight_to(gaze, eye), line_of_sight_to(target, eye)
    return Pursuit(PursuitParams()).follow(*sights, target, v, eye, dt, closing, known)


def yaw(p: Vec3) -> float:
    return degrees(atan2(p[1], p[0]))


def follow(speed_deg_s: float, seconds: float, dt: float = DT) -> tuple[float, float]:
    """Return the speed and the lag behind a circling target at the end, in degrees."""
    gaze, before = point(0.0), 0.0
    for k in range(1, round(seconds / dt) + 1):
        before = yaw(gaze)
        gaze = step(gaze, *circling(speed_deg_s * k * dt, speed_deg_s), EYE, dt)
    return (yaw(gaze) - before) / dt, speed_deg_s * seconds - yaw(gaze)


def test_following_and_closing_together_are_no_faster_than_people():
    most = degrees(MAX_RAD_S)
    gaze = step(point(0.0), *circling(5.0, most), EYE, DT)
    assert yaw(gaze) / DT == pytest.approx(most, rel=5e-3)


@pytest.mark.parametrize("speed", [10.0, 20.0, 30.0, 50.0])
@pytest.mark.parametrize("dt", [0.010, 0.005, 0.002])
def test_ramp_is_followed_at_its_speed_with_the_lag_of_the_gains(speed: float, dt: float):
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


def test_a_jump_of_the_place_does_not_enter_the_speed():
    gaze = step(point(0.0), point(1.0), STILL, EYE, DT)
    assert yaw(gaze) / DT == pytest.approx(8.0, rel=0.03)


@pytest.mark.parametrize(("speed", "taken"), [(50.0, 47.5), (80.0, 55.1), (120.0, 0.0)])
def test_speed_taken_over(speed: float, taken: float):
    gaze = step(point(0.0), *circling(speed * DT, speed), closing=False)
    assert yaw(gaze) / DT == pytest.approx(taken, rel=0.01)
    seen = Pursuit(PursuitParams()).slip(point(0.0), *circling(0.0, speed), EYE)
    assert degrees(norm(seen.slip_rad_s)) == pytest.approx(speed - taken, rel=0.01)


@pytest.mark.parametrize(("start", "end", "rate"), [(2.0, 0.5, 4.0), (0.5, 2.0, 3.0)])
def test_depth_closes_by_nearness_and_more_slowly_outwards(start: float, end: float, rate: float):
    gaze = point(0.0, start)
    for _ in range(40):
        gaze = step(gaze, point(0.0, end), STILL, EYE, DT)
    left = (1.0 / norm(gaze) - 1.0 / end) / (1.0 / start - 1.0 / end)
    assert left == pytest.approx(exp(-rate * 0.2), abs=0.005)
    assert abs(yaw(gaze)) < 1e-9


def test_e26_direction_and_depth_do_not_disturb_each_other():
    def end(yaw_deg: float, distance: float) -> Vec3:
        gaze = point(0.0)
        for _ in range(30):
            gaze = step(gaze, point(yaw_deg, distance), STILL, EYE, DT)
        return gaze

    together, turned, nearer = end(1.5, 0.5), end(1.5, 1.0), end(0.0, 0.5)
    assert degrees(angle_between(together, turned)) < 0.01
    assert norm(together) == pytest.approx(norm(nearer), rel=1e-6)


def test_a_still_target_is_held_whatever_the_eye_centre_does():
    gaze = point(20.0, 0.5)
    for k in range(200):
        eye = (0.0, 0.05 * float(np.sin(0.1 * k)), 0.0)
        gaze = step(gaze, point(20.0, 0.5), STILL, eye, DT)
        assert gaze == pytest.approx(point(20.0, 0.5), abs=1e-9)


def catch_up(speed_deg_s: float, behind_deg: float, known: bool) -> float:
    """Return the speed of a gaze that is behind a circling target; degrees."""
    gaze = point(-behind_deg)
    now, v = circling(0.0, speed_deg_s)
    moved = step(gaze, now, v, known=known)
    return (yaw(moved) - yaw(gaze)) / DT


@pytest.mark.parametrize("speed", [5.0, 10.0, 50.0])
def test_pursuit_does_not_outrun_a_target_to_catch_up(speed: float):
    assert catch_up(speed, 1.5, False) == pytest.approx(min(speed, 28.0), rel=0.01)
    assert catch_up(speed, 1.5, True) > speed + 5.0
    assert catch_up(speed, -1.5, False) < speed, "a gaze that is ahead waits"


def test_a_slow_or_still_target_is_caught_up_with_freely():
    assert catch_up(0.0, 1.0, False) == pytest.approx(catch_up(0.0, 1.0, True))
    assert catch_up(1.0, 1.0, False) > 5.0
