"""Saccades in a trace of gaze directions, found sample by sample by their speed.

The speed is that of Engbert & Kliegl 2003, a central difference over five samples, taken
relative to the slow motion of the last 50 ms, so that following a person who walks by is no
saccade. 30 deg/s beyond that is the usual threshold of velocity-based detection (I-VT).
"""

from collections import deque
from math import degrees, exp, inf, sqrt
from typing import NamedTuple

from gazerig.gaze.angles import angle_between
from gazerig.gaze.types import Vec3

THRESHOLD_DEG_S = 30.0
"""Relative speed that makes a saccade; one servo step of both eyes in a tick is half of it."""

LEAST_DEG = 0.5
"""Smaller ones cannot be told from steps of the encoders."""

_FOOT_SHARE, _FOOT_DEG_S = 0.1, 10.0
"""A saccade reaches as far as it is faster than this share of its peak, and than this."""

_TOP_SHARE = 0.9
"""The peak's time is the middle of what is faster than this share: a capped peak is flat."""

_SWING_SHARE, _AGAIN_SHARE = 0.35, 0.5
"""A minimum below this share of the peak is the landing, even while a servo swings back (the
glissade of Nystroem & Holmqvist 2010); what is then faster than the other is a saccade again."""

_SETTLING_S = 0.15

_SLOW_S = 0.05
_FARTHEST_S = 0.022
"""Neighbours farther away in time do not tell the speed of a saccade."""

_NEAREST_S = 0.0035
"""Samples that come faster are left out: their differences are but steps of the encoder."""

_GAP_S = 0.06
_LONGEST_S = 0.4
_KEPT = 160


class Jump(NamedTuple):
    """One saccade in a trace.

    peak_at: share of the duration at which it was fastest
    mean_deg_s: amplitude over duration; from_world, to_world: unit directions
    """

    onset_s: float
    duration_s: float
    amplitude_deg: float
    peak_deg_s: float
    peak_at: float
    from_world: Vec3
    to_world: Vec3

    @property
    def mean_deg_s(self) -> float:
        """Return the mean speed."""
        return self.amplitude_deg / self.duration_s


class _Sample(NamedTuple):
    t_s: float
    way: Vec3


class _Speed(NamedTuple):
    """One sample with its speed.

    velocity_1_s: of the unit vector, smoothed; relative_deg_s: what it is beyond the slow
    motion; sharp_deg_s: speed over three samples only, for the peak
    """

    t_s: float
    way: Vec3
    velocity_1_s: Vec3
    relative_deg_s: float
    sharp_deg_s: float


