"""Place and velocity of one track through a time in which it was not seen."""

import numpy as np
import pytest

from gazerig.robot.perception.kalman import NEAREST_M, ProcessNoise, TrackFilter

FINE = 0.002, 0.002
CAMERA = (-2.0, 0.0, 0.0)
DT_S = 1.0 / 30.0


def begun() -> TrackFilter:
    return TrackFilter((0.0, 0.0, 0.0), CAMERA, FINE, 0.7, ProcessNoise(0.12, 10.0))


def walked(unseen_pictures: int, stops_after: int) -> TrackFilter:
    """Follow a person at 1.8 m/s who is then unseen, stops meanwhile, and is seen again."""
    track = begun()
    for k in range(1, 31):
        track.predict(DT_S)
        track.correct((0.0, 1.8 * k * DT_S, 0.0), *FINE)
    assert track.v_m_s[1] == pytest.approx(1.8, abs=0.05)
    for k in range(unseen_pictures):
        track.predict(DT_S, seen=k == 0)
    track.correct((0.0, 1.8 * (30 + stops_after) * DT_S, 0.0), *FINE)
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
    track = begun()
    for k in range(1, 31):
        track.predict(DT_S)
        track.correct((0.0, 1.8 * k * DT_S, 0.0), *FINE)
    gone_m, speed_m_s = track.p_m[1], track.v_m_s[1]
    for _ in range(30):
        track.predict(DT_S, seen=False)
    assert track.v_m_s[1] == pytest.approx(speed_m_s * np.exp(-1.0), rel=0.01)
    for _ in range(300):
        track.predict(DT_S, seen=False)
    assert track.p_m[1] - gone_m < 1.9


def matrices(track: TrackFilter) -> np.ndarray:
    """Return the covariance along axes of which the last is the view: 6 x 6."""
    (a, b, c), (d, e, f) = track.across, track.along
    return np.block(
        [[np.diag([a, a, d]), np.diag([b, b, e])], [np.diag([b, b, e]), np.diag([c, c, f])]]
    )


def turn(x: np.ndarray, onto: np.ndarray, share: float) -> np.ndarray:
    """Return the rotation of one unit vector by a share of the angle to another."""
    axis = np.cross(x, onto)
    sin = np.linalg.norm(axis)
    angle = share * np.arctan2(sin, x @ onto)
    kx, ky, kz = axis / sin if sin > 0.0 else axis
    K = np.array([[0, -kz, ky], [kz, 0, -kx], [-ky, kx, 0]])
    return np.eye(3) + np.sin(angle) * K + (1.0 - np.cos(angle)) * K @ K


def wander(accel: float, dt_s: float) -> np.ndarray:
    one = np.array([[dt_s**3 / 3.0, dt_s**2 / 2.0], [dt_s**2 / 2.0, dt_s]])
    return 0.1 * accel**2 * np.kron(one, np.eye(3))


class Textbook:
    """The same filter with whole matrices in an orthonormal basis that turns with the view.

    The state is where the thing is off from its view, in metres at its range, and its velocity;
    after each correction the basis turns to the new direction and all lengths grow with the range.
    """

    def __init__(self, p: np.ndarray, sds: tuple[float, float], speed_sd: float) -> None:
        self.r = float(np.linalg.norm(p))
        u = p / self.r
        e1 = np.cross(u, (0.0, 0.0, 1.0))
        e1 /= np.linalg.norm(e1)
        self.E = np.column_stack((e1, np.cross(u, e1), u))
        self.v = np.zeros(3)
        self.P = np.diag([sds[0] ** 2, sds[0] ** 2, sds[1] ** 2, *[speed_sd**2] * 3])
        self.accel, self.unseen_s, self.surprises = 0.0, 0.0, 0

    def moved(self, x: np.ndarray) -> None:
        """Move by metres along the axes of the basis."""
        aside = np.array([x[0], x[1], 0.0])
        angle = np.linalg.norm(aside) / self.r
        if angle > 0.0:
            to = np.cos(angle) * self.E[:, 2] + np.sin(angle) * self.E @ (aside / (angle * self.r))
            self.E = turn(self.E[:, 2], to, 1.0) @ self.E
        grown = np.exp(x[2] / self.r)
        self.r, self.v, self.P = grown * self.r, grown * self.v, grown**2 * self.P

    def predict(self, dt_s: float, seen: bool, quiet: float) -> None:
        kept = 1.0 if seen else np.exp(-dt_s)
        self.moved(dt_s * self.v)
        F = np.block([[np.eye(3), dt_s * np.eye(3)], [np.zeros((3, 3)), kept * np.eye(3)]])
        self.v = kept * self.v
        self.accel *= np.exp(-dt_s / 0.5)
        self.P = F @ self.P @ F.T + wander(max(quiet, self.accel, 0.0 if seen else 1.0), dt_s)
        self.unseen_s += dt_s

    def updated(self, H: np.ndarray, off: np.ndarray, R: np.ndarray) -> None:
        K = self.P @ H.T @ np.linalg.inv(H @ self.P @ H.T + R)
        x = K @ off
        self.P = self.P - K @ H @ self.P
        self.v = self.v + x[3:]
        self.moved(x[:3])

    def correct(self, p: np.ndarray, sds: tuple[float, float], quiet: float, lively: float) -> None:
        far = float(np.linalg.norm(p))
        way = self.E.T @ p / far
        arc = np.arctan2(np.hypot(way[0], way[1]), way[2]) / np.hypot(way[0], way[1])
        off = self.r * np.array([arc * way[0], arc * way[1], np.log(far / self.r)])
        R = (self.r / far) ** 2 * np.diag([sds[0] ** 2, sds[0] ** 2, sds[1] ** 2])

        def squared() -> float:
            return float(off @ np.linalg.solve(self.P[:3, :3] + R, off))

        if squared() > 11.3:
            # The noise is doubled until the innovation is an ordinary one.
            self.accel, self.surprises = max(self.accel, quiet), self.surprises + 1
            while True:
                before, self.accel = self.accel, min(2.0 * self.accel, lively)
                self.P = self.P + wander(np.sqrt(self.accel**2 - before**2), self.unseen_s)
                if self.accel == lively or squared() < 4.0:
                    break
        self.unseen_s = 0.0
        self.updated(np.eye(3, 6), off, R)

    def correct_velocity(self, p: np.ndarray, v: np.ndarray, sds: tuple[float, float]) -> None:
        far = float(np.linalg.norm(p))
        u = p / far
        across, along = v - (v @ u) * u, v @ u
        here = self.E.T @ across
        there = self.r / far * np.array([here[0], here[1], along])
        R = (self.r / far) ** 2 * np.diag([sds[0] ** 2, sds[0] ** 2, sds[1] ** 2])
        self.updated(np.eye(6)[3:], there - self.v, R)


