"""Motion of a person's hips and feet over a round: walks, steps, turns, sitting down, standing up.

A planted foot does not move. It is planted below the later position of the hips in the middle of
its stance, and moves to its next place while the other foot is planted. Not modelled: running,
stairs.
"""

from collections.abc import Mapping, Sequence
from math import atan2, ceil, degrees
from typing import NamedTuple

import numpy as np

from gazerig.features.world.measures import Measures
from gazerig.features.world.room import (
    SEAT_AHEAD_M,
    WALK_ENDS_S,
    WALK_STARTS_S,
    Place,
    standing_point,
    way_points,
)
from gazerig.features.world.time_profiles import moving_average, smooth_bump, smooth_rise
from gazerig.gaze.types import Floats
from gazerig.sim_mock.scenes.timeline import TimedAct

RATE_HZ = 100.0
"""Rows per second of all tables of motion."""

_STRIDE_S, _SWING_SHARE = 0.52, 0.82
_PATH_S, _HEADING_S = 0.6, 1.5
_MIDDLE = 1.0 + 0.5 * _SWING_SHARE
"""Steps from the lifting of a foot to the middle of its next stance."""
_LIFT_M = 0.06
_SAME_M = 1e-4
_BOX_STANCE_M, _BOX_OUT_RAD = 0.16, 0.35


class BasePose(NamedTuple):
    """Hips and feet of a person, one row per time; heights above the floor.

    hips_m: (n, 2) on the floor; heading_rad: (n,) unwrapped; seated: (n,) 0 standing .. 1 sitting
    seat_m: (n,) height of the seat in use; feet_m: (n, 2, 3) ankle positions with z the height of
        a lifted foot; feet_rad: (n, 2) direction of the toes; left first
    """

    hips_m: Floats
    heading_rad: Floats
    seated: Floats
    seat_m: Floats
    feet_m: Floats
    feet_rad: Floats


class _Path:
    """The path of the hips, filled act by act."""

    def __init__(self, t_s: Floats, start: Place, places: Mapping[str, Place]) -> None:
        self.t_s, self.places, self.at = t_s, places, start
        rows = len(t_s)
        self.way = np.tile(standing_point(start), (rows, 1))
        self.heading = np.full(rows, start.facing_rad)
        self.seated = np.full(rows, 0.0 if start.seat_m is None else 1.0)
        self.seat_m = np.full(rows, start.seat_m or 0.0)
        self.stretches: list[tuple[float, float]] = []  # begin and end of steps, s

    def add(self, one: TimedAct) -> None:
        """Add an act that moves hips or feet."""
        act, start_s, end_s = one.act, one.start_s, one.end_s
        rows = self.t_s >= start_s
        share = smooth_rise((self.t_s - start_s) / (end_s - start_s))
        if act.do in ("sit", "stand"):
            self.seated[rows] = (share if act.do == "sit" else 1.0 - share)[rows]
            if act.do == "sit":
                self.seat_m[rows] = self.at.seat_m or 0.0
            return
        x, y = self.way[-1].tolist()
        facing = float(self.heading[-1])
        if act.do == "walk":
            target = self.places[act.to]
            self._walk(target, [self.places[name] for name in act.via], start_s, end_s)
            return
        if act.do == "step":
            if act.to:
                target = self.places[act.to]
                x, y, facing = target.x_m, target.y_m, _nearest_angle(target.facing_rad, facing)
            else:
                c, s = np.cos(facing), np.sin(facing)
                x += act.ahead_m * c - act.left_m * s
                y += act.ahead_m * s + act.left_m * c
        elif one.target is not None:
            facing = _nearest_angle(atan2(one.target[1] - y, one.target[0] - x), facing)
        self.at = Place(x, y, degrees(facing))
        self.way[rows] = self.way[rows] + share[rows, None] * ((x, y) - self.way[rows])
        self.heading[rows] += share[rows] * (facing - self.heading[rows])
        self.stretches.append((start_s, end_s))

    def _walk(self, target: Place, via: Sequence[Place], start_s: float, end_s: float) -> None:
        points = way_points(self.at, target, via, (float(self.way[-1][0]), float(self.way[-1][1])))
        # A person who is already at the target only turns.
        longer = np.linalg.norm(np.diff(points, axis=0), axis=1) > _SAME_M
        points = points[np.concatenate(((True,), longer))]
        if len(points) < 2:
            facing = float(self.heading[-1])
            points = points + np.outer((0.0, _SAME_M), (np.cos(facing), np.sin(facing)))
        legs = np.diff(points, axis=0)
        lengths = np.linalg.norm(legs, axis=1)
        along = np.concatenate(((0.0,), np.cumsum(lengths)))
        begin_s, arrive_s = start_s + WALK_STARTS_S, end_s - WALK_ENDS_S
        gone = along[-1] * _steady_progress(
            (self.t_s - begin_s) / (arrive_s - begin_s), arrive_s - begin_s
        )
        rows = self.t_s >= begin_s
        for axis in (0, 1):
            self.way[rows, axis] = np.interp(gone[rows], along, points[:, axis])
        tangents = np.unwrap(np.arctan2(legs[:, 1], legs[:, 0]))
        tangents += _nearest_angle(tangents[0], float(self.heading[-1])) - tangents[0]
        which = np.clip(np.searchsorted(along, gone, "right") - 1, 0, len(legs) - 1)
        walking = rows & (self.t_s < arrive_s)
        self.heading[walking] = tangents[which][walking]
        facing = _nearest_angle(target.facing_rad, float(tangents[-1]))
        self.heading[self.t_s >= arrive_s] = facing
        self.at = target
        self.stretches.append((start_s, end_s))


