"""Cost of the gaze models: python tests/bench/bench_gaze.py

Prints the time of one whole gaze step (choose, wander, plan) with 2 faces and 20 bodies as
a share of a 5 ms tick, its growth with the number of bodies, and next to both, in the same
run, one step of ruckig's trajectory generator as a known quantity. Nothing here passes or
fails.
"""

import time
from collections.abc import Callable

import numpy as np
from ruckig import InputParameter, OutputParameter, Ruckig

from gazerig.config.schema import load_rig
from gazerig.gaze.types import Bodies, Face, Percept
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.model.types import JointState

TICK_S = 0.005


def main() -> None:
    """Measure and print."""
    known = ruckig_step()
    print(f"ruckig, 6 axes, one step of a new target     {1e6 * known:9.1f} us")
    whole, decide = gaze_step(2, 20, 600)
    share = 100 * whole / TICK_S
    print(
        f"gaze step, 2 faces, 20 bodies, mean          {1e6 * whole:9.1f} us, "
        f"{share:.1f} % of a tick"
    )
    print(f"  of it with a new picture                   {1e6 * decide:9.1f} us")
    print("a new picture with many bodies")
    for count in (10, 100, 1_000, 10_000, 100_000):
        _, decide = gaze_step(2, count, max(20, 20_000 // count // 10))
        print(f"  {count:7d} bodies  {1e3 * decide:9.3f} ms, {1e9 * decide / count:9.1f} ns a body")


def percept(faces: int, bodies: int, t_s: float, rng: np.random.Generator) -> Percept:
    """Make a room full of moving things."""
    n = faces + bodies
    places = rng.uniform((0.4, -1.5, -0.3), (3.0, 1.5, 0.8), (n, 3))
    speeds = rng.normal(0.0, 0.2, (n, 3))
    R = ((-1.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0))
    seen = tuple(
        Face(i, tuple(places[i]), (0.0, 0.0, 0.0), R, (tuple(places[i]),) * 8, 0.9)
        for i in range(faces)
    )
    kinds = ("face",) * faces + ("thing",) * bodies
    return Percept(
        t_s,
        Bodies(tuple(range(n)), kinds, places, speeds, rng.normal(0, 1, (n, 3)), np.full(n, 0.1)),
        seen,
    )


def gaze_step(faces: int, bodies: int, pictures: int) -> tuple[float, float]:
    """Return seconds a tick, and a tick with a new picture, at 30 pictures, 200 ticks a second."""
    choice = RunOptions(mock=True, fast=True, seed=0, scene="visitor")
    robot = assemble(load_rig("desk"), choice).robot
    joints = JointState((0.0,) * 9, (0.0,) * 9, (0.0,) * 9, ())
    pose = robot._kinematics.forward(joints)
    rng = np.random.default_rng(0)
    rooms = [percept(faces, bodies, 0.0, rng) for _ in range(4)]
    total, decide, ticks, t_s = 0.0, 0.0, 0, 0.0
    for k in range(pictures):
        room = rooms[k % 4]
        seen = Percept(t_s, room.bodies, room.faces)
        for step in range(7):
            began = time.perf_counter()
            target = robot.attention.choose(seen, pose, t_s)
            target = robot._scanpath.wander(target, seen, t_s, True)
            robot._oculomotor.step(target, pose, t_s, TICK_S)
            spent = time.perf_counter() - began
            total += spent
            decide += spent if step == 0 else 0.0
            ticks += 1
            t_s += TICK_S
    return total / ticks, decide / pictures


def ruckig_step(times: int = 3000) -> float:
    """Return seconds of one step of a six-axis jerk-limited plan to a changing target."""
    axes = 6
    plan, desired, out = Ruckig(axes, TICK_S), InputParameter(axes), OutputParameter(axes)
    desired.max_velocity, desired.max_acceleration = [5.0] * axes, [50.0] * axes
    desired.max_jerk = [1000.0] * axes
    rng = np.random.default_rng(0)
    targets = rng.uniform(-0.5, 0.5, (times, axes)).tolist()

    def step(k: int) -> None:
        desired.target_position = targets[k]
        plan.update(desired, out)
        out.pass_to_input(desired)

    return per_call(step, times)


def per_call(work: Callable[[int], None], times: int) -> float:
    """Return seconds per call."""
    began = time.perf_counter()
    for k in range(times):
        work(k)
    return (time.perf_counter() - began) / times


if __name__ == "__main__":
    main()
