"""One thing's position and velocity through time: a constant-velocity Kalman filter.

World frame, metres, seconds. What moves changes its
velocity at random: little most of the time, and much at once when a person starts or
stops. One noise for both is either nervous or late, so there are two, and an innovation
too large for the quiet one brings the lively one in (Bar-Shalom, Li & Kirubarajan,
"Estimation with Applications to Tracking and Navigation", 11.6).

The covariance is kept as its blocks: of the position, of the velocity, and between them. A
position or a velocity is measured whole, so that both corrections are the same three products.
"""

from math import exp, sqrt
from typing import NamedTuple

from gazerig.gaze.angles import sub
from gazerig.gaze.types import Vec3
from gazerig.robot.perception.symmetric import (
    Flat9,
    Sym3,
    applied,
    full,
    inverse,
    less_product,
    plus,
    squared_length,
    times,
    transposed,
)

# Accelerations are taken to last this long, which makes the noise one of the time and not
# of the rate of frames.
_ACCELERATION_LASTS_S = 0.1
# Squared Mahalanobis distance that one innovation of 3 numbers in 100 exceeds by chance.
_SURPRISING = 11.3
# The squared distance of an ordinary one: its mean is 3.
_EXPECTED = 4.0
# What has changed its speed goes on changing it for about so long.
_CHANGES_FOR_S = 0.5
# What is not seen moves on, but less and less surely: people stop.
_STOPS_WITHIN_S = 1.0

_NONE: Flat9 = (0.0,) * 9


class ProcessNoise(NamedTuple):
    """Standard deviations of the acceleration, m/s2: quiet, and when something happens."""

    quiet_m_s2: float
    lively_m_s2: float