def base_motion(
    t_s: Floats,
    start: Place,
    acts: Sequence[TimedAct],
    places: Mapping[str, Place],
    body: Measures,
    boxes: bool,
) -> BasePose:
    """Return hips and feet over a round.

    Args:
        t_s: times of the rows (n,), RATE_HZ per second.
        start: place at the start of the round; on a seat the person sits.
        acts: acts that move hips or feet, in order.
        places: places by name.
        body: measures of the body.
        boxes: whether the person has a boxer's stance, one foot ahead and knees bent.
    """
    path = _Path(t_s, start, places)
    for act in acts:
        path.add(act)
    way = moving_average(path.way, round(_PATH_S * RATE_HZ))
    heading = moving_average(path.heading, round(_HEADING_S * RATE_HZ))
    feet = _Feet(t_s, way, heading, body, boxes)
    for start_s, end_s in path.stretches:
        feet.step(start_s, end_s)
    back = SEAT_AHEAD_M * path.seated[:, None]
    hips = way - back * np.stack((np.cos(heading), np.sin(heading)), axis=1)
    return BasePose(hips, heading, path.seated, path.seat_m, feet.p_m, feet.yaw_rad)


class _Feet:
    """Both feet, planted and moved in each stretch."""

    def __init__(
        self, t_s: Floats, way: Floats, heading: Floats, body: Measures, boxes: bool
    ) -> None:
        self.t_s, self.way, self.heading = t_s, way, heading
        self.half, self.boxes = body.half_hips_m * 1.05, boxes
        self.p_m = np.zeros((len(t_s), 2, 3))
        self.yaw_rad = np.zeros((len(t_s), 2))
        for foot in (0, 1):
            place, yaw = self._home(foot, 0)
            self.p_m[:, foot, :2], self.yaw_rad[:, foot] = place, yaw

    def step(self, start_s: float, end_s: float) -> None:
        """Move the feet after the hips within a stretch, the outer one first."""
        last = len(self.t_s) - 1
        begin, end = (min(last, round(s * RATE_HZ)) for s in (start_s, end_s))
        turn = self.heading[end] - self.heading[begin]
        across = self._home(0, end)[0] - self.p_m[begin, 0, :2]
        aside = across @ (-np.sin(self.heading[begin]), np.cos(self.heading[begin]))
        first = 0 if turn + 2.0 * aside > 0.0 else 1
        count = max(2, ceil((end_s - start_s) / _STRIDE_S))
        each_s = (end_s - start_s) / count
        for k in range(count):
            foot = (first + k) % 2
            lift_s = start_s + k * each_s
            middle_s = lift_s + _MIDDLE * each_s if k < count - 2 else end_s + 0.6
            swing_s = each_s * _SWING_SHARE
            row = min(last, round(middle_s * RATE_HZ))
            place, yaw = self._home(foot, row)
            share = (self.t_s - lift_s) / swing_s
            rows = share >= 0.0
            moved = smooth_rise(share)[rows]
            before, yaw_before = self.p_m[-1, foot, :2].copy(), float(self.yaw_rad[-1, foot])
            self.p_m[rows, foot, :2] = before + moved[:, None] * (place - before)
            self.yaw_rad[rows, foot] = yaw_before + moved * (yaw - yaw_before)
            far = float(np.linalg.norm(place - before)) + 0.15 * abs(yaw - yaw_before)
            self.p_m[rows, foot, 2] = _LIFT_M * min(1.0, far / 0.3) * smooth_bump(share)[rows]

    def _home(self, foot: int, row: int) -> tuple[Floats, float]:
        """Return position and direction of a foot under the hips of a row."""
        heading, side = float(self.heading[row]), 1.0 - 2.0 * foot
        ahead, aside, out = 0.0, side * self.half, side * 0.10
        if self.boxes:
            ahead, aside = side * _BOX_STANCE_M, 1.25 * aside
            out = (0.15, -1.0)[foot] * _BOX_OUT_RAD
        c, s = np.cos(heading), np.sin(heading)
        place = self.way[row] + (ahead * c - aside * s, ahead * s + aside * c)
        return place, heading + out


def _steady_progress(share: Floats, lasts_s: float) -> Floats:
    """Return a path from 0 to 1 at constant speed with a smooth start and end."""
    ramp = min(0.5, 0.45 / lasts_s)
    fine = np.linspace(0.0, 1.0, 400)
    speed = smooth_rise(fine / ramp) * smooth_rise((1.0 - fine) / ramp)
    gone = np.concatenate(((0.0,), np.cumsum(0.5 * (speed[1:] + speed[:-1]))))
    return np.asarray(np.interp(np.clip(share, 0.0, 1.0), fine, gone / gone[-1]))


def _nearest_angle(angle_rad: float, to_rad: float) -> float:
    """Return an angle plus whole turns, as near as possible to another."""
    return angle_rad + 2.0 * np.pi * round((to_rad - angle_rad) / (2.0 * np.pi))
