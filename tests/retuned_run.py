"""A running head whose parameters are changed."""

from math import isfinite, pi
from typing import Any, NamedTuple

import numpy as np
from desk import GAZE_JOINTS

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import Rig, load_rig
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.live_params import rig_in_effect
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import Tick
from gazerig.robot.model.commands import Value

DT_S = 1.0 / 200.0
STEPS_PER_RAD = 4096.0 / (2.0 * pi)


class Running(NamedTuple):
    """A simulated rig that ticks by hand, and every goal that went to the bus."""

    made: Assembly
    goals: list[list[int]]
    ticks: list[Tick]

    @property
    def rig(self) -> Rig:
        return self.made.live_params.rig

    def go(self, count: int, dt_s: float = DT_S) -> Tick:
        for _ in range(count):
            self.made.clock.sleep_until(self.made.clock.now_s() + dt_s)
            self.ticks.append(self.made.robot.tick(self.made.clock.now_s(), dt_s))
        return self.ticks[-1]

    def tune(self, changes: dict[str, Value]) -> None:
        base = self.rig
        rig = rig_in_effect(base, apply_changes(base, changes))
        self.made.robot.command(self.made.live_params.prepare(base, rig))


def started(scene: str = "visitor", rig: Rig | None = None) -> Running:
    made = assemble(rig or load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene=scene))
    goals: list[list[int]] = []
    write = made.robot.body.bus.write

    def noted(steps: Any) -> None:
        goals.append(list(steps))
        write(steps)

    made.robot.body.bus.write = noted  # type: ignore[method-assign,assignment]
    made.robot.start(made.clock)
    return Running(made, goals, [])


class Judge:
    """Asserts of every command, in servo steps, that it keeps the present limits."""

    def __init__(self, running: Running) -> None:
        self.running = running
        self.guard = running.made.live_params.parts.guard
        joints, speeds = running.made.robot.body._joints, self.guard._motion.speed
        self.steps = self._steps()
        self.speed = np.array(
            [j.steps(v) - j.steps(0.0) for j, v in zip(joints, speeds, strict=True)]
        )
        self.seen = len(running.goals)

    def _steps(self) -> np.ndarray:
        joints = self.running.made.robot.body._joints
        command = self.guard._motion.command
        return np.array([j.steps(q) for j, q in zip(joints, command, strict=True)])

    def _sag_steps(self) -> np.ndarray:
        """What makes up for the weight is added to the goals of the neck."""
        body, found = self.running.made.robot.body, np.zeros(len(GAZE_JOINTS))
        assert body._sag is not None
        for i, steps in body._sag.offsets(self.guard._motion.command, body._read_s):
            found[i] = round(steps)
        assert np.abs(found).max() < 30.0
        return found

    def go(self, count: int, dt_s: float = DT_S) -> None:
        for _ in range(count):
            before = self.guard.limits
            joints_before = self.running.made.robot.body._joints
            self.running.go(1, dt_s)
            joints = self.running.made.robot.body._joints
            steps = self._steps()
            speed = (steps - self.steps) / dt_s
            for i, limit in enumerate(self.guard.limits):
                per_rad = joints[i].ratio * STEPS_PER_RAD
                old = joints_before[i].ratio * STEPS_PER_RAD
                # A limit taken over in this tick was kept before it was.
                top = max(limit.speed_rad_s * per_rad, before[i].speed_rad_s * old)
                hard = max(limit.accel_rad_s2 * per_rad, before[i].accel_rad_s2 * old)
                where = f"{GAZE_JOINTS[i]} at {self.running.ticks[-1].t_s}"
                assert isfinite(steps[i]), where
                assert abs(speed[i]) <= top + 1e-3, where
                # After a late tick servos have braked by themselves.
                late = self.guard._soft
                assert late or abs(speed[i] - self.speed[i]) <= hard * dt_s + 0.02, where
            assert len(self.running.goals) == self.seen + 1
            self.seen += 1
            sent = np.array(self.running.goals[-1])
            assert (np.abs(sent - steps - self._sag_steps()) <= 0.5 + 1e-6).all()
            bus: Any = self.running.made.robot.body.bus
            for goal, low, high in zip(sent, bus._lowest, bus._highest, strict=True):
                assert low - 1 <= goal <= high + 1  # rounding; the bus clips that
            self.steps, self.speed = steps, speed
