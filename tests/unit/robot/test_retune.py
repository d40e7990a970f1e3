"""Every knob turned while the rig runs: no jump on the bus, nothing forgotten, nothing idle."""

from collections.abc import Iterator
from math import isfinite, pi
from typing import Any, NamedTuple

import msgspec
import numpy as np
import pytest
from desk import GAZE_JOINTS
from fakes.runs import simulated, ticks

from gazerig.config.load import ConfigError, shipped_names, shipped_path
from gazerig.config.parameters import NEXT_TICK, apply_changes, differences, parameters, value_of
from gazerig.config.schema import Rig, load_rig
from gazerig.robot.loop.loop import Tick
from gazerig.robot.model.commands import AnyCommand, Jog, Tune, Value
from gazerig.robot.model.parameter import Parameter
from gazerig.robot.run.live import rig_in_effect
from gazerig.robot.run.run import Run

DT_S = 1.0 / 200.0
STEPS_PER_RAD = 4096.0 / (2.0 * pi)


class Running(NamedTuple):
    """A simulated rig that ticks by hand, and every goal that went to the bus."""

    made: Run
    goals: list[list[int]]
    ticks: list[Tick]

    @property
    def rig(self) -> Rig:
        return self.made.rig

    def go(self, count: int, dt_s: float = DT_S) -> Tick:
        self.ticks.extend(ticks(self.made, count, dt_s))
        return self.ticks[-1]

    def tune(self, changes: dict[str, Value]) -> None:
        rig = rig_in_effect(self.rig, apply_changes(self.rig, changes))
        self.made.robot.command(Tune(tuple(differences(self.rig, rig).items())))


def started(scene: str = "visitor", rig: Rig | None = None) -> Running:
    made = simulated(rig or "desk", scene)
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
        self.guard = running.made.guard
        self.joints = [*running.made.robot.body._joints.values()]
        self.steps = self._steps()
        self.speed = np.array(
            [
                joint.steps(speed) - joint.steps(0.0)
                for joint, speed in zip(self.joints, self.guard._motion.speed, strict=True)
            ]
        )
        self.seen = len(running.goals)

    def _steps(self) -> np.ndarray:
        command = self.guard._motion.command
        return np.array([j.steps(q) for j, q in zip(self.joints, command, strict=True)])

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
            self.running.go(1, dt_s)
            steps = self._steps()
            speed = (steps - self.steps) / dt_s
            for i, limit in enumerate(self.guard.limits):
                per_rad = self.joints[i].ratio * STEPS_PER_RAD
                # A limit taken over in this tick was kept before it was.
                top = max(limit.speed_rad_s * per_rad, before[i].speed_rad_s * per_rad)
                hard = max(limit.accel_rad_s2 * per_rad, before[i].accel_rad_s2 * per_rad)
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


def some_changes(
    knob: Parameter, rig: Rig, dice: np.random.Generator, walk: str
) -> Iterator[dict[str, Value]]:
    """Return changes to low, high and random values of a knob; ``walk``: another walk."""
    key, now = knob.key, value_of(rig, knob.key)
    match knob.kind:
        case "number" | "whole" if key.startswith("park_deg"):
            joint = rig.joints[key.split(".")[1]]
            yield {key: float(dice.uniform(joint.min_deg, joint.max_deg))}
        case "number" | "whole" if knob.low is not None and knob.high is not None:
            assert isinstance(now, int | float)
            near = now * float(dice.uniform(0.8, 1.2))
            for value in (knob.low, knob.high, near):
                yield {key: round(value) if knob.kind == "whole" else float(value)}
        case "bool":
            yield {key: not now}
        case "choice":
            yield from ({key: choice} for choice in knob.choices if choice != now)
        case "list" if key == "guard.collisions":
            yield {key: (COLLISION,)}
        case "list" if key.endswith("point_world_m"):
            rule = key.removesuffix(".point_world_m")
            yield {key: (1.0, -0.5, 0.3), f"{rule}.look_at": "point"}
        case "list":
            assert knob.low is not None and knob.high is not None and isinstance(now, tuple)
            yield {key: (knob.low,) * len(now)}
            yield {key: (knob.high,) * len(now)}
            yield {key: tuple(float(dice.uniform(knob.low, knob.high)) for _ in now)}
        case "text":
            yield {
                key: {"behaviour": "attack", "look_at": "hand", "gesture": "nod"}.get(
                    key.split(".")[-1], walk
                )
            }


