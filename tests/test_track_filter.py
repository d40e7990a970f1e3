"""Place and velocity of one track through a time in which it was not seen."""

import numpy as np
import pytest

from gazerig.robot.perception.kalman import ProcessNoise, TrackFilter

FINE = 0.002**2 * np.eye(3)
DT_S = 1.0 / 30.0


def walked(unseen_pictures: int, stops_after: int) -> TrackFilter:
    """Follow somebody at 1.8 m/s who is then unseen, stands still meanwhile, and is seen again."""
    track = TrackFilter((0.0, 0.0, 0.0), FINE, 0.7, ProcessNoise(0.12, 10.0))
    for k in range(1, 31):
        track.predict(DT_S)
        track.correct((0.0, 1.8 * k * DT_S, 0.0), FINE)
    assert track.state[4] == pytest.approx(1.8, abs=0.05)
    for k in range(unseen_pictures):
        track.predict(DT_S, seen=k == 0)
    track.correct((0.0, 1.8 * (30 + stops_after) * DT_S, 0.0), FINE)
    return track


@pytest.mark.parametrize("unseen", [4, 6, 8])
def test_who_stopped_while_out_of_sight_is_not_said_to_rush_back(unseen: int) -> None:
    """The way it did not go is no sudden speed of the last picture alone."""
    track = walked(unseen, stops_after=1)
    assert abs(track.state[4]) < 1.8
    assert track.state[1] == pytest.approx(1.8 * 31 * DT_S, abs=0.01)


def test_who_went_on_out_of_sight_is_as_fast_as_before() -> None:
    assert walked(5, stops_after=5).state[4] == pytest.approx(1.8, abs=0.4)


def test_who_is_out_of_sight_comes_to_rest() -> None:
    """A speed of 1.8 m/s is down to a third after a second unseen, and goes at most 1.9 m."""
    track = TrackFilter((0.0, 0.0, 0.0), FINE, 0.7, ProcessNoise(0.12, 10.0))
    for k in range(1, 31):
        track.predict(DT_S)
        track.correct((0.0, 1.8 * k * DT_S, 0.0), FINE)
    gone_m, speed_m_s = float(track.state[1]), float(track.state[4])
    for _ in range(30):
        track.predict(DT_S, seen=False)
    assert track.state[4] == pytest.approx(speed_m_s * np.exp(-1.0), rel=0.01)
    for _ in range(300):
        track.predict(DT_S, seen=False)
    assert track.state[1] - gone_m < 1.9
