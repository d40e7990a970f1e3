"""One thing's place and velocity through time: a constant-velocity Kalman filter.

World frame, metres, seconds. The state is (x, y, z, vx, vy, vz). What moves changes its
velocity at random: little most of the time, and much at once when a person starts or
stops. One noise for both is either nervous or late, so there are two, and an innovation
too large for the quiet one brings the lively one in (Bar-Shalom, Li & Kirubarajan,
"Estimation with Applications to Tracking and Navigation", 11.6).
"""

from math import exp
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from gazerig.gaze.angles import sub, unit
from gazerig.gaze.types import Vec3

Floats = NDArray[np.float64]

# Accelerations are taken to last this long, which makes the noise one of the time and not
# of the rate of frames.
_ACCELERATION_LASTS_S = 0.1
# Squared Mahalanobis distance that one innovation of 3 numbers in 100 exceeds by chance.
_SURPRISING = 11.3
# What is not seen moves on, but less and less surely: people stop.
_STOPS_WITHIN_S = 1.0

_PLACE = np.hstack((np.eye(3), np.zeros((3, 3))))
_VELOCITY = np.hstack((np.zeros((3, 3)), np.eye(3)))
# Where the parts of a covariance (6, 6) stand.
_I3 = np.eye(3)
_OF_PLACE, _OF_VELOCITY = _PLACE.T @ _PLACE, _VELOCITY.T @ _VELOCITY
_OF_BOTH = _PLACE.T @ _VELOCITY + _VELOCITY.T @ _PLACE
_MOVE = _PLACE.T @ _VELOCITY


class ProcessNoise(NamedTuple):
    """Standard deviations of the acceleration, m/s2: quiet, and when something happens."""

    quiet_m_s2: float
    lively_m_s2: float


class TrackFilter:
    """The filter of one track. Numbers given to it must be finite."""

    def __init__(self, p_m: Vec3, cov_m2: Floats, speed_sd_m_s: float, noise: ProcessNoise) -> None:
        self._noise = noise
        self._unseen_s = 0.0
        # OpenCV's filter: a prediction and a correction take 37 us, in numpy 170.
        self._kalman = cv2.KalmanFilter(6, 3, 0, cv2.CV_64F)
        cov = _PLACE.T @ cov_m2 @ _PLACE + speed_sd_m_s**2 * _OF_VELOCITY
        self._keep(np.array((*p_m, 0.0, 0.0, 0.0)), cov)

    def retune(self, noise: ProcessNoise) -> None:
        """Believe in another restlessness; place and velocity stay."""
        self._noise = noise

    def predict(self, dt_s: float, seen: bool = True) -> None:
        """Go on by a time; what is not seen slows down."""
        if dt_s <= 0.0:
            return
        kept = 1.0 if seen else exp(-dt_s / _STOPS_WITHIN_S)
        self._unseen_s += dt_s
        move = _OF_PLACE + dt_s * _MOVE + kept * _OF_VELOCITY
        state = move @ self.state
        cov = move @ self.cov @ move.T + _wander(self._noise.quiet_m_s2, dt_s)
        self._keep(state, cov)

    def correct(self, p_m: Vec3, cov_m2: Floats) -> None:
        """Update with a measured position (3,) and its covariance (3, 3)."""
        off = np.subtract(p_m, self.state[:3])
        if off @ np.linalg.solve(self.cov[:3, :3] + cov_m2, off) > _SURPRISING:
            # Whatever happened may have happened at any time since the last look: a place
            # that was long unseen and is off tells less of the velocity of now.
            more = _wander(self._noise.lively_m_s2, self._unseen_s)
            self._keep(self.state, self.cov + more)
        self._unseen_s = 0.0
        self._correct(_PLACE, p_m, cov_m2)

    def correct_velocity(self, v_m_s: Vec3, cov_m2_s2: Floats) -> None:
        """Update with a measured velocity (3,) and its covariance (3, 3)."""
        self._correct(_VELOCITY, v_m_s, cov_m2_s2)

    @property
    def state(self) -> Floats:
        """Return place and velocity: (6,)."""
        state: Floats = self._state
        return state

    @property
    def cov(self) -> Floats:
        """Return their covariance: (6, 6)."""
        cov: Floats = self._cov
        return cov

    def _correct(self, seen: Floats, value: Vec3, noise: Floats) -> None:
        kalman = self._kalman
        kalman.measurementMatrix = seen
        kalman.measurementNoiseCov = noise
        kalman.correct(np.array(value))
        state, cov = np.array(kalman.statePost, float), np.array(kalman.errorCovPost, float)
        self._keep(state[:, 0], cov)

    def _keep(self, state: Floats, cov: Floats) -> None:
        """Set the state, with its covariance made symmetric again after rounding."""
        self._state, self._cov = state, 0.5 * (cov + cov.T)
        kalman = self._kalman
        kalman.statePre = kalman.statePost = state[:, None]
        kalman.errorCovPre = kalman.errorCovPost = self._cov


def sight_cov(p_m: Vec3, p_eye_m: Vec3, across_sd: float, along_sd: float) -> Floats:
    """Return the covariance (3, 3) of what is known differently across and along the view."""
    view = np.array(unit(sub(p_m, p_eye_m)))
    more = along_sd**2 - across_sd**2
    cov: Floats = across_sd**2 * _I3 + more * (view[:, None] * view)
    return cov


def far_off(off_m: ArrayLike, cov_m2: Floats) -> float:
    """Return the squared Mahalanobis length of a difference of places."""
    off = np.asarray(off_m, dtype=np.float64)
    return float(off @ np.linalg.solve(cov_m2, off))


def _wander(accel_m_s2: float, dt_s: float) -> Floats:
    """Return the covariance (6, 6) that random acceleration adds in a time."""
    power = accel_m_s2**2 * _ACCELERATION_LASTS_S
    cov: Floats = power * (
        dt_s**3 / 3.0 * _OF_PLACE + dt_s**2 / 2.0 * _OF_BOTH + dt_s * _OF_VELOCITY
    )
    return cov