class SaccadeFinder:
    """Finds saccades in a sequence of gaze directions; each is returned when it has ended."""

    def __init__(self) -> None:
        self.under_way = False
        self.clear()

    def clear(self) -> None:
        """Forget the trace: there was a gap."""
        self._samples: deque[_Sample] = deque(maxlen=5)
        self._speeds: deque[_Speed] = deque(maxlen=_KEPT)
        self._slow: Vec3 = (0.0, 0.0, 0.0)
        self._peak_deg_s = 0.0
        self._before_deg_s = 0.0
        self._began_s = 0.0
        self._barrier_s = -inf
        self._settles_s: float | None = None
        self.under_way = False

    def update(self, t_s: float, way: Vec3) -> Jump | None:
        """Add a unit direction in the world; return the saccade that has just ended, if any."""
        samples = self._samples
        if samples:
            since_s = t_s - samples[-1].t_s
            if since_s > _GAP_S or since_s < 0.0:
                self.clear()
                samples = self._samples
            elif since_s < _NEAREST_S:
                return None
        samples.append(_Sample(t_s, way))
        if len(samples) < 5:
            return None
        speed = self._speed()
        self._speeds.append(speed)
        return self._judge(speed)

    def _speed(self) -> _Speed:
        """Return the speed at the middle sample, and learn the slow motion from it."""
        a, b, c, d, e = self._samples
        (bx, by, bz), (dx, dy, dz) = b.way, d.way
        sharp_s = d.t_s - b.t_s
        x, y, z = (dx - bx), (dy - by), (dz - bz)
        sharp = sqrt(x * x + y * y + z * z) / sharp_s
        over_s = sharp_s
        if e.t_s - a.t_s < 2.0 * _FARTHEST_S:
            (ax, ay, az), (ex, ey, ez) = a.way, e.way
            x, y, z = x + ex - ax, y + ey - ay, z + ez - az
            over_s += e.t_s - a.t_s
        vx, vy, vz = x / over_s, y / over_s, z / over_s
        sx, sy, sz = self._slow
        rx, ry, rz = vx - sx, vy - sy, vz - sz
        relative = degrees(sqrt(rx * rx + ry * ry + rz * rz))
        if not self.under_way and relative <= THRESHOLD_DEG_S:
            share = 1.0 - exp(-0.5 * sharp_s / _SLOW_S)
            self._slow = (sx + share * rx, sy + share * ry, sz + share * rz)
        return _Speed(c.t_s, c.way, (vx, vy, vz), relative, degrees(sharp))

    def _judge(self, speed: _Speed) -> Jump | None:
        """Follow the three states: at rest, in flight, and settling after a landing."""
        now, before = speed.relative_deg_s, self._before_deg_s
        self._before_deg_s = now
        if self._settles_s is not None:
            long = speed.t_s - self._settles_s > _SETTLING_S
            if now < THRESHOLD_DEG_S or long:
                self._settles_s, self.under_way = None, False
                if long:
                    self._follow(speed)
                return None
            if now <= _AGAIN_SHARE * self._peak_deg_s:
                return None
            self._settles_s = None
        elif self.under_way:
            return self._fly(speed, before)
        if now > THRESHOLD_DEG_S:
            self.under_way = True
            self._peak_deg_s, self._began_s = now, speed.t_s
        return None

    def _fly(self, speed: _Speed, before_deg_s: float) -> Jump | None:
        """Wait for the landing: the speed is low, or has a minimum before the eye swings back."""
        now = speed.relative_deg_s
        # Relative to the peak until now: a saccade is slow at its beginning, too.
        swings = before_deg_s < _SWING_SHARE * self._peak_deg_s and now > before_deg_s
        self._peak_deg_s = max(self._peak_deg_s, now)
        if now < self._foot() or swings:
            jump = self._jump(len(self._speeds) - (1 if swings else 0))
            self._barrier_s = jump.onset_s + jump.duration_s
            self.under_way = now > THRESHOLD_DEG_S
            self._settles_s = speed.t_s if self.under_way else None
            return jump if jump.amplitude_deg >= LEAST_DEG else None
        if speed.t_s - self._began_s > _LONGEST_S:
            self._follow(speed)
        return None

    def _follow(self, speed: _Speed) -> None:
        """Treat motion that lasts too long for a saccade as slow motion."""
        self.under_way, self._slow, self._barrier_s = False, speed.velocity_1_s, speed.t_s

    def _foot(self) -> float:
        return max(_FOOT_SHARE * self._peak_deg_s, _FOOT_DEG_S)

    def _jump(self, end: int) -> Jump:
        """Measure the saccade that was over with the last of the first ``end`` speeds."""
        foot, speeds = self._foot(), self._speeds
        first = end - 1
        while first > 0 and speeds[first - 1].t_s >= self._barrier_s:
            first -= 1
            if speeds[first].relative_deg_s < foot and speeds[first].t_s < self._began_s:
                break
        part = [speeds[i] for i in range(first, end)]
        onset_s, end_s = _crossing(part[0], part[1], foot), _crossing(part[-1], part[-2], foot)
        inner = part[1:-1] or part
        peak = max(speed.sharp_deg_s for speed in inner)
        top = [speed.t_s for speed in inner if speed.sharp_deg_s >= _TOP_SHARE * peak]
        duration_s = end_s - onset_s
        return Jump(
            onset_s,
            duration_s,
            degrees(angle_between(part[0].way, part[-1].way)),
            peak,
            (0.5 * (top[0] + top[-1]) - onset_s) / duration_s,
            part[0].way,
            part[-1].way,
        )


def _crossing(below: _Speed, above: _Speed, level: float) -> float:
    """Return when the speed passed a level between two samples."""
    span = above.relative_deg_s - below.relative_deg_s
    share = (level - below.relative_deg_s) / span if span > 0.0 else 0.0
    return below.t_s + min(1.0, max(0.0, share)) * (above.t_s - below.t_s)
