"""Orientation of an OAK camera from its gyro: readings integrated in the device's own time.

Pure. Frames and readings have time stamps of the device's clock, so a frame's orientation needs no
conversion of times. The gyro's bias, its reading at rest, is subtracted.
"""

from bisect import bisect_left
from collections import deque
from math import cos, degrees, hypot, isfinite, radians, sin

import numpy as np
from numpy.typing import NDArray

from gazerig.drivers.types import CameraTurn

Rates = tuple[float, float, float]

_BLOCK_S, _BLOCKS = 0.3, 5
_FEWEST = 8  # readings in a block
# Largest deviation of blocks at rest from their mean, and largest bias.
_SPREAD_RAD_S, _MOST_BIAS_RAD_S = radians(0.06), radians(3.0)
# Largest drift of a bias with temperature from one rest to the next; a larger change is a slow,
# even motion, unless it lasts.
_STEP_RAD_S, _LASTING = radians(0.3), 10
_SHARE = 0.3


class GyroBias:
    """Estimator of the bias, from readings of 1.5 s at rest.

    At rest, averages of .3 s hardly differ, even if single readings are noisy. In motion they
    differ, even if it is as slow as breathing.

    rad_s: the bias, None before the first rest
    """

    def __init__(self) -> None:
        self.rad_s: Rates | None = None
        self._block: list[Rates] = []
        self._means: list[np.ndarray[tuple[int], np.dtype[np.float64]]] = []
        self._began_s: float | None = None
        self._elsewhere = 0

    def add(self, t_s: float, rates_rad_s: Rates) -> None:
        """Add a reading; times must ascend."""
        if self._began_s is None or t_s - self._began_s > 2.0 * _BLOCK_S:  # first reading, or a gap
            self._block, self._means, self._began_s = [], [], t_s
        self._block.append(rates_rad_s)
        if t_s - self._began_s < _BLOCK_S:
            return
        if len(self._block) >= _FEWEST:
            self._means.append(np.mean(self._block, axis=0))
        self._block, self._began_s = [], t_s
        if len(self._means) == _BLOCKS:
            # The gyro was at rest if these averages agree.
            means = np.array(self._means)
            mean = means.mean(axis=0)
            if np.abs(means - mean).max() > _SPREAD_RAD_S or np.abs(mean).max() > _MOST_BIAS_RAD_S:
                self._elsewhere = 0
            elif self.rad_s is None:
                self._set_bias(mean)
            else:
                off = mean - self.rad_s
                if np.abs(off).max() <= _STEP_RAD_S:
                    self._elsewhere = 0
                    self._set_bias(np.asarray(self.rad_s) + _SHARE * off)
                else:
                    self._elsewhere += 1
                    if self._elsewhere == _LASTING:
                        self._elsewhere = 0
                        self._set_bias(mean)
            self._means.clear()

    def _set_bias(self, bias: np.ndarray[tuple[int], np.dtype[np.float64]]) -> None:
        x, y, z = bias.tolist()
        self.rad_s = x, y, z


_Quaternion = tuple[float, float, float, float]

_KEPT = 400  # readings: 2 s at 200 Hz
_MOST_RAD_S = radians(2100.0)  # IMUs of OAK cameras measure up to 2000 deg/s
# Motion between readings farther apart than this is unknown.
_GAP_S = 0.1
# Largest time from the newest reading to a frame.
_AHEAD_S = 0.03
_STUCK_S = 0.5
_NEVER_AT_REST_S = 20.0
_WITHOUT = "only the joints measure the camera's turns; oak.gyro: false disables it"