COLLISION: dict[str, Value] = {
    "first": ("neck_pitch", -40.0, -20.0),
    "second": ("left_upper_lid", 5.0, 20.0),
}


@pytest.fixture
def walk(tmp_path) -> str:
    """Return a walk that begins elsewhere."""
    text = shipped_path("scanpaths", shipped_names("scanpaths")[0]).read_text(encoding="utf-8")
    path = tmp_path / "walk.yaml"
    path.write_text(text.replace("start: FR", "start: N"), encoding="utf-8")
    return str(path)


def live_knobs() -> tuple[Parameter, ...]:
    rig = load_rig("desk")
    return tuple(knob for knob in parameters(rig, rig) if knob.live == NEXT_TICK)


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_every_knob_at_any_time_keeps_every_limit_on_the_bus(seed, walk):
    dice = np.random.default_rng(seed)
    running = started(("visitor", "boxing", "face-to-face")[seed])
    running.go(100)
    judge = Judge(running)
    turned: set[str] = set()
    todo = list(live_knobs())
    np.random.default_rng(0).shuffle(todo)
    todo = todo[seed::3]  # every run turns others
    for knob in todo:
        was = value_of(running.rig, knob.key)
        for changes in some_changes(knob, running.rig, dice, walk):
            try:
                running.tune(changes)
            except ConfigError:  # against a rule between parameters
                continue
            turned.add(knob.key)
            judge.go(int(dice.integers(1, 5)), DT_S if dice.random() < 0.9 else 0.02)
        if dice.random() < 0.7 and value_of(running.rig, knob.key) != was:
            try:
                running.tune({knob.key: was})
            except ConfigError:
                continue
            judge.go(1)
    judge.go(50)
    assert len(turned) > 0.8 * len(todo)


# A running head with a changed range


def test_an_order_that_crossed_processes_is_checked_in_its_tick():
    running = started()
    running.go(10)
    order = msgspec.json.decode(
        msgspec.json.encode(Tune((("gaze.lids.close_ms", 90.0),))), type=AnyCommand
    )
    running.made.robot.command(order)
    running.go(1)
    assert running.rig.gaze.lids.close_ms == 90.0
    running.made.robot.command(Tune((("gaze.lids.close_ms", 9000.0), ("gaze.lid.x", 1))))
    tick = running.go(1)
    assert running.rig.gaze.lids.close_ms == 90.0
    assert "not tuned: gaze.lids.close_ms: is 9000.0, wanted a number, 30 to 500 ms" in tick.events
    assert any("gaze.lid: unknown key" in line for line in tick.events)


def test_a_joint_outside_its_new_range_is_led_inside_slowly():
    running = started()
    jog(running, "neck_yaw", 40.0, 300)
    running.tune({"joints.neck_yaw.max_deg": 20.0, "joints.neck_yaw.min_deg": -20.0})
    Judge(running).go(301)
    results = [tick.guard_result for tick in running.ticks[-302:]]
    assert "neck_yaw: outside its new range" in results[1].reasons
    yaw_deg = np.degrees([result.command_rad[6] for result in results])
    assert yaw_deg[[0, -1]] == pytest.approx([40.0, 20.0], abs=0.06)
    assert np.abs(np.diff(yaw_deg)).max() <= 60.0 * DT_S + 1e-4


def jog(running: Running, joint: str, deg: float, ticks: int) -> None:
    """Send one joint somewhere by hand, beyond its range as well."""
    running.made.robot.replay_command(Jog(((joint, float(np.radians(deg))),), stay=True))
    running.go(ticks)


def test_a_wider_range_waits_until_the_next_start():
    running = started()
    running.tune({"joints.neck_yaw.max_deg": 73.0, "joints.neck_yaw.max_speed_deg_s": 250.0})
    running.go(1)
    assert "neck_yaw: the full range and speed apply at the next start" in (
        running.ticks[-1].events
    )
    jog(running, "neck_yaw", 80.0, 500)
    held = np.degrees(running.ticks[-1].guard_result.command_rad[6])
    assert held == pytest.approx(70.0, abs=0.1)
