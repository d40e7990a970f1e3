"""Prediction of a target's motion over the age of its frame and beyond.

A frame is some 75 ms old when it is used. Extrapolation of its velocity over that time overshoots
whenever the target reverses: by 10 % of a swing at 1 Hz, by 30 % at 1.5 Hz. So the velocity's own
rate of change is extrapolated too, and motion that repeats is predicted from its period, as people
do after one or two cycles (Barnes 2008): a sine is fitted to the past frames, and used while it
agrees with new ones.

World frame, metres, seconds; everything is a function of the given frames and of the time.
"""

from collections import deque
from itertools import islice
from math import cos, exp, pi, sin, sqrt
from typing import NamedTuple

import numpy as np

from gazerig.gaze.angles import add, dot, norm, scale, sub
from gazerig.gaze.types import AWAY, Floats, Target, Vec3

_STILL: Vec3 = (0.0, 0.0, 0.0)
_HORIZON_S, _FADE_S = 0.12, 0.3
"""Longest time over which motion is extrapolated, and time constant of its decay after that."""
_SLOPE_FRAMES = 6
"""Frames over which a change of velocity is measured."""
_BENDS_S = 0.12
"""Longest time over which a change of velocity is extrapolated."""
_WINDOWS_S = (0.7, 1.2, 2.2, 4.0)
"""Windows of the past in which a period is sought, the shortest first."""
_IN_TURN_S = (0.7, 1.2, 0.7, 2.2, 0.7, 4.0)
_CYCLES = (0.95, 2.3)
"""Number of cycles in a window for which its period counts."""
_LEAST_M = 0.015
"""Least amplitude of a predicted swing."""
_FITS, _STILL_FITS = 0.2, 0.35
"""Largest deviation from the sine, as a share of its effective value, to begin and to continue."""
_HARMONIC = 0.07
"""Largest third harmonic of a swing, as a share of it; that of a motion to and fro at one speed is
a ninth, and a sine would be ahead of that."""
_FASTEST_IN_S = 0.5
"""Past time whose highest speed limits all extrapolated speeds."""
_FITTED_FOR_S = 0.09
"""Interval of fits to a swing, which is every third frame."""
_SPARSE = 4
"""Every n-th frame is used for the extent of a target's motion."""
_GAP_S = 0.2
"""Frames farther apart than this do not belong to one motion."""
_REMEMBERED_S = 2.0
"""Time for which a swing is remembered while the gaze is on another target."""


_Seen = tuple[float, float, float, float, float, float, float]
"""Time of a frame, and the target's position and velocity in it."""


class Sine(NamedTuple):
    """A swing about a centre: p(t) = middle + c cos(w (t - at)) + s sin(w (t - at))."""

    at_s: float
    w_rad_s: float
    middle: Vec3
    c: Vec3
    s: Vec3

    @property
    def size_m(self) -> float:
        """Return the amplitude; of a swing along an ellipse, that of both axes together."""
        return sqrt(norm(self.c) ** 2 + norm(self.s) ** 2)

    def offset(self, t_s: float) -> Vec3:
        """Return the position relative to the middle."""
        a = self.w_rad_s * (t_s - self.at_s)
        return add(scale(self.c, cos(a)), scale(self.s, sin(a)))

    def velocity(self, t_s: float) -> Vec3:
        """Return the velocity."""
        a, w = self.w_rad_s * (t_s - self.at_s), self.w_rad_s
        return add(scale(self.c, -w * sin(a)), scale(self.s, w * cos(a)))


