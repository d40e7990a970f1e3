"""Eye control between gaze shifts from two papers: binocular controller, and opposite angles.

The binocular controller does pursuit, vergence and vestibulo-ocular reflex of both eyes.

Zhang & Wakamatsu's controller, which Mitake et al. 3.3.5 and the profile mitake use; its gains are
not public, its structure is. The sum of both eyes is controlled by a conjugate channel, their
difference by a vergence channel with its own dynamics. A frame gives the target's position in space
at its exposure (efference copy), which is smoothed and compared with the present gaze, so that no
delay remains in the loop:

    w = d(S_f)/dt,  u_c = Gp sat(w) + Kc sat(S_f - G),  u_d = Kd (V_demand - V)

S_f: smoothed direction of the target, G: direction of the gaze, V: vergence. The reflex turns
the eyes against the head, by the inverse of its rotation and not by opposite angles, which err
by degrees. Directions are unit vectors in the world, so that a channel needs no axes.

tests/reference has the same controller in angles of one axis, with two covered eyes and with
feedback of the delayed error alone; both are tested against the same numbers.
"""

from collections import deque
from collections.abc import Callable
from math import exp, radians, sqrt, tan
from typing import NamedTuple, Protocol

from gazerig.gaze.angles import (
    add,
    direction,
    keep_min_distance,
    norm,
    rotate,
    rotate_back,
    scale,
    sub,
    unit,
    yaw_pitch,
)
from gazerig.gaze.types import Angles2, Mat3, Target, Vec3

Eyes = tuple[Angles2, Angles2]
"""(yaw, pitch) of the left and right eye in the head, rad."""

_STRAIGHT: Vec3 = (1.0, 0.0, 0.0)
_NONE: Vec3 = (0.0, 0.0, 0.0)
NEAREST_M, _FARTHEST_M = 0.2, 100.0
"""Distances between which the eyes converge; the nearer one is 17.6 deg of vergence."""
_LOST_S = 0.04
"""A moving target without a frame for this time counts as not visible until the next one."""

GAIN_1_S, VELOCITY_GAIN = 8.0, 0.95
"""Rate Kc at which the position error is closed, and gain Gp, the share of the target's velocity
that the eye adopts; people's is .95."""
VERGENCE_GAIN_1_S, DIVERGENCE_GAIN_1_S = 4.0, 3.0
"""Rate Kd at which the error in depth is closed, and Kdiv if the target is farther away."""
MAX_RAD_S, REJECT_RAD_S = radians(58.0), radians(100.0)
"""Fastest smooth pursuit, people's is 63 deg/s; a target reported as faster than the second is
taken as a jump and not pursued."""
MAX_ERROR_RAD = radians(5.0)
"""The rate of closing applies to at most this error; larger errors are closed no faster."""
DELAY_S, _SMOOTH_S, _VERGENCE_DELAY_S = 0.1, 0.04, 0.06
"""Visual delay tau_c, including the age of a frame, smoothing time Tf of the observed direction,
and the additional delay of vergence."""
_WIDEST_RAD = radians(20.0)
_REFLEX_DELAY_S = 0.01
"""Delay of the reflex, people's is 7 to 10 ms; its gain is 1."""
_LOST_FADE_S = 0.3
"""Decay time of the eyes' speed after the loss of the target."""


class MeanGaze(NamedTuple):
    """Both eyes as one direction in the head and the angle between them.

    ahead: unit vector in the head; vergence_rad: right yaw minus left yaw, positive if they meet
    """

    ahead: Vec3
    vergence_rad: float


class EyeGeometry(NamedTuple):
    """The head at the time when present commands take effect, and the limits of its eyes.

    eyes_on: returns the eye angles that fixate a point from a pose of the head
    in_range: returns eye angles clipped to their ranges
    """

    R_world_head: Mat3
    p_head: Vec3
    eyes_on: Callable[[Vec3, Mat3, Vec3], Eyes]
    in_range: Callable[[Eyes], Eyes]

    def eyes_to(self, point: Vec3) -> Eyes:
        """Return the eye angles that fixate a point."""
        point = keep_min_distance(point, self.p_head, NEAREST_M)
        return self.eyes_on(point, self.R_world_head, self.p_head)


