"""Apparent speed of stationary things while the head turns: the residual of a wrong time or pose.

A frame placed by the head's pose at another time shifts all things by the head's speed times the
error in time. As the head's speed changes, the world seems to move with it: a fit of the observed
shifts to the changes of the head's speed yields that error. Both figures are 0 for a camera whose
time stamps, mounting and lens agree with the rig.

A thing counts as stationary only if it was still before a turn and is at the same position after
it. So while the head is still only the newest frame counts, as the last one before a possible turn:
it is stored as received, and evaluated when the head turns.
"""

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import degrees, inf
from statistics import median
from typing import NamedTuple

from gazerig.gaze.angles import compose, cross, dot, norm, sub, transpose, unit
from gazerig.gaze.types import Mat3, Vec3
from gazerig.robot.model.frames import NeckAngles

# Speeds above which the head turns, and below which it is still, rad/s.
_TURNS_RAD_S, _STANDS_RAD_S = 0.35, 0.09
# A thing that moved slower than this before a turn, and is within this distance after it, was
# still; a longer turn is ignored.
_STILL_M_S, _STILL_RAD, _LONGEST_S = 0.15, 0.02, 1.5
_SAMPLES = 90
_FORGET = 0.99


class ResidualFigures(NamedTuple):
    """Figures so far; None before a stationary thing was seen while the head turned.

    speed_deg_s: median apparent speed of stationary things
    late_ms: apparent age of frames beyond their time stamps; below 0: they are newer
    samples: number of pairs of frames in the median
    """

    speed_deg_s: float | None
    late_ms: float | None
    samples: int


class TrackedPoint(NamedTuple):
    """A tracked thing in one image: its position from this frame alone, and its velocity."""

    id: int
    p_world_m: Vec3
    v_world_m_s: Vec3


class _ResidualFrame(NamedTuple):
    """One frame as received.

    turn_rad_s: returns the angular velocity of the camera at the capture, along the world's axes
    """

    t_s: float
    turn_rad_s: Callable[[], Vec3]
    p_world_eye_m: Vec3
    seen: Sequence[TrackedPoint]


@dataclass(slots=True)
class _HeadTurn:
    """Apparent motion of one thing since the head was last still.

    shifts: (observed shift, shift per second of delay due to the head's change of speed, seconds
    between the frames, whether the head was turning)
    """

    since_s: float
    view: Vec3
    shifts: list[tuple[Vec3, Vec3, float, bool]] = field(default_factory=list)


class EgomotionResidual:
    """Collects the figures frame by frame."""

    def __init__(self) -> None:
        self._speeds: deque[float] = deque(maxlen=_SAMPLES)
        self._shift_by_turn = self._turn_by_turn = 0.0
        self._before: tuple[float, Vec3, dict[int, Vec3]] | None = None
        self._turns: dict[int, _HeadTurn] = {}
        self._stood = False  # in the frame before
        self._waiting: _ResidualFrame | None = None

    def step(
        self,
        t_s: float,
        turn_rad_s: Callable[[], Vec3],
        p_world_eye_m: Vec3,
        seen: Sequence[TrackedPoint],
        at_most_rad_s: float = inf,
    ) -> None:
        """Add one frame; times must increase.

        Args:
            t_s: time of the capture.
            turn_rad_s: returns the angular velocity of the camera at that time, in world axes.
            p_world_eye_m: position of the camera.
            seen: the things tracked in the frame.
            at_most_rad_s: rough upper bound of the camera's angular speed.
        """
        frame = _ResidualFrame(t_s, turn_rad_s, p_world_eye_m, seen)
        stands = at_most_rad_s < _STANDS_RAD_S
        if stands and self._stood:
            self._waiting = frame  # the stored frame neither starts nor ends a turn
            return
        if self._waiting is not None:
            self._evaluate(self._waiting)
            self._waiting = None
        self._evaluate(frame)
        self._stood = stands

    def _evaluate(self, frame: _ResidualFrame) -> None:
        """Compare the apparent positions of things with the frame evaluated before."""
        t_s, turn_rad_s, seen = frame.t_s, frame.turn_rad_s(), frame.seen
        views = {s.id: unit(sub(s.p_world_m, frame.p_world_eye_m)) for s in seen}
        before, self._before = self._before, (t_s, turn_rad_s, views)
        if before is None or t_s <= before[0]:
            return
        before_s, turn_before, views_before = before
        speed = norm(turn_rad_s)
        for id_ in views.keys() & views_before.keys() & self._turns.keys():
            shift = sub(views[id_], views_before[id_])
            change = cross(sub(turn_rad_s, turn_before), views[id_])
            self._turns[id_].shifts.append((shift, change, t_s - before_s, speed > _TURNS_RAD_S))
        if speed < _STANDS_RAD_S:
            self._use_turns(t_s, views, seen)

    def figures(self) -> ResidualFigures:
        """Return the figures."""
        if not self._speeds:
            return ResidualFigures(None, None, 0)
        late = self._shift_by_turn / self._turn_by_turn if self._turn_by_turn > 0.0 else 0.0
        return ResidualFigures(
            round(degrees(median(self._speeds)), 3), round(1e3 * late, 2), len(self._speeds)
        )

    def _use_turns(self, t_s: float, views: dict[int, Vec3], seen: Sequence[TrackedPoint]) -> None:
        """Use the turns of things that are at their former positions, and start new ones."""
        for id_ in sorted(views.keys() & self._turns.keys()):
            turn = self._turns[id_]
            same = norm(sub(views[id_], turn.view)) < _STILL_RAD
            if same and t_s - turn.since_s <= _LONGEST_S and any(s[3] for s in turn.shifts):
                for shift, change, dt_s, fast in turn.shifts:
                    self._shift_by_turn = _FORGET * self._shift_by_turn + dot(shift, change)
                    self._turn_by_turn = _FORGET * self._turn_by_turn + dot(change, change)
                    if fast:
                        self._speeds.append(norm(shift) / dt_s)
        self._turns = {
            s.id: _HeadTurn(t_s, views[s.id]) for s in seen if norm(s.v_world_m_s) < _STILL_M_S
        }


def rotation_rate_rad_s(R_before: Mat3, R_after: Mat3, dt_s: float) -> Vec3:
    """Return the angular velocity that turns one orientation into another, for small turns."""
    R = compose(R_after, transpose(R_before))
    half = 0.5 / dt_s
    return ((R[2][1] - R[1][2]) * half, (R[0][2] - R[2][0]) * half, (R[1][0] - R[0][1]) * half)


def turn_bound(before: NeckAngles, after: NeckAngles) -> float:
    """Return an upper bound of the head's turn between two poses of the neck."""
    (a, b, c), (d, e) = before[0], before[1]
    (f, g, h), (i, j) = after[0], after[1]
    return abs(f - a) + abs(g - b) + abs(h - c) + abs(i - d) + abs(j - e)
