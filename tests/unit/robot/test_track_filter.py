"""Place and velocity of one track through a time in which it was not seen."""

import numpy as np
import pytest

from gazerig.robot.perception.kalman import NEAREST_M, ProcessNoise, TrackFilter

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
def test_who_stopped_while_out_of_sight_is_not_said_to_rush_back(unseen: int):
    """The way it did not go is no sudden speed of the last picture alone."""
    track = walked(unseen, stops_after=1)
    assert abs(track.v_m_s[1]) < 1.8
    assert track.p_m[1] == pytest.approx(1.8 * 31 * DT_S, abs=0.01)


def test_who_went_on_out_of_sight_is_as_fast_as_before():
    assert walked(5, stops_after=5).v_m_s[1] == pytest.approx(1.8, abs=0.4)


def test_who_is_out_of_sight_comes_to_rest():
    """A speed of 1.8 m/s is down to a third after a second unseen, and goes at most 1.9 m."""
    track = walking()
    gone_m, speed_m_s = track.p_m[1], track.v_m_s[1]
    for _ in range(30):
        track.predict(DT_S, seen=False)
    assert track.v_m_s[1] == pytest.approx(speed_m_s * np.exp(-1.0), rel=0.01)
    for _ in range(300):
        track.predict(DT_S, seen=False)
    assert track.p_m[1] - gone_m < 1.9


def test_a_face_that_is_half_covered_does_not_rush_away():
    """The visible half of a face looks like a smaller one, a fifth farther away."""
    track = walking()
    track.is_covered = True
    track.correct((0.4, 2.2, 0.0), *FINE)
    assert track.v_m_s[0] < 0.3


@pytest.mark.parametrize("sd_deg", [1.0, 3.0, 6.0, 10.0, 30.0])
def test_directions_that_jump_are_no_approach(sd_deg: float):
    """Told that across is known to millimetres and along it to a metre, range stays assumed."""
    rng = np.random.default_rng(0)
    track = TrackFilter((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.02, 1.0), 0.7, ProcessNoise(1.0, 10.0))
    for _ in range(300):
        track.predict(DT_S, range_known=False)
        yaw, pitch = np.radians(np.clip(rng.normal(0.0, sd_deg, 2), -80.0, 80.0))
        off = (
            2.0 * np.cos(yaw) * np.cos(pitch),
            2.0 * np.sin(yaw) * np.cos(pitch),
            2.0 * np.sin(pitch),
        )
        track.correct(off, 0.02, 1.0)
        assert 1.9 < track.range_m < 2.1
        assert np.linalg.norm(track.p_m) == pytest.approx(track.range_m)


def test_what_flies_at_the_camera_does_not_come_out_behind_it():
    track = TrackFilter((0.5, 0.0, 0.0), (0.0, 0.0, 0.0), FINE, 0.7, ProcessNoise(1.0, 10.0))
    track.correct_velocity((0.5, 0.0, 0.0), (-10.0, 0.0, 0.0), 0.01, 0.01)
    for _ in range(10):
        track.predict(DT_S, seen=False)
        assert track.p_m[0] >= NEAREST_M - 1e-12


def test_a_camera_that_moves_sees_from_aside_what_it_knew_badly():
    """What was uncertain along the view is uncertain across it from a quarter turn away."""
    track = TrackFilter((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.01, 0.5), 0.7, ProcessNoise(1.0, 10.0))
    track.look_from((2.0, -2.0, 0.0))
    assert track.view == pytest.approx((0.0, 1.0, 0.0)) and track.range_m == pytest.approx(2.0)
    assert track.p_m == pytest.approx((2.0, 0.0, 0.0))
    assert track.across.p == pytest.approx(0.12505)
    assert track.along.p == pytest.approx(0.01**2)