class SaccadeState(Protocol):
    """Pending saccades (gazerig.gaze.oculomotor.saccade_trigger)."""

    @property
    def is_saccade_due(self) -> bool:
        """Return whether the saccade to a new target has not started yet."""
        ...

    @property
    def is_correction_due(self) -> bool:
        """Return whether an error is pending for a corrective saccade."""
        ...


def mean_gaze_of(eyes: Eyes) -> MeanGaze:
    """Return the mean direction and the vergence of two eyes."""
    (left_yaw, left_pitch), (right_yaw, right_pitch) = eyes
    mean = 0.5 * (left_yaw + right_yaw), 0.5 * (left_pitch + right_pitch)
    return MeanGaze(direction(mean), right_yaw - left_yaw)


class DelayedSight:
    """Position of a target a fixed delay ago, from irregular and late frames."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget all frames."""
        self._frames: deque[tuple[float, Vec3, Vec3]] = deque()
        self._shift = -1

    def position_at(self, target: Target, t_s: float) -> Vec3 | None:
        """Return the target's position at a past time; None if it was not visible at that time.

        A new target is known immediately, as it must have been seen to be chosen.
        """
        frames = self._frames
        if target.shift != self._shift:
            self._shift = target.shift
            frames.clear()
        if not frames or target.at_s > frames[-1][0]:
            frames.append((target.at_s, target.p_world_m, target.v_world_m_s))
        while len(frames) > 1 and frames[1][0] <= t_s + 1e-9:
            frames.popleft()
        at_s, p, v = frames[0]
        if v == _NONE:
            return p
        return None if t_s - at_s > _LOST_S else add(p, scale(v, t_s - at_s))


