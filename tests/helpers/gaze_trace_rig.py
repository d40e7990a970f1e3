"""Eyes and head that follow targets, and a trace of them."""

from collections.abc import Callable
from dataclasses import replace
from math import degrees, radians
from typing import Any, NamedTuple

import numpy as np
from desk import GAZE_JOINTS, LIDS
from gaze_targets import DT, joints_at, target
from guarded_desk import ZERO

from gazerig.gaze.angles import add, angle_between, direction, scale, sub, unit
from gazerig.gaze.field_of_view import line_of_sight
from gazerig.gaze.lids.blink import LidParams
from gazerig.gaze.lids.lids import Lids
from gazerig.gaze.oculomotor.gaze_point import OculomotorParams
from gazerig.gaze.oculomotor.head import HeadModel, HeadParams
from gazerig.gaze.oculomotor.oculomotor import Oculomotor
from gazerig.gaze.oculomotor.pursuit import Pursuit, PursuitParams
from gazerig.gaze.oculomotor.saccade import SaccadeModel, SaccadeParams
from gazerig.gaze.types import GazeCommand, Target
from gazerig.robot.model.kinematics import GeometryParams, Kinematics

CENTRED = GeometryParams(0.0, 0.0, 0.0)
DESK = GeometryParams(60.0, 40.0, 50.0)
NO_RELIEF = HeadParams(goal_model="attention")
"""The paper's head: eq 7, and nothing after it."""

EXACT = OculomotorParams(law="exact")
"""Saccades land on their targets, and nothing moves between them."""

AT_ONCE = replace(EXACT, eye_lag_ms=DT * 1e3)
SACCADE = SaccadeParams(profile="min_jerk")
HUMAN = SaccadeParams(profile="human")


class Trace(NamedTuple):
    """One row a tick: time, head yaw, mean eye yaw, gaze error to the target (degrees)."""

    t: np.ndarray
    head: np.ndarray
    eye: np.ndarray
    error: np.ndarray
    commands: list[GazeCommand]

    @property
    def in_flight(self) -> list[bool]:
        """Return whether each tick is in a saccade."""
        return [command.phase == "saccade" for command in self.commands]

    @property
    def landed(self) -> int:
        """Return the tick in which the first saccade has landed."""
        return self.in_flight.index(False, self.in_flight.index(True))

    @property
    def rest_s(self) -> float:
        """Return the time from the first landing to the next saccade."""
        return (self.in_flight.index(True, self.landed) - self.landed) * DT

    @property
    def saccades(self) -> int:
        return self.commands[-1].saccades


class Rig:
    """A head that follows its commands immediately."""

    def __init__(
        self,
        eye_deg: float = 55.0,
        geometry: GeometryParams = CENTRED,
        head: HeadParams = NO_RELIEF,
        neck_deg: float = 90.0,
        params: OculomotorParams = AT_ONCE,
        saccade: SaccadeParams = SACCADE,
        dice: int = 0,
    ) -> None:
        self.kinematics = Kinematics(geometry, GAZE_JOINTS, LIDS)
        span = (-radians(eye_deg), radians(eye_deg))
        neck = (-radians(neck_deg), radians(neck_deg))
        self.oculomotor = Oculomotor(
            params,
            self.kinematics,
            ((span, span), (span, span)),
            SaccadeModel(saccade),
            Pursuit(PursuitParams()),
            HeadModel(head, radians(eye_deg), (neck, neck)),
            Lids(LidParams(blinks_per_min=0.0, law="none"), np.random.default_rng(0)),
            np.random.default_rng(dice),
        )
        self.joints = joints_at(ZERO, 0.0)

    def run(self, where: Callable[[float], Target], seconds: float) -> Trace:
        rows, commands = [], []
        for k in range(round(seconds / DT)):
            t = k * DT
            commands.append(self.tick(where(t), t, DT))
            rows.append(self.row(t, where(t)))
        columns: Any = (*np.array(rows).T, commands)
        return Trace(*columns)

    def tick(self, target: Target, t: float, dt: float) -> GazeCommand:
        state = self.kinematics.forward(self.joints)
        command = self.oculomotor.step(target, state, t, dt)
        now = self.kinematics.inverse(command)
        rates = tuple((a - b) / dt for a, b in zip(now, self.joints.position_rad, strict=True))
        self.joints = joints_at(now, t, velocity_rad_s=rates)
        return command

    def row(self, t: float, target: Target) -> tuple[float, ...]:
        state = self.kinematics.forward(self.joints)
        gaze = unit(add(line_of_sight(state, True), line_of_sight(state, False)))
        point = add(target.p_world_m, scale(target.v_world_m_s, t - target.at_s))
        error = angle_between(gaze, sub(point, state.p_world_head_m))
        eye = 0.5 * (state.eye_left_rad[0] + state.eye_right_rad[0])
        return t, degrees(state.head_rad[0]), degrees(eye), degrees(error)


def still(
    yaw_deg: float, salience: float = 1.0, top_down: bool = False, pitch_deg: float = 0.0
) -> Callable[[float], Target]:
    point = scale(direction((radians(yaw_deg), radians(pitch_deg))), 10.0)
    ahead, there = (
        target(place, kind="thing", id=id, salience=salience, top_down=top_down, shift=1 + id)
        for id, place in enumerate(((10.0, 0.0, 0.0), point))
    )
    return lambda t: there if t >= 0.1 else ahead
