"""Looks commanded one after the other, through the whole product, to measured joints."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import radians
from typing import Any

import numpy as np
from msgspec.structs import replace
from true_shafts import looked_at

from gazerig.config.schema import load_rig
from gazerig.gaze.angles import add, direction, scale, sub, yaw_pitch
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.types import GazeState, Percept, Target, Vec3
from gazerig.robot.app.options import RunOptions
from gazerig.robot.model.commands import LookAt

STARTS_S = 3.0
"""The head straightens up slowly before the first look."""
DISTANCE_M = 1.0
_HEAD_M = (0.04, 0.0, 0.13)


@dataclass(frozen=True)
class Looks:
    """Columns of n ticks; degrees, yaw + left, pitch + up, seen from the head.

    t_s: (n,); gaze_deg, plan_deg: (n, 2) measured gaze in space; the planned gaze point
    target_deg: (n, 2) of the point to look at; look: (n,) its number
    flight: (n,) whether a saccade is planned in this tick
    """

    t_s: np.ndarray
    gaze_deg: np.ndarray
    plan_deg: np.ndarray
    target_deg: np.ndarray
    look: np.ndarray
    flight: np.ndarray


def point(yaw_deg: float, pitch_deg: float = 0.0) -> Vec3:
    """Return a point 1 m from the head."""
    way = direction((radians(yaw_deg), radians(pitch_deg)))
    return add(_HEAD_M, scale(way, DISTANCE_M))


def commanded(times_s: Sequence[float], points: Sequence[Vec3], seed: int) -> Looks:
    """Return the motion of the desk rig, told to look at points at times after ``STARTS_S``."""
    options = RunOptions(rig="desk", mock=True, fast=True, seed=seed, scene="sits-still")
    rows, number = [], -1
    with looked_at(load_rig("desk"), options) as (made, clock):
        clock.looking = False
        _seen_and_not_ordered(made.robot)
        made.robot.start(clock)
        begin_s = last_s = clock.now_s()
        period_s = 1.0 / made.loop.rate_hz
        due = [begin_s + STARTS_S + t for t in times_s]
        for k in range(1, round((STARTS_S + times_s[-1] + 1.5) / period_s)):
            clock.sleep_until(begin_s + k * period_s)
            t_s = clock.now_s()
            while number + 1 < len(due) and t_s >= due[number + 1] - 1e-9:
                number += 1
                made.robot.command(LookAt(points[number], who="a bench", stay=True))
            tick = made.robot.tick(t_s, t_s - last_s)
            last_s = t_s
            if number >= 0:
                rows.append((t_s, *_angles(tick.pose, tick.gaze.gaze_point_world_m, points[number]),
                             number, tick.gaze.phase == "saccade"))  # fmt: skip
    table = np.array(rows, dtype=float)
    return Looks(
        table[:, 0], table[:, 1:3], table[:, 3:5],
        table[:, 5:7], table[:, 7].astype(int), table[:, 8] > 0.0,
    )  # fmt: skip


def _seen_and_not_ordered(robot: Any) -> None:
    """Have points taken for things that were seen: what is ordered is looked at exactly."""
    chosen = robot._lead.chosen_target

    def seen(percept: Percept | None, t_s: float) -> Target | None:
        target: Target | None = chosen(percept, t_s)
        return None if target is None else replace(target, kind="thing")

    robot._lead.chosen_target = seen


def _angles(pose: GazeState, plan: Vec3, target: Vec3) -> list[float]:
    head = pose.p_world_head_m
    sight = add(line_of_sight(pose, left=True), line_of_sight(pose, left=False))
    ways = sight, sub(plan, head), sub(target, head)
    return np.degrees([angle for way in ways for angle in yaw_pitch(way)]).tolist()
