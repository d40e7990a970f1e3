"""Place and velocity of one track through a time in which it was not seen."""

import numpy as np
import pytest

from gazerig.robot.perception.kalman import ProcessNoise, TrackFilter

FINE = (0.002**2, 0.0, 0.0, 0.002**2, 0.0, 0.002**2)
DT_S = 1.0 / 30.0


def walked(unseen_pictures: int, stops_after: int) -> TrackFilter:
    """Follow somebody at 1.8 m/s who is then unseen, stands still meanwhile, and is seen again."""
    track = TrackFilter((0.0, 0.0, 0.0), FINE, 0.7, ProcessNoise(0.12, 10.0))
    for k in range(1, 31):
        track.predict(DT_S)
        track.correct((0.0, 1.8 * k * DT_S, 0.0), FINE)
    assert track.v_m_s[1] == pytest.approx(1.8, abs=0.05)
    for k in range(unseen_pictures):
        track.predict(DT_S, seen=k == 0)
    track.correct((0.0, 1.8 * (30 + stops_after) * DT_S, 0.0), FINE)
    return track


@pytest.mark.parametrize("unseen", [4, 6, 8])
def test_who_stopped_while_out_of_sight_is_not_said_to_rush_back(unseen: int) -> None:
    """The way it did not go is no sudden speed of the last picture alone."""
    track = walked(unseen, stops_after=1)
    assert abs(track.v_m_s[1]) < 1.8
    assert track.p_m[1] == pytest.approx(1.8 * 31 * DT_S, abs=0.01)


def test_who_went_on_out_of_sight_is_as_fast_as_before() -> None:
    assert walked(5, stops_after=5).v_m_s[1] == pytest.approx(1.8, abs=0.4)


def test_who_is_out_of_sight_comes_to_rest() -> None:
    """A speed of 1.8 m/s is down to a third after a second unseen, and goes at most 1.9 m."""
    track = TrackFilter((0.0, 0.0, 0.0), FINE, 0.7, ProcessNoise(0.12, 10.0))
    for k in range(1, 31):
        track.predict(DT_S)
        track.correct((0.0, 1.8 * k * DT_S, 0.0), FINE)
    gone_m, speed_m_s = track.p_m[1], track.v_m_s[1]
    for _ in range(30):
        track.predict(DT_S, seen=False)
    assert track.v_m_s[1] == pytest.approx(speed_m_s * np.exp(-1.0), rel=0.01)
    for _ in range(300):
        track.predict(DT_S, seen=False)
    assert track.p_m[1] - gone_m < 1.9


def of(cov: np.ndarray) -> tuple[float, float, float, float, float, float]:
    (a, b, c), (_, d, e), (_, _, f) = cov.tolist()
    return (a, b, c, d, e, f)


def covariance(rng: np.random.Generator, scale: float) -> np.ndarray:
    A = rng.normal(0.0, scale, (3, 3))
    return A @ A.T + 0.1 * scale**2 * np.eye(3)


@pytest.mark.parametrize("seed", range(20))
def test_the_filter_is_the_one_of_the_textbooks(seed: int) -> None:
    """The same steps with whole matrices: x, F P F' + Q, K = P H' (H P H' + R)^-1."""
    rng = np.random.default_rng(seed)
    quiet, lively = 0.5, 10.0
    first = covariance(rng, 0.05)
    track = TrackFilter((0.3, 0.2, 0.1), of(first), 0.7, ProcessNoise(quiet, lively))
    x = np.array([0.3, 0.2, 0.1, 0.0, 0.0, 0.0])
    P = np.block([[first, np.zeros((3, 3))], [np.zeros((3, 3)), 0.49 * np.eye(3)]])
    unseen_s, surprises, accel = 0.0, 0, 0.0

    def wander(accel: float, dt_s: float) -> np.ndarray:
        one = np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]])
        return 0.1 * accel**2 * np.kron(one, np.eye(3))

    for step in range(40):
        dt_s, seen = float(rng.uniform(0.01, 0.1)), bool(rng.random() < 0.8)
        kept = 1.0 if seen else np.exp(-dt_s)
        F = np.block([[np.eye(3), dt_s * np.eye(3)], [np.zeros((3, 3)), kept * np.eye(3)]])
        accel *= np.exp(-dt_s / 0.5)
        x, P, unseen_s = F @ x, F @ P @ F.T + wander(max(quiet, accel), dt_s), unseen_s + dt_s
        track.predict(dt_s, seen)
        if rng.random() < 0.8:
            R = covariance(rng, 0.02)
            measured = x[:3] + rng.normal(0.0, 0.02 if step % 7 else 0.5, 3)
            H = np.eye(3, 6)
            off = measured - H @ x
            if off @ np.linalg.solve(P[:3, :3] + R, off) > 11.3:
                # The noise is doubled until the innovation is an ordinary one.
                raised, accel, surprises = P, max(accel, quiet), surprises + 1
                while True:
                    before, accel = accel, min(2.0 * accel, lively)
                    raised = raised + wander(np.sqrt(accel**2 - before**2), unseen_s)
                    if accel == lively or off @ np.linalg.solve(raised[:3, :3] + R, off) < 4.0:
                        break
                P = raised
            unseen_s = 0.0
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            x, P = x + K @ off, P - K @ H @ P
            track.correct(tuple(measured.tolist()), of(R))
        if rng.random() < 0.5:
            R = covariance(rng, 0.2)
            H = np.eye(6)[3:]
            measured = x[3:] + rng.normal(0.0, 0.2, 3)
            K = P @ H.T @ np.linalg.inv(H @ P @ H.T + R)
            x, P = x + K @ (measured - H @ x), P - K @ H @ P
            track.correct_velocity(tuple(measured.tolist()), of(R))
        assert np.allclose([*track.p_m, *track.v_m_s], x, rtol=1e-9, atol=1e-12)
        assert np.allclose(np.reshape(track.cov_rows(), (6, 6)), P, rtol=1e-7, atol=1e-12)
    assert surprises > 0