class TargetPrediction:
    """Prediction of the present target: from its velocity, its change, and its swing.

    sine: the recognised swing, None without one
    """

    def __init__(self) -> None:
        self.retune(True, 0.0)
        self.reset()

    def retune(self, predicts: bool, lag_s: float) -> None:
        """Use other parameters; the past frames are kept.

        predicts: False: a target is where it was in its frame
        lag_s: delay of the eyes, by which a swing is anticipated: its future is known
        """
        self._predicts, self._lag_s = predicts, lag_s

    def reset(self) -> None:
        """Forget the past frames."""
        self._id = ("", -1)
        self._at_s, self._p, self._v = 0.0, _STILL, _STILL
        self._past: deque[_Seen] = deque()
        # Times and speeds of the fastest frame, of the fastest one after it, and so on.
        self._fastest_past: deque[tuple[float, float]] = deque()
        self._bend, self._share = _STILL, 1.0
        self._most_m_s = 0.0
        self.sine: Sine | None = None
        self._left: dict[tuple[str, int], Sine] = {}
        self._turn = 0

    def _begin(self, identity: tuple[str, int], at_s: float) -> None:
        """Begin with another target, or with the same after a gap; its swing may be known."""
        if self.sine is not None:
            self._left[self._id] = self.sine
        self._left = {k: s for k, s in self._left.items() if at_s - s.at_s < _REMEMBERED_S}
        self._id, self.sine = identity, self._left.pop(identity, None)
        self._past.clear()
        self._fastest_past.clear()
        self._bend = _STILL

    def record_target(self, target: Target, eye: Vec3, fastest_rad_s: float) -> None:
        """Record the target; a known frame changes nothing.

        eye: position of the eye
        fastest_rad_s: a swing that is faster from there is followed with a smaller amplitude, and
            no motion is extrapolated faster
        """
        at_s, centre = target.at_s, target.centre_world_m
        if at_s == self._at_s and (target.kind, target.id) == self._id:
            return
        p, v = target.p_world_m if centre is None else centre, target.v_world_m_s
        gap_s = at_s - self._at_s
        if (target.kind, target.id) != self._id or not 0.0 < gap_s < _GAP_S:
            self._begin((target.kind, target.id), at_s)
        past = self._past
        if past and dot(v, past[-1][4:]) < 0.0:
            v = limit_length(v, self._most_m_s)  # the estimate overshoots in a reversal
        self._at_s, self._p, self._v = at_s, p, v
        self._share = 1.0
        most_m_s, speed_m_s = fastest_rad_s * norm(sub(p, eye)), norm(v)
        self._most_m_s = min(speed_m_s, most_m_s)
        if not self._predicts or target.id < 0 or target.kind == AWAY:
            self._bend, self.sine = _STILL, None
            return
        past.append((at_s, *p, *v))
        while past[0][0] < at_s - _WINDOWS_S[-1]:
            past.popleft()
        self._bend = self._past_slope()
        fastest = self._fastest_past
        while fastest and fastest[-1][1] <= speed_m_s:
            fastest.pop()
        fastest.append((at_s, speed_m_s))
        while fastest[0][0] <= at_s - _FASTEST_IN_S:
            fastest.popleft()
        self._most_m_s = min(fastest[0][1], most_m_s)
        self.sine = sine = self._recognise(p, at_s)
        if sine is not None:
            most_m_s = fastest_rad_s * norm(sub(sine.middle, eye))
            self._share = min(1.0, most_m_s / (sine.w_rad_s * sine.size_m))

    def displacement(self, t_s: float) -> Vec3:
        """Return the displacement of the target since its frame."""
        return self.motion(t_s)[0]

    def motion(self, t_s: float) -> tuple[Vec3, Vec3]:
        """Return the displacement of the target since its frame, and its velocity."""
        if not self._predicts:
            return _STILL, self._v
        age_s = max(0.0, t_s - self._at_s)
        if age_s <= _HORIZON_S:
            return self._motion_at(age_s)
        moved, speed = self._motion_at(_HORIZON_S)
        left = exp(-(age_s - _HORIZON_S) / _FADE_S)
        beyond = scale(speed, _FADE_S * (1.0 - left))
        return add(moved, beyond), scale(speed, left)

    @property
    def to_middle(self) -> Vec3 | None:
        """Return the vector from the target's position in its frame to the middle of its swing."""
        return None if self.sine is None else scale(self.sine.offset(self._at_s), -1.0)

    @property
    def size_m(self) -> float:
        """Return the amplitude of the recognised swing, 0 without one."""
        return 0.0 if self.sine is None else self.sine.size_m

    def _motion_at(self, age_s: float) -> tuple[Vec3, Vec3]:
        """Return displacement and velocity an age after the frame."""
        if (sine := self.sine) is not None:
            ahead_s = self._at_s + age_s + self._lag_s
            there = scale(sine.offset(ahead_s), self._share)
            moved = sub(there, sine.offset(self._at_s))
            return moved, scale(sine.velocity(ahead_s), self._share)
        bent = min(age_s, _BENDS_S)
        more = bent * (age_s - 0.5 * bent)
        (x, y, z), (a, b, c) = self._v, self._bend
        moved = x * age_s + a * more, y * age_s + b * more, z * age_s + c * more
        speed = x + a * bent, y + b * bent, z + c * bent
        # No extrapolated change makes the target faster than it has been.
        return (
            limit_length(moved, self._most_m_s * age_s),
            limit_length(speed, self._most_m_s),
        )

    def _past_slope(self) -> Vec3:
        """Return the rate at which the velocity has changed over the last frames."""
        past = self._past
        if len(past) < _SLOPE_FRAMES:
            return _STILL
        last = [past[k] for k in range(-_SLOPE_FRAMES, 0)]
        mean_s = sum([seen[0] for seen in last]) / _SLOPE_FRAMES
        total = x = y = z = 0.0
        for t, _, _, _, vx, vy, vz in last:
            w = t - mean_s
            total += w * w
            x, y, z = x + w * vx, y + w * vy, z + w * vz
        return x / total, y / total, z / total

    def _recognise(self, p: Vec3, at_s: float) -> Sine | None:
        """Return the swing of the recent past, None without one."""
        sine = self.sine
        if sine is None:
            if not self._has_moved(2.0 * _LEAST_M):
                return None
            # One window per frame, cyclically.
            self._turn = (self._turn + 1) % len(_IN_TURN_S)
            window_s = _IN_TURN_S[self._turn]
        else:
            if norm(sub(p, add(sine.middle, sine.offset(at_s)))) > 0.5 * sine.size_m:
                return None  # it has stopped, or moved in another direction
            if at_s - sine.at_s < _FITTED_FOR_S:
                return sine
            period_s = 2.0 * pi / sine.w_rad_s
            window_s = next((w for w in _WINDOWS_S if w >= period_s), _WINDOWS_S[-1])
        if at_s - self._past[0][0] < 0.95 * window_s:
            return sine
        since_s = at_s - window_s
        past = np.array([seen for seen in self._past if seen[0] > since_s])
        return fit_sine(past, at_s, _FITS if sine is None else _STILL_FITS)

    def _has_moved(self, least_m: float) -> bool:
        """Return whether the target's positions span this length along any axis."""
        _, x, y, z, *_ = zip(*islice(self._past, 0, None, _SPARSE), strict=True)  # as in _Seen
        return bool(max(max(x) - min(x), max(y) - min(y), max(z) - min(z)) >= least_m)