class BinocularController:
    """Controls both eyes between saccades.

    sight: position of the target a delay ago
    version: commanded direction of the eyes; started: whether it has been set since the reset
    """

    def __init__(self) -> None:
        self.sight = DelayedSight()
        self.reset()

    def reset(self) -> None:
        """Forget target and head; the eyes begin at the angles of ``hold``, or straight ahead."""
        self.version = MeanGaze(_STRAIGHT, 0.0)
        self.started = False
        self.sight.reset()
        self._seen: Vec3 | None = None
        self._known = False
        self._smoothed, self._velocity = _NONE, _NONE
        self._heads: deque[tuple[float, Mat3]] = deque()
        self._opposed: Mat3 | None = None
        self._demands: deque[tuple[float, float]] = deque()

    def fixate(
        self,
        target: Target,
        gaze: Vec3,
        prescribed: Eyes | None,
        saccades: SaccadeState,
        view: EyeGeometry,
        t_s: float,
        dt_s: float,
    ) -> tuple[Eyes, Vec3]:
        """Return the eye angles for the next period, and the point that they fixate.

        gaze: the point fixated so far, or that a saccade prescribes
        prescribed: eye angles of a saccade; None: no saccade is in flight
        """
        place = self.sight.position_at(target, t_s - DELAY_S)
        seen = None if place is None else view.eyes_to(place)
        if prescribed is not None or dt_s <= 0.0 or not self.started:
            eyes = view.eyes_to(gaze) if prescribed is None else prescribed
            self.adopt(eyes, seen, view.R_world_head, t_s)
            return eyes, gaze
        if saccades.is_saccade_due:
            seen = None
        eyes = self.step(seen, view.R_world_head, t_s, dt_s, not saccades.is_correction_due)
        p_head, ahead = view.p_head, rotate(view.R_world_head, self.version.ahead)
        one_m = view.eyes_to(add(p_head, ahead))
        distance = self.distance_m(one_m, norm(sub(target.p_world_m, p_head)))
        return eyes, add(p_head, scale(ahead, max(distance, NEAREST_M)))

    def adopt(self, eyes: Eyes, target: Eyes | None, R_world_head: Mat3, t_s: float) -> None:
        """Adopt the angles that a saccade prescribes; the target's velocity is kept.

        target: eye angles that fixate the target as seen, from the present pose of the head
        """
        self.version, self.started = mean_gaze_of(eyes), True
        self._rotations(R_world_head, t_s)
        if target is not None:
            self._adopt_jump(rotate(R_world_head, mean_gaze_of(target).ahead))
            self._delayed_vergence_rad(mean_gaze_of(target).vergence_rad, t_s)

    def step(
        self, target: Eyes | None, R_world_head: Mat3, t_s: float, dt_s: float, closing: bool = True
    ) -> Eyes:
        """Return the angles of both eyes in the head for the next period.

        target: eye angles that fixate the target as seen, from the present pose of the head;
            None: not seen
        closing: whether the error of direction is closed; False leaves it to a saccade
        """
        ahead, vergence = self.version
        turned = self._rotations(R_world_head, t_s)
        if turned is not None:
            ahead = unit(rotate_back(turned[1], rotate(turned[0], ahead)))
        gaze = rotate(R_world_head, ahead)
        if target is None:
            self._known = False
            self._velocity = scale(self._velocity, exp(-dt_s / _LOST_FADE_S))
        else:
            seen, demand_rad = mean_gaze_of(target)
            self._follow(rotate(R_world_head, seen), dt_s)
        rate = scale(_clip(self._velocity, MAX_RAD_S), VELOCITY_GAIN)
        if target is not None:
            if closing:
                error = _clip(sub(self._smoothed, gaze), MAX_ERROR_RAD)
                rate = add(rate, scale(error, GAIN_1_S))
            past_rad = self._delayed_vergence_rad(demand_rad, t_s)
            if past_rad is not None:
                off = past_rad - vergence
                gain = VERGENCE_GAIN_1_S if off >= 0.0 else DIVERGENCE_GAIN_1_S
                vergence += gain * off * dt_s
        vergence = min(max(vergence, 0.0), _WIDEST_RAD)
        ahead = rotate_back(R_world_head, unit(add(gaze, scale(rate, dt_s))))
        self.version = MeanGaze(ahead, vergence)
        yaw, pitch = yaw_pitch(ahead)
        return (yaw - 0.5 * vergence, pitch), (yaw + 0.5 * vergence, pitch)

    def distance_m(self, one_m: Eyes, otherwise_m: float) -> float:
        """Return the distance at which both lines of sight meet.

        one_m: eye angles that fixate a point in the same direction 1 m away
        otherwise_m: distance for eyes that cannot converge
        """
        half_m = tan(0.5 * mean_gaze_of(one_m).vergence_rad)
        if half_m <= 0.0:
            return otherwise_m
        vergence = self.version.vergence_rad
        return min(half_m / tan(0.5 * vergence), _FARTHEST_M) if vergence > 0.0 else _FARTHEST_M

    def _rotations(self, R_world_head: Mat3, t_s: float) -> tuple[Mat3, Mat3] | None:
        """Return the head's rotations between which the reflex acts in this period.

        Both are those of a delay before the middle of a period, in which the eyes hold an angle.
        """
        heads, before = self._heads, self._opposed
        heads.append((t_s, R_world_head))
        while len(heads) > 1 and heads[1][0] <= t_s - _REFLEX_DELAY_S + 1e-9:
            heads.popleft()
        then = heads[0][1]
        self._opposed = _mean_rotation(then, heads[1][1]) if len(heads) > 1 else then
        return None if before is None else (before, self._opposed)

    def _delayed_vergence_rad(self, vergence_rad: float, t_s: float) -> float | None:
        """Return the vergence that the target required a delay ago, None before the first."""
        demands = self._demands
        demands.append((t_s, vergence_rad))
        due_s = t_s - _VERGENCE_DELAY_S + 1e-9
        while len(demands) > 1 and demands[1][0] <= due_s:
            demands.popleft()
        return demands[0][1] if demands[0][0] <= due_s else None

    def _adopt_jump(self, seen: Vec3) -> None:
        """Adopt a jump of the target, which does not count as velocity."""
        moved = _NONE if self._seen is None else sub(seen, self._seen)
        self._smoothed = seen if self._seen is None else add(self._smoothed, moved)
        self._seen, self._known = seen, True

    def _follow(self, seen: Vec3, dt_s: float) -> None:
        """Low-pass the direction of the target and differentiate it."""
        before = self._seen
        most = REJECT_RAD_S * dt_s
        if before is None or not self._known or norm(sub(seen, before)) > most:
            self._adopt_jump(seen)
        self._seen = seen
        kept = exp(-dt_s / _SMOOTH_S)
        smoothed = add(scale(self._smoothed, kept), scale(seen, 1.0 - kept))
        self._velocity = scale(sub(smoothed, self._smoothed), 1.0 / dt_s)
        self._smoothed = smoothed