@pytest.mark.parametrize("seed", range(20))
def test_the_filter_is_the_one_of_the_textbooks(seed: int) -> None:
    """The same steps with whole matrices: x, F P F' + Q, K = P H' (H P H' + R)^-1."""
    rng = np.random.default_rng(seed)
    quiet, lively = 0.5, 10.0
    truth, camera = np.array([1.6, 0.3, 0.2]), np.array(CAMERA)
    sds = 0.03, 0.2
    track = TrackFilter(
        tuple((camera + truth).tolist()), CAMERA, sds, 0.7, ProcessNoise(quiet, lively)
    )
    book = Textbook(truth, sds, 0.7)
    for step in range(40):
        dt_s, seen = float(rng.uniform(0.01, 0.1)), bool(rng.random() < 0.8)
        track.predict(dt_s, seen, range_known=False)
        book.predict(dt_s, seen, quiet)
        measured = truth + rng.normal(0.0, 0.05 if step % 7 else 0.5, 3)
        of_this = float(rng.uniform(0.005, 0.05)), float(rng.uniform(0.05, 1.0))
        if rng.random() < 0.8:
            track.correct(tuple((camera + measured).tolist()), *of_this)
            book.correct(measured, of_this, quiet, lively)
        if rng.random() < 0.5:
            v = rng.normal(0.0, 0.3, 3)
            track.correct_velocity(tuple((camera + measured).tolist()), tuple(v.tolist()), *of_this)
            book.correct_velocity(measured, v, of_this)
        assert np.allclose(track.p_m, camera + book.r * book.E[:, 2], rtol=1e-9, atol=1e-11)
        assert np.allclose(track.v_m_s, book.E @ book.v, rtol=1e-8, atol=1e-10)
        assert np.allclose(matrices(track), book.P, rtol=1e-7, atol=1e-12)
    assert book.surprises > 0


@pytest.mark.parametrize("sd_deg", [1.0, 3.0, 6.0, 10.0, 30.0])
def test_directions_that_jump_are_no_approach(sd_deg: float) -> None:
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
        assert 0.95 * 2.0 < track.range_m < 1.05 * 2.0
        assert np.linalg.norm(track.p_m) == pytest.approx(track.range_m)


def test_what_flies_at_the_camera_does_not_come_out_behind_it() -> None:
    track = TrackFilter((0.5, 0.0, 0.0), (0.0, 0.0, 0.0), FINE, 0.7, ProcessNoise(1.0, 10.0))
    track.correct_velocity((0.5, 0.0, 0.0), (-10.0, 0.0, 0.0), 0.01, 0.01)
    for _ in range(10):
        track.predict(DT_S, seen=False)
        assert track.p_m[0] >= NEAREST_M - 1e-12


def test_a_camera_that_moves_sees_from_aside_what_it_knew_badly() -> None:
    """What was uncertain along the view is uncertain across it from a quarter turn away."""
    track = TrackFilter((2.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.01, 0.5), 0.7, ProcessNoise(1.0, 10.0))
    track.look_from((2.0, -2.0, 0.0))
    assert track.view == pytest.approx((0.0, 1.0, 0.0)) and track.range_m == pytest.approx(2.0)
    assert track.p_m == pytest.approx((2.0, 0.0, 0.0))
    assert track.across.p == pytest.approx(0.5 * (0.5**2 + 0.01**2))
    assert track.along.p == pytest.approx(0.01**2)