class Gyro:
    """Gyro that returns the camera's orientation at any time of the last two seconds.

    Args:
        R_camera_imu: Rotation (3, 3) that takes directions from the gyro's axes to the camera's (x
            right, y down, z forward).

    fault: reason why it is not used, "" for none
    """

    def __init__(self, R_camera_imu: NDArray[np.float64]) -> None:
        self._R_camera_imu = R_camera_imu
        self._bias = GyroBias()
        self._times: deque[float] = deque(maxlen=_KEPT)
        self._turned: deque[_Quaternion] = deque(maxlen=_KEPT)
        self._rates: deque[Rates] = deque(maxlen=_KEPT)
        self._epoch = 0
        self._last: Rates | None = None  # the rates that were read
        self._first_s: float | None = None
        self._same_since_s: float | None = None
        self._absurd_since_s: float | None = None
        self._asked_since_s: float | None = None
        self._restless_told = False
        self._events: list[str] = []
        self.fault = ""

    @property
    def is_settled(self) -> bool:
        """Return whether its bias is known, or it is known to be unusable."""
        return bool(self.fault) or self._bias.rad_s is not None

    def events(self) -> tuple[str, ...]:
        """Return the events since the last call, one line each."""
        found, self._events = tuple(self._events), []
        return found

    def add(self, device_s: float, rates_rad_s: Rates) -> None:
        """Add a reading; readings not later than the last are ignored.

        Args:
            device_s: Time of the device's clock, seconds.
            rates_rad_s: Rates about the gyro's own axes.
        """
        if self.fault or (self._times and device_s <= self._times[-1]):
            return
        if not all(map(isfinite, rates_rad_s)) or hypot(*rates_rad_s) > _MOST_RAD_S:
            self._reject(device_s, rates_rad_s)
            return
        self._absurd_since_s = None
        # Readings are always noisy.
        if rates_rad_s != self._last or self._same_since_s is None:
            self._last, self._same_since_s = rates_rad_s, device_s
        elif device_s - self._same_since_s > _STUCK_S:
            x, y, z = map(degrees, rates_rad_s)
            self._fail(f"is stuck: always the same reading ({x:.2f}, {y:.2f}, {z:.2f} deg/s)")
        if self.fault:
            return
        x, y, z = (self._R_camera_imu @ rates_rad_s).tolist()
        self._bias.add(device_s, (x, y, z))
        self._integrate(device_s, (x, y, z))
        if self._first_s is None:
            self._first_s = device_s
        if self._bias.rad_s is None and not self._restless_told:
            self._restless_told = device_s - self._first_s > _NEVER_AT_REST_S
            if self._restless_told:
                self._events.append(
                    f"the OAK camera's gyro has not been at rest for {_NEVER_AT_REST_S:g} s, which "
                    "it needs once for 1.5 s: until then only the joints measure the camera's turns"
                )

    def orientation_at(self, device_s: float) -> CameraTurn | None:
        """Return the orientation at a time of the device's clock, None if it is unknown."""
        if self.fault:
            return None
        if self._asked_since_s is None:
            self._asked_since_s = device_s
        newest_s = self._times[-1] if self._times else self._asked_since_s
        if device_s - max(newest_s, self._asked_since_s) > _STUCK_S:
            self._fail("returns no readings")
            return None
        bias = self._bias.rad_s
        if bias is None or not self._times or not self._times[0] <= device_s <= newest_s + _AHEAD_S:
            return None
        after = bisect_left(self._times, device_s)
        at = min(after, len(self._times) - 1)
        # Extrapolated from the previous reading, or from the newest one with its rate.
        base = max(0, after - 1)
        rates, since_s = _mean(self._rates[base], self._rates[at]), device_s - self._times[base]
        w, x, y, z = _multiply(self._turned[base], _integrated_rotation(rates, bias, since_s))
        return CameraTurn(
            self._epoch,
            (
                (1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)),
                (2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)),
                (2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)),
            ),
        )

    def _integrate(self, device_s: float, rates: Rates) -> None:
        """Integrate the mean of this reading and the last."""
        if not self._times or device_s - self._times[-1] > _GAP_S:
            self._epoch += 1
            for column in (self._times, self._turned, self._rates):
                column.clear()
            turned: _Quaternion = (1.0, 0.0, 0.0, 0.0)
        else:
            bias, since_s = self._bias.rad_s or (0.0, 0.0, 0.0), device_s - self._times[-1]
            step = _integrated_rotation(_mean(self._rates[-1], rates), bias, since_s)
            turned = _multiply(self._turned[-1], step)
        self._times.append(device_s)
        self._turned.append(turned)
        self._rates.append(rates)

    def _reject(self, device_s: float, rates: Rates) -> None:
        """Reject an impossible reading; a single one may be a disturbance."""
        if self._absurd_since_s is None:
            self._absurd_since_s = device_s
        if device_s - self._absurd_since_s > _STUCK_S:
            x, y, z = map(degrees, rates)
            self._fail(f"returns impossible readings ({x:g}, {y:g}, {z:g} deg/s)")

    def _fail(self, why: str) -> None:
        self.fault = why
        self._events.append(f"the OAK camera's gyro {why}: {_WITHOUT}")


def _mean(a: Rates, b: Rates) -> Rates:
    return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]), 0.5 * (a[2] + b[2])


def _integrated_rotation(rates: Rates, bias: Rates, dt_s: float) -> _Quaternion:
    """Return the rotation by rates, minus the bias, in a time."""
    x, y, z = ((rate - off) * dt_s for rate, off in zip(rates, bias, strict=True))
    angle = hypot(x, y, z)
    share = 0.5 if angle < 1e-9 else sin(0.5 * angle) / angle
    return cos(0.5 * angle), share * x, share * y, share * z


def _multiply(a: _Quaternion, b: _Quaternion) -> _Quaternion:
    """Return the rotation a followed by b, about the rotated axes."""
    aw, ax, ay, az = a
    bw, bx, by, bz = b
    w = aw * bw - ax * bx - ay * by - az * bz
    x = aw * bx + ax * bw + ay * bz - az * by
    y = aw * by - ax * bz + ay * bw + az * bx
    z = aw * bz + ax * by - ay * bx + az * bw
    length = (w * w + x * x + y * y + z * z) ** 0.5
    return w / length, x / length, y / length, z / length