def _clip(v: Vec3, most: float) -> Vec3:
    size = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    return v if size <= most else scale(v, most / size)


def _mean_rotation(a: Mat3, b: Mat3) -> Mat3:
    """Return the mean of two rotations that differ by little: those of two ticks."""
    x, y, z = (scale(add(p, q), 0.5) for p, q in zip(a, b, strict=True))
    return x, y, z


class OppositeAngles:
    """Eyes by the rules of Nakamoto & Tsuruno 3.4: shifts, and opposite angles between them.

    An eye turns towards its target only in a shift. Between shifts, a turn of the head by (x, y, z)
    turns it by (-x, -y, -z), the paper's vestibulo-ocular reflex. An eye whose target is beyond its
    range, 20 deg in the paper, does not shift at all; the reflex continues.

    Opposite angles are the inverse of a turn about one axis only: of a turn by 20 deg of yaw and
    10 of pitch they leave 0.7 deg. The next shift closes that; nothing else does.
    """

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Forget eyes and head; the eyes begin at the next fixated point."""
        self._eyes: Eyes | None = None
        self._head_rad: Angles2 = (0.0, 0.0)

    def fixate(
        self,
        target: Target,
        gaze: Vec3,
        prescribed: Eyes | None,
        saccades: SaccadeState,
        view: EyeGeometry,
        t_s: float,
        dt_s: float,
    ) -> tuple[Eyes, Vec3]:
        """Return the eye angles for the next period, and the point that they fixate.

        gaze: the point fixated so far, or that a shift prescribes
        prescribed: eye angles of a shift; None: no shift
        """
        R, before = view.R_world_head, self._head_rad
        self._head_rad = head = yaw_pitch((R[0][0], R[1][0], R[2][0]))
        wanted = view.eyes_to(gaze) if self._eyes is None else prescribed
        if wanted is not None and view.in_range(wanted) == wanted:
            self._eyes = wanted
            return wanted, gaze
        left, right = self._eyes or ((0.0, 0.0), (0.0, 0.0))
        if self._eyes is not None:
            left, right = opposite_angles(left, before, head), opposite_angles(right, before, head)
        self._eyes = left, right
        ahead = rotate(R, mean_gaze_of(self._eyes).ahead)
        return self._eyes, add(view.p_head, scale(ahead, norm(sub(target.p_world_m, view.p_head))))


def opposite_angles(eye_rad: Angles2, head_before_rad: Angles2, head_rad: Angles2) -> Angles2:
    """Return the eye angles of the rule (-x, -y), literally."""
    return (
        eye_rad[0] - (head_rad[0] - head_before_rad[0]),
        eye_rad[1] - (head_rad[1] - head_before_rad[1]),
    )