def limit_length(v: Vec3, most: float) -> Vec3:
    """Return a vector, shortened if it is longer than a limit."""
    x, y, z = v
    squares = x * x + y * y + z * z
    return v if squares <= most * most else scale(v, most / sqrt(squares))


def fit_sine(past: Floats, at_s: float, limit: float) -> Sine | None:
    """Return the sine of a window of the past, None if it does not fit.

    The frequency comes from the velocity, which changes by -w^2 times the time integral of the
    offset: one number for all axes, and no derivative of noisy data.

    Args:
        past: (n, 7) time, position and velocity of each frame.
        at_s: time of the newest frame.
        limit: largest deviation, as a share of the sine's effective value.
    """
    t, p, v = past[:, 0] - at_s, past[:, 1:4], past[:, 4:7]
    if len(t) < 8:
        return None
    n = len(t)
    steps = (t[1:] - t[:-1])[:, None]
    both = np.zeros((n, 6))
    both[:, 3:] = v
    area, speed = both[:, :3], both[:, 3:]
    # The trapezia corrected by the velocities at their ends, as a cubic's area is.
    pieces = 0.5 * steps * (p[1:] + p[:-1]) - steps * steps / 12.0 * (v[1:] - v[:-1])
    np.add.accumulate(pieces, axis=0, out=area[1:])
    both -= np.add.reduce(both, axis=0) / n
    since = t - np.add.reduce(t) / n
    both -= since[:, None] * (since @ both / (since @ since))
    power = float((area * area).sum())
    w2 = -float((area * speed).sum()) / power if power > 0.0 else 0.0
    if w2 <= 0.0:
        return None
    w = sqrt(w2)
    cycles = -float(t[0]) * w / (2.0 * pi)
    if not _CYCLES[0] <= cycles <= _CYCLES[1]:
        return None
    base = np.ones((n, 3))
    base[:, 1], base[:, 2] = np.cos(w * t), np.sin(w * t)
    x = np.linalg.solve(base.T @ base, base.T @ p)
    swing = float((x[1:] ** 2).sum())
    rest = p - base @ x
    off = float((rest * rest).sum()) / n
    if swing < _LEAST_M * _LEAST_M or off > limit * limit * 0.5 * swing:
        return None
    third = np.column_stack((np.cos(3.0 * w * t), np.sin(3.0 * w * t)))
    x3 = np.linalg.solve(third.T @ third, third.T @ rest)
    if float((x3**2).sum()) > _HARMONIC * _HARMONIC * swing:
        return None
    m, c, s = ((row[0], row[1], row[2]) for row in x.tolist())
    return Sine(at_s, w, m, c, s)