class TrackFilter:
    """The filter of one track. Numbers given to it must be finite.

    Args:
        p_m: first position.
        cov_m2: its covariance.
        speed_sd_m_s: standard deviation of the velocity, which begins at 0.
        noise: of the process.

    p_m, v_m_s: position and velocity
    p_cov, v_cov: their covariances; pv_cov: the covariance of position (rows) and velocity
    """

    def __init__(self, p_m: Vec3, cov_m2: Sym3, speed_sd_m_s: float, noise: ProcessNoise) -> None:
        self._noise = noise
        self._unseen_s = self._accel_m_s2 = 0.0
        var = speed_sd_m_s * speed_sd_m_s
        self.p_m: Vec3 = p_m
        self.v_m_s: Vec3 = (0.0, 0.0, 0.0)
        self.p_cov = cov_m2
        self.pv_cov = _NONE
        self.v_cov: Sym3 = (var, 0.0, 0.0, var, 0.0, var)

    def retune(self, noise: ProcessNoise) -> None:
        """Use another process noise; position and velocity stay."""
        self._noise = noise

    def predict(self, dt_s: float, seen: bool = True) -> None:
        """Go on by a time; what is not seen slows down."""
        if dt_s <= 0.0:
            return
        kept = 1.0 if seen else exp(-dt_s / _STOPS_WITHIN_S)
        self._unseen_s += dt_s
        (x, y, z), (vx, vy, vz) = self.p_m, self.v_m_s
        self.p_m = (x + dt_s * vx, y + dt_s * vy, z + dt_s * vz)
        self.v_m_s = (kept * vx, kept * vy, kept * vz)
        V, C, P = self.v_cov, self.pv_cov, self.p_cov
        a, b, c, d, e, f = V
        # Position and velocity after the move, then both with the position before it.
        D = (
            C[0] + dt_s * a, C[1] + dt_s * b, C[2] + dt_s * c,
            C[3] + dt_s * b, C[4] + dt_s * d, C[5] + dt_s * e,
            C[6] + dt_s * c, C[7] + dt_s * e, C[8] + dt_s * f,
        )  # fmt: skip
        self.p_cov = (
            P[0] + dt_s * (C[0] + D[0]),
            P[1] + dt_s * (C[3] + D[1]),
            P[2] + dt_s * (C[6] + D[2]),
            P[3] + dt_s * (C[4] + D[4]),
            P[4] + dt_s * (C[7] + D[5]),
            P[5] + dt_s * (C[8] + D[8]),
        )
        if not seen:
            k2 = kept * kept
            D = tuple([kept * one for one in D])  # type: ignore[assignment]
            self.v_cov = (k2 * a, k2 * b, k2 * c, k2 * d, k2 * e, k2 * f)
        self.pv_cov = D
        self._accel_m_s2 *= exp(-dt_s / _CHANGES_FOR_S)
        self._wander(max(self._noise.quiet_m_s2, self._accel_m_s2), dt_s)

    def correct(self, p_m: Vec3, cov_m2: Sym3) -> None:
        """Update with a measured position and its covariance."""
        off = sub(p_m, self.p_m)
        information, _ = inverse(plus(self.p_cov, cov_m2))
        if squared_length(off, information) > _SURPRISING:
            information = self._adapted(off, cov_m2)
        self._unseen_s = 0.0
        step = applied(information, off)
        P, C = full(self.p_cov), self.pv_cov
        self.p_m = _moved(self.p_m, P, step)
        self.v_m_s = _moved(self.v_m_s, C, step)
        N = times(information, C)
        self.v_cov = less_product(self.v_cov, C, N)
        self.pv_cov = _less(C, P, N)
        self.p_cov = less_product(self.p_cov, P, times(information, P))

    def _adapted(self, off: Vec3, cov_m2: Sym3) -> Sym3:
        """Raise the noise until an innovation is no surprise; return the information matrix.

        No higher than that: the largest noise at once would take a small change of speed for a
        large one, and the velocity would overshoot by as much as it had lagged behind.
        """
        # Whatever happened may have happened at any time since the last look: a place
        # that was long unseen and is off tells less of the velocity of now.
        accel, most = max(self._accel_m_s2, self._noise.quiet_m_s2), self._noise.lively_m_s2
        while True:
            before, accel = accel, min(2.0 * accel, most)
            if accel > before:
                self._wander(sqrt(accel * accel - before * before), self._unseen_s)
            information, _ = inverse(plus(self.p_cov, cov_m2))
            if accel >= most or squared_length(off, information) < _EXPECTED:
                self._accel_m_s2 = accel
                return information

    def correct_velocity(self, v_m_s: Vec3, cov_m2_s2: Sym3) -> None:
        """Update with a measured velocity and its covariance."""
        information, _ = inverse(plus(self.v_cov, cov_m2_s2))
        step = applied(information, sub(v_m_s, self.v_m_s))
        V, C = full(self.v_cov), transposed(self.pv_cov)
        self.p_m = _moved(self.p_m, C, step)
        self.v_m_s = _moved(self.v_m_s, V, step)
        N = times(information, C)
        self.p_cov = less_product(self.p_cov, C, N)
        self.pv_cov = transposed(_less(C, V, N))
        self.v_cov = less_product(self.v_cov, V, times(information, V))

    def cov_rows(self) -> tuple[float, ...]:
        """Return the covariance of position and velocity: 6 x 6 numbers, row by row."""
        a, b, c, d, e, f = self.p_cov
        g, h, i, j, k, l_, m, n, o = self.pv_cov
        p, q, r, s, t, u = self.v_cov
        return (
            a, b, c, g, h, i,
            b, d, e, j, k, l_,
            c, e, f, m, n, o,
            g, j, m, p, q, r,
            h, k, n, q, s, t,
            i, l_, o, r, t, u,
        )  # fmt: skip

    def _wander(self, accel_m_s2: float, dt_s: float) -> None:
        """Add the covariance that random acceleration makes in a time."""
        v = accel_m_s2 * accel_m_s2 * _ACCELERATION_LASTS_S * dt_s
        pv = v * dt_s / 2.0
        p = v * dt_s * dt_s / 3.0
        a, b, c, d, e, f = self.p_cov
        self.p_cov = (a + p, b, c, d + p, e, f + p)
        g, h, i, j, k, l_, m, n, o = self.pv_cov
        self.pv_cov = (g + pv, h, i, j, k + pv, l_, m, n, o + pv)
        a, b, c, d, e, f = self.v_cov
        self.v_cov = (a + v, b, c, d + v, e, f + v)


def _moved(at: Vec3, M: Flat9, step: Vec3) -> Vec3:
    """Return a + M^T s."""
    x, y, z = step
    return (
        at[0] + M[0] * x + M[3] * y + M[6] * z,
        at[1] + M[1] * x + M[4] * y + M[7] * z,
        at[2] + M[2] * x + M[5] * y + M[8] * z,
    )


def _less(A: Flat9, M: Flat9, N: Flat9) -> Flat9:
    """Return A - M N, M being symmetric."""
    a, b, c, _, e, f, _, _, i = M
    p, q, r, s, t, u, v, w, x = N
    return (
        A[0] - a * p - b * s - c * v, A[1] - a * q - b * t - c * w, A[2] - a * r - b * u - c * x,
        A[3] - b * p - e * s - f * v, A[4] - b * q - e * t - f * w, A[5] - b * r - e * u - f * x,
        A[6] - c * p - f * s - i * v, A[7] - c * q - f * t - i * w, A[8] - c * r - f * u - i * x,
    )  # fmt: skip
