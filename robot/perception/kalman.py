"""Kalman filter of one thing's position and velocity, in direction and log range.

A camera measures positions to millimetres across its view, but often only to a metre along it. In
x, y, z this error is a long thin ellipsoid. Two of them in slightly different directions intersect
nearer to the camera than their centres: a linear filter would interpret every jump of the direction
as an approach. Direction and logarithm of the range separate the two, and no estimate is behind the
camera (modified spherical coordinates: Aidala and Hammel, "Utilization of modified polar
coordinates for bearings-only tracking", 1983).

Position and velocity are stored in the world, in metres and seconds. Variances are stored across
the view, the same for all directions there, and along it. They rotate with the direction and grow
with the range.

A velocity changes at random: usually little, and abruptly when a person starts or stops. One
    process noise for both cases is either noisy or slow. So two are used, and an innovation too
    large for the lower one raises the noise towards the higher one (Bar-Shalom, Li & Kirubarajan,
    "Estimation with Applications to Tracking and Navigation", 11.6).
"""

from math import atan2, cos, exp, log, sin, sqrt
from typing import NamedTuple

from gazerig.gaze.angles import add, dot, norm, scale, sub
from gazerig.gaze.types import Vec3

# Assumed duration of an acceleration, which makes the noise independent of the frame rate.
_ACCELERATION_LASTS_S = 0.1
# Squared Mahalanobis distance that 1 of 100 innovations (of 3 numbers) exceeds by chance.
_SURPRISING = 11.3
# Squared distance of an ordinary innovation: its mean is 3.
_EXPECTED = 4.0
# Usual duration of a change of speed.
_CHANGES_FOR_S = 0.5
# Time constant with which an unseen thing slows down: people stop.
_STOPS_WITHIN_S = 1.0
# Noise of the acceleration while unseen: people also turn and hurry.
_UNSEEN_M_S2 = 1.0
# Errors of a face of which a part is covered, across the view and as a share of the range, if they
# show: the detector completes the visible part, often to a smaller face.
_COVERED_M, _COVERED_SHARE = 0.03, 0.5
NEAREST_M = 0.05
"""Least distance of a thing from the camera."""
# Largest change of the range's logarithm in one step.
_LARGEST_LOG_STEP = 3.0
_TINY_RAD = 1e-12


class ProcessNoise(NamedTuple):
    """Standard deviations of the acceleration, m/s2: ordinary, and at a change of motion."""

    quiet_m_s2: float
    lively_m_s2: float


class Variances(NamedTuple):
    """Covariance of position and velocity along one axis: m2, m2/s, m2/s2."""

    p: float
    pv: float
    v: float

    def measured(self, index: int, variance: float) -> tuple[float, float, "Variances"]:
        """Return the gains of position and velocity, and the covariance, of a measurement.

        index: what is measured; 0: the position, 1: the velocity
        """
        row = self[index : index + 2]
        gain_p, gain_v = (one / (row[index] + variance) for one in row)
        left = self.p - gain_p * row[0], self.pv - gain_p * row[1], self.v - gain_v * row[1]
        return gain_p, gain_v, Variances(*left)

    def after(self, dt_s: float, kept: float) -> "Variances":
        """Return the covariance after a time, given the fraction of the velocity that remains."""
        p, pv, v = self
        both = pv + dt_s * v
        return Variances(p + dt_s * (pv + both), kept * both, kept * kept * v)

    def with_noise(self, accel_m_s2: float, dt_s: float) -> "Variances":
        """Return the covariance plus the effect of random acceleration over a time."""
        v = accel_m_s2 * accel_m_s2 * _ACCELERATION_LASTS_S * dt_s
        more = v * dt_s * dt_s / 3.0, v * dt_s / 2.0, v
        return Variances(*add(self, more))

    def towards(self, other: "Variances", share: float) -> "Variances":
        """Return the covariance interpolated towards another by a fraction."""
        return Variances(*add(scale(self, 1.0 - share), scale(other, share)))


