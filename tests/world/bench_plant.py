"""Servos in a world with physics compared with the same alone: python tests/world/bench_plant.py

Prints, as Markdown:
- the same moves of servos with mechanics of their own and in a world: overshoot, time until within
  1 deg, error at the end, peaks of speed and torque
- a run of each rig in both: gaze error, peaks of speed and torque next to the limits of the servos
- what a simulated millisecond costs with each world, in processor time (least of rounds)

    --seconds 30   of each run
    --quick        shorter, for a look

Nothing here passes or fails.
"""

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from math import degrees, pi, radians, sin
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from fakes.runs import play
from world_rigs import WorldBench, arm, write
from world_scripts import WORLDS, shipped_world

from gazerig.config.schema import load_rig
from gazerig.drivers.dynamixel.control_table import MODELS as DYNAMIXEL
from gazerig.drivers.feetech.memory_table import MODELS as FEETECH
from gazerig.features.world.figure import Figures
from gazerig.features.world.model import world_model
from gazerig.features.world.physics import World
from gazerig.features.world.run.run_world import rig_in_world
from gazerig.gaze.types import Vec3
from gazerig.robot.app import run_bus
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.run_bus import emulated_lines
from gazerig.robot.control.tick import Tick
from gazerig.sim_mock.devices import build
from gazerig.sim_mock.true_gaze import gaze_error_rad, true_part

NEAR_DEG = 1.0
Goal = Callable[[float], float]
"""Degrees from where it began, of seconds since then."""


class Move(NamedTuple):
    """A motion to be compared.

    ends_deg: final position; None: the servo does not come to rest
    """

    name: str
    rig: str
    joint: str
    goal: Goal
    seconds: float
    ends_deg: float | None


def _jump(by_deg: float) -> Goal:
    return lambda t_s: by_deg


def _saccade(by_deg: float, lasts_s: float) -> Goal:
    def goal(t_s: float) -> float:
        s = min(1.0, t_s / lasts_s)
        return by_deg * s**3 * (10.0 - 15.0 * s + 6.0 * s * s)

    return goal


def _sine(by_deg: float, hz: float) -> Goal:
    return lambda t_s: by_deg * sin(2.0 * pi * hz * t_s)


MOVES = tuple(
    Move(name, rig, joint, goal, seconds, ends)
    for rig, eye, neck in (
        ("desk", "left_eye_pan", "neck_pitch"),
        ("feetech", "left_eye_pan", "neck_pitch"),
        ("maker", "eyes_pan", None),
    )
    for name, joint, goal, seconds, ends in (
        ("eye, step 10 deg", eye, _jump(10.0), 0.6, 10.0),
        ("eye, saccade 20 deg in 75 ms", eye, _saccade(20.0, 0.075), 0.6, 20.0),
        ("eye, sine 10 deg 1 Hz", eye, _sine(10.0, 1.0), 2.0, None),
        ("neck pitch, step 10 deg", neck, _jump(10.0), 1.0, 10.0),
        ("neck pitch, min jerk 20 deg in 400 ms", neck, _saccade(20.0, 0.4), 1.0, 20.0),
        ("neck pitch, sine 10 deg .5 Hz", neck, _sine(10.0, 0.5), 4.0, None),
        ("neck pitch, against its stop for .6 s", neck, _jump(-70.0), 0.6, None),
    )
    if joint is not None
)


class Trace(NamedTuple):
    """A joint every millisecond: its angle from the beginning, speed, and torque at its servo."""

    angle_deg: Any
    speed_deg_s: Any
    torque_nm: Any
    error_deg: Any


def _moved(move: Move) -> dict[str, Trace]:
    """Return what both do of a move."""
    bench = WorldBench(move.rig)
    joint = bench.rig.joints[move.joint]
    own, world = bench.own[move.joint], bench.servos[move.joint]
    boards = [next(iter(one.values())) for one in (bench.own_devices, bench.devices)]
    smart = hasattr(own, "memory")
    for servo in (own, world):
        if smart:
            arm(servo, joint.gains or ())
    if not smart:
        for board in boards:
            board.body.channels[joint.id].set_target(round(joint.steps(0.0)))
    bench.pass_ms(400)
    places = {"alone": own, "world": world}
    began = {key: _angle(joint, one) for key, one in places.items()}
    rows: dict[str, list[tuple[float, ...]]] = {key: [] for key in places}
    period = 5 if smart else 20
    for ms in range(round(move.seconds * 1000.0)):
        wanted = move.goal(ms / 1000.0)
        if ms % period == 0:
            for nth, (key, servo) in enumerate(places.items()):
                steps = round(joint.steps(radians(began[key] + wanted)))
                if smart:
                    write(servo, "goal_position", max(0, steps))
                else:
                    boards[nth].body.channels[joint.id].set_target(steps)
        bench.pass_ms(1)
        for key, servo in places.items():
            angle = _angle(joint, servo) - began[key]
            torque = servo.shaft.effort * _stall_nm(servo) if hasattr(servo, "shaft") else 0.0
            rows[key].append((angle, torque, wanted - angle))
    return {key: _trace(np.array(found)) for key, found in rows.items()}


def _trace(rows: Any) -> Trace:
    # Over 10 ms: a hobby servo alone moves in steps of that.
    speed = (rows[10:, 0] - rows[:-10, 0]) * 100.0
    return Trace(rows[:, 0], speed, rows[:, 1], rows[:, 2])


def _angle(joint: Any, servo: Any) -> float:
    steps = servo.position_steps if hasattr(servo, "position_steps") else servo.place_steps
    return degrees(joint.angle_rad(steps))


def _stall_nm(servo: Any) -> float:
    model = getattr(servo, "model", None)
    return float(servo.spec.stall_torque_nm if model is None else model.stall_torque_nm)


def _show_moves(moves: tuple[Move, ...]) -> None:
    print(
        "| rig | move | servo | overshoot deg | within 1 deg ms | end error deg | rms error deg ",
        end="",
    )
    print("| peak deg/s | peak Nm |\n|--|--|--|--|--|--|--|--|--|")
    for move in moves:
        for key, trace in _moved(move).items():
            over = settled = end = "-"
            if move.ends_deg is not None:
                away = trace.angle_deg - move.ends_deg
                late = np.flatnonzero(np.abs(away) > NEAR_DEG)
                over, end = f"{max(0.0, float(away.max())):.2f}", f"{away[-1]:.2f}"
                settled = str(int(late[-1]) + 1 if len(late) else 0)
            rms = float(np.sqrt((trace.error_deg**2).mean()))
            torque = f"{np.abs(trace.torque_nm).max():.3f}" if trace.torque_nm.any() else "-"
            print(
                f"| {move.rig} | {move.name} | {key} | {over} | {settled} | {end} | {rms:.2f} "
                f"| {np.abs(trace.speed_deg_s).max():.0f} | {torque} |"
            )


# --- whole runs


class Loop(NamedTuple):
    """A run: gaze error in rest and pursuit, and a row a tick of speeds and efforts by joint."""

    off_deg: Any
    speed_deg_s: Any
    effort: Any