class TrackFilter:
    """Kalman filter of one track. All inputs must be finite.

    Args:
        p_m: first position.
        p_camera_m: position of the camera.
        sds_m: standard deviations of the position across and along the view.
        speed_sd_m_s: standard deviation of the velocity, which is 0 at first.
        noise: process noise.

    p_m, v_m_s: position and velocity
    view, range_m: unit vector from the camera to it, and its distance
    across, along: covariances across the view (each direction) and along it
    is_covered: whether a nearer thing may cover a part of it
    """

    __slots__ = (
        "_accel_m_s2", "_camera", "_noise", "_unseen_s", "across", "along", "is_covered", "p_m",
        "range_m", "v_m_s", "view",
    )  # fmt: skip

    def __init__(
        self,
        p_m: Vec3,
        p_camera_m: Vec3,
        sds_m: tuple[float, float],
        speed_sd_m_s: float,
        noise: ProcessNoise,
    ) -> None:
        self._noise = noise
        self._unseen_s = self._accel_m_s2 = 0.0
        self.is_covered = False
        self._camera = p_camera_m
        self.p_m: Vec3 = p_m
        self.v_m_s: Vec3 = (0.0, 0.0, 0.0)
        self.view, self.range_m = view_and_range(p_m, p_camera_m)
        var = speed_sd_m_s * speed_sd_m_s
        self.across = Variances(sds_m[0] * sds_m[0], 0.0, var)
        self.along = Variances(sds_m[1] * sds_m[1], 0.0, var)

    def predict(
        self, dt_s: float, seen: bool = True, range_known: bool = True, level: bool = False
    ) -> None:
        """Advance by a time; an unseen thing slows down.

        Args:
            dt_s: the time.
            seen: whether it was seen in the last frame.
            range_known: False if its range is only assumed: a thing that crosses the view then
                keeps its range, because neither its path nor its speed is known.
            level: whether it keeps its height while unseen, as people do.
        """
        if dt_s <= 0.0:
            return
        if level and not seen:
            self.v_m_s = (self.v_m_s[0], self.v_m_s[1], 0.0)
        v = self.v_m_s
        if range_known:
            self._place(add(self.p_m, scale(v, dt_s)))
        else:
            along = dot(v, self.view)
            self._move(scale(sub(v, scale(self.view, along)), dt_s), along * dt_s)
        kept = 1.0 if seen else exp(-dt_s / _STOPS_WITHIN_S)
        self.v_m_s = scale(self.v_m_s, kept)
        self._unseen_s += dt_s
        self._accel_m_s2 *= exp(-dt_s / _CHANGES_FOR_S)
        accel = max(self._noise.quiet_m_s2, self._accel_m_s2, 0.0 if seen else _UNSEEN_M_S2)
        self.across = self.across.after(dt_s, kept).with_noise(accel, dt_s)
        self.along = self.along.after(dt_s, kept).with_noise(accel, dt_s)

    def look_from(self, p_camera_m: Vec3) -> None:
        """Move the camera, which mixes the components along and across the view."""
        if p_camera_m == self._camera:
            return
        before, self._camera = self.view, p_camera_m
        self._place(self.p_m)
        ahead = dot(before, self.view)
        turned = 1.0 - ahead * ahead
        a, b = self.across, self.along
        self.across = a.towards(b, 0.5 * turned)
        self.along = b.towards(a, turned)

    def correct(self, p_m: Vec3, across_sd_m: float, along_sd_m: float) -> None:
        """Update with a measured position and its standard deviations."""
        view, range_m = view_and_range(p_m, self._camera)
        at = self.range_m / range_m
        across, along = (at * across_sd_m) ** 2, (at * along_sd_m) ** 2
        # Offset of the position from the predicted one: from one line of view to the other, tangent
        # to the sphere around the camera, and the range times the logarithm of the ranges' ratio.
        ahead = dot(view, self.view)
        aside_m = sub(view, scale(self.view, ahead))
        away = norm(aside_m)
        arc = atan2(away, ahead) / away if away > _TINY_RAD else 1.0
        aside_m, deep_m = scale(aside_m, self.range_m * arc), -self.range_m * log(at)
        aside, deep = dot(aside_m, aside_m), deep_m * deep_m
        if self.is_covered and self._distance(aside, deep, across, along) > _SURPRISING:
            across += _COVERED_M * _COVERED_M
            along += (_COVERED_SHARE * self.range_m) ** 2
        if self._distance(aside, deep, across, along) > _SURPRISING:
            # Raise the noise until the innovation is plausible, and no further: with the full noise
            # a small change of speed would count as a large one, and the velocity would overshoot
            # by as much as it had lagged behind. The change may have happened at any time since the
            # last detection: after a long gap, an offset says less about the present velocity.
            accel, most = max(self._accel_m_s2, self._noise.quiet_m_s2), self._noise.lively_m_s2
            while accel < most and self._distance(aside, deep, across, along) > _EXPECTED:
                before, accel = accel, min(2.0 * accel, most)
                more = sqrt(accel * accel - before * before)
                self.across = self.across.with_noise(more, self._unseen_s)
                self.along = self.along.with_noise(more, self._unseen_s)
            self._accel_m_s2 = accel
        self._unseen_s = 0.0
        of_p, of_v, self.across = self.across.measured(0, across)
        along_p, along_v, self.along = self.along.measured(0, along)
        self.v_m_s = add(self.v_m_s, add(scale(aside_m, of_v), scale(self.view, along_v * deep_m)))
        self._move(scale(aside_m, of_p), along_p * deep_m)

    def _distance(self, aside: float, deep: float, across: float, along: float) -> float:
        """Return the squared Mahalanobis distance of an innovation.

        Args:
            aside: squared innovation across the view.
            deep: squared innovation along the view.
            across: variance of the measurement across the view.
            along: variance of the measurement along the view.
        """
        return aside / (self.across.p + across) + deep / (self.along.p + along)

    def correct_velocity(
        self, p_m: Vec3, v_m_s: Vec3, across_sd_m_s: float, along_sd_m_s: float
    ) -> None:
        """Update with a velocity that was measured at a position, and its standard deviations.

        A camera measures an angle and a relative growth per second: at a range other than the
        measured one they correspond to another speed.
        """
        view, range_m = view_and_range(p_m, self._camera)
        at = self.range_m / range_m
        along = dot(v_m_s, view)
        v, here = scale(sub(v_m_s, scale(view, along)), at), self.view
        other = sub(v, self.v_m_s)
        off = sub(other, scale(here, dot(other, here)))
        deep = at * along - dot(self.v_m_s, here)
        of_p, of_v, self.across = self.across.measured(1, (at * across_sd_m_s) ** 2)
        along_p, along_v, self.along = self.along.measured(1, (at * along_sd_m_s) ** 2)
        self.v_m_s = add(self.v_m_s, add(scale(off, of_v), scale(here, along_v * deep)))
        self._move(scale(off, of_p), along_p * deep)

    def slow_to(self, most_m_s: float) -> None:
        """Limit the speed."""
        speed = norm(self.v_m_s)
        if speed > most_m_s:
            self.v_m_s = scale(self.v_m_s, most_m_s / speed)

    def _place(self, p_m: Vec3) -> None:
        """Set the position, no nearer than the least distance."""
        way = sub(p_m, self._camera)
        ahead = dot(way, self.view)
        if ahead < NEAREST_M and norm(sub(way, scale(self.view, ahead))) < NEAREST_M:
            p_m = add(self._camera, scale(self.view, NEAREST_M))  # not behind the camera
        self.p_m = p_m
        self.view, self.range_m = view_and_range(p_m, self._camera)

    def _move(self, across_m: Vec3, along_m: float) -> None:
        """Move it on the sphere around the camera and along the view; its velocity turns with it.

        The velocity across the view is preserved as an angle per second, the velocity along it as a
        fraction of the range per second.
        """
        here, range_m = self.view, self.range_m
        aside = norm(across_m)
        angle = aside / range_m
        if angle > _TINY_RAD:
            way = scale(across_m, 1.0 / aside)
            c, s = cos(angle), sin(angle)
            there, onward = add(scale(here, c), scale(way, s)), sub(scale(way, c), scale(here, s))
            v = self.v_m_s
            seen, gone = dot(v, here), dot(v, way)
            self.v_m_s = add(v, add(scale(sub(there, here), seen), scale(sub(onward, way), gone)))
            self.view = here = there
        if along_m != 0.0:
            step = min(max(along_m / range_m, -_LARGEST_LOG_STEP), _LARGEST_LOG_STEP)
            range_m = max(NEAREST_M, range_m * exp(step))
            grown = range_m / self.range_m
            self.v_m_s = scale(self.v_m_s, grown)
            self.across = Variances(*scale(self.across, grown * grown))
            self.along = Variances(*scale(self.along, grown * grown))
            self.range_m = range_m
        self.p_m = add(self._camera, scale(here, range_m))


def view_and_range(p_m: Vec3, p_camera_m: Vec3) -> tuple[Vec3, float]:
    """Return the direction of a position and its distance, at least NEAREST_M."""
    x, y, z = p_m[0] - p_camera_m[0], p_m[1] - p_camera_m[1], p_m[2] - p_camera_m[2]
    far = sqrt(x * x + y * y + z * z)
    if far == 0.0:
        return (1.0, 0.0, 0.0), NEAREST_M
    return (x / far, y / far, z / far), max(far, NEAREST_M)