def _looked(name: str, in_world: bool, seconds: float) -> Loop:
    """Return a run with the scene visitor, its servos in a world or alone."""
    rig, before = load_rig(name), run_bus.build
    buses = iter(run_bus.emulated_lines(rig))
    worlds: list[World] = []
    devices: list[Any] = []

    def made_here(line: Any, now_s: Callable[[], float]) -> Any:
        if in_world and not worlds:
            worlds.append(World(world_model(None, [rig_in_world(rig, looks=False)]), now_s))
        bus = next(buses)
        devices.append(worlds[0].device(line, bus) if in_world else build(line, now_s))
        return devices[-1]

    run_bus.build = made_here  # type: ignore[assignment]
    try:
        made = assemble(rig, RunOptions(True, True, 0, "visitor"))
    finally:
        run_bus.build = before
    servos = [s for one in devices for s in getattr(one, "servos", ()) or one.body.servos]
    servos = [one for one in servos if hasattr(one, "shaft")]
    rows: list[list[float]] = []
    efforts: list[list[float]] = []
    off: list[float] = []
    start: list[float] = []

    def watch(tick: Tick) -> None:
        start[:] = start or [tick.t_s]
        assert made.scene is not None
        people = made.scene.people(tick.t_s - start[0])
        if people and tick.target.kind == "face" and tick.gaze.phase != "saccade":
            place: Vec3 = true_part(people[0], tick.target.part)
            off.append(degrees(gaze_error_rad(place, tick.pose)))
        if start[0] + 3.0 < tick.t_s:
            rows.append([degrees(v) for v in tick.joints.velocity_rad_s])
            efforts.append([one.shaft.effort for one in servos])

    play(made, seconds, watch)
    return Loop(np.array(off), np.abs(rows).max(0), np.abs(efforts).max(0))


def _show_runs(seconds: float) -> None:
    print("\n| rig | servos | gaze error median / 95 % deg |\n|--|--|--|")
    peaks: list[str] = []
    for name in ("desk", "feetech"):
        rig = load_rig(name)
        both = {key: _looked(name, key == "world", seconds) for key in ("alone", "world")}
        for key, one in both.items():
            median, most = np.percentile(one.off_deg, (50, 95))
            print(f"| {name} | {key} | {median:.2f} / {most:.2f} |")
        for nth, joint in enumerate(rig.names):
            info = (DYNAMIXEL | FEETECH)[rig.joints[joint].model]
            top = info.no_load_rpm * 6.0 / rig.joints[joint].ratio
            peaks.append(
                f"| {name} | {joint} | "
                + " | ".join(f"{both[k].speed_deg_s[nth]:.0f}" for k in both)
                + f" | {top:.0f} | "
                + " | ".join(f"{both[k].effort[nth] * info.stall_torque_nm:.3f}" for k in both)
                + f" | {info.stall_torque_nm:.3f} |"
            )
    print("\n| rig | joint | peak deg/s alone | world | no load | peak Nm alone | world | stall |")
    print("|--|--|--|--|--|--|--|--|")
    print("\n".join(peaks))


# --- what it costs


def _worlds() -> Iterator[tuple[str, Figures | None]]:
    yield "empty", None
    for name in WORLDS:
        yield name, Figures(shipped_world(name))


def _show_cost(rounds: int) -> None:
    rig = load_rig("desk")
    print("\n| world | bodies | us of processor a simulated ms | real time x |\n|--|--|--|--|")
    for name, figures in _worlds():
        world = World(world_model(figures, [rig_in_world(rig, looks=False)]), lambda: 0.0)
        chain: Any = world.device(*emulated_lines(rig).values())
        for servo in chain.servos:
            arm(servo)
        world.begin(0)
        costs = []
        for nth in range(rounds):
            before = time.process_time()
            world.advance((nth + 1) * 250)
            costs.append((time.process_time() - before) / 250 * 1e6)
        least = min(costs)
        print(f"| {name} | {world.model.mj.nbody} | {least:.0f} | {1000.0 / least:.0f} |")


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=30.0)
    parser.add_argument("--quick", action="store_true")
    args = parser.parse_args()
    moves = MOVES
    if args.quick:
        moves = tuple(_halved(one) for one in MOVES[:4])
    _show_moves(moves)
    _show_runs(6.0 if args.quick else args.seconds)
    _show_cost(4 if args.quick else 12)


def _halved(move: Move) -> Move:
    """Return a move that is watched for half the time."""
    return move._replace(seconds=move.seconds / 2.0)


if __name__ == "__main__":
    main()
