"""True joints of emulated rigs: python tests/attack/true_motion.py [--seconds 600]

Every shipped rig in every scene, and looks all around, on time and with missed slots: how far true
joints went beyond their ranges, how fast they were for their limits, which stops they touched.

python tests/attack/true_motion.py soak --hours 12: random faults strike one rig after the other,
every tick judged on the true servos; beside it memory, open files and stale values told as fresh.
"""

import argparse
import os
import random
import sys
from collections import Counter
from collections.abc import Callable
from itertools import count
from pathlib import Path
from resource import RUSAGE_SELF, getrusage
from tempfile import TemporaryDirectory

import numpy as np
from rich.console import Console
from rich.table import Table

sys.path.insert(0, str(Path(__file__).parents[1]))

import struck_rigs
from board_rig import on_pca9685
from mixed_rig import mixed_text
from struck_rigs import CASES, quick
from true_shafts import Judge, Late, group_of, looked_at, on_time, run, sometimes_late

from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.errors import DriverError
from gazerig.robot.app.assemble import Assembly
from gazerig.robot.app.options import RunOptions
from gazerig.robot.model.commands import LookAt
from gazerig.sim_mock.scenes.registry import scenes
from gazerig.testing import struck_machine
from gazerig.testing.struck_machine import Machine, pair_of

RIGS = ("desk", "feetech", "maker", "pca9685", "mixed")
LATES: dict[str, Callable[[], Late]] = {
    "on time": lambda: on_time,
    "1 slot, half of all": lambda: sometimes_late(1, 0.5, 1),
    "1-10 slots, 3 %": lambda: sometimes_late(2, 0.03, 10),
    "1-400 slots, 1 %": lambda: sometimes_late(3, 0.01, 400),
}
STALE_ROOM_RAD = 0.004
STILL_DEG_S = 0.5

out = Console(width=120)


def rig_called(name: str, folder: str) -> Rig:
    """Load a shipped rig, or the one of three kinds of bus."""
    if name == "pca9685":
        return load_rig(on_pca9685(folder))
    if name != "mixed":
        return load_rig(name)
    path = Path(folder) / "mixed.yaml"
    path.write_text(mixed_text(), encoding="utf-8")
    return load_rig(str(path))


def all_around(seed: int) -> Callable[[Assembly, float], None]:
    """Return what orders looks at random places all around, near and far."""
    rng, due_s = np.random.default_rng(seed), 0.5

    def order(made: Assembly, t_s: float) -> None:
        nonlocal due_s
        if t_s < due_s:
            return
        due_s = t_s + rng.uniform(0.15, 1.0)
        yaw, pitch, far = rng.uniform(-1.6, 1.6), rng.uniform(-1.0, 1.0), rng.choice([0.25, 1, 3])
        level = far * np.cos(pitch)
        place = level * np.cos(yaw), level * np.sin(yaw), 0.12 + far * np.sin(pitch)
        made.robot.command(LookAt((float(place[0]), float(place[1]), float(place[2]))))

    return order


def table(args: argparse.Namespace) -> None:
    """Print the table."""
    heads = ("rig", "scene", "ticks", "joints", "beyond deg", "speed", "accel", "stops")
    shown = Table(*heads, title=f"{args.seconds:g} s each; speed and accel in parts of the limits")
    total = 0
    with TemporaryDirectory() as folder:
        for name in args.rigs:
            rig = rig_called(name, folder)
            for scene in (*args.scenes, "looks all around"):
                for lateness in args.late:
                    ticks, judge = one(rig, scene, LATES[lateness](), args.seconds)
                    total += ticks
                    for group, (beyond, speed, accel, stops) in judge.by_group().items():
                        row = [name, f"{scene}, {lateness}", ticks, group]
                        row += [f"{beyond:.2f}", f"{speed:.2f}", f"{accel:.2f}", stops]
                        shown.add_row(*map(str, row))
                        print(*row, sep="\t", flush=True)
    out.print(shown)
    print(f"{total} ticks")


def one(rig: Rig, scene: str, late: Late, seconds: float) -> tuple[int, Judge]:
    """Run one rig in one scene; returns the ticks and what true joints did."""
    looks = scene not in scenes()
    choice = RunOptions(mock=True, fast=True, seed=0, scene="visitor" if looks else scene)
    with looked_at(rig, choice) as (made, shafts):
        judge = Judge(rig)
        orders = (all_around(0),) if looks else ()
        ticks = run(made, shafts, judge, seconds, late, *orders)
    eyes = [one.speed_deg_s for name, one in judge.worst.items() if group_of(name) == "eyes"]
    assert ticks and max(eyes) > STILL_DEG_S, f"{scene}: after {ticks} ticks no eye has moved"
    return ticks, judge


def soak(args: argparse.Namespace) -> None:
    """Strike rigs with random faults for simulated hours and print what was found."""
    dice, ends, seen_s, struck, stale = random.Random(args.seed), Counter[str](), 0.0, 0, 0
    first_mb, first_files = resources()
    struck_machine.PATIENCE_S = 8.0  # a bus that was late long is slow for a while
    for k in count():
        if seen_s >= 3600.0 * args.hours:
            break
        kind = dice.choice(tuple(args.kinds))
        rig = struck_rigs.rig_of(kind)
        if dice.random() < 0.7:
            rig = quick(rig)
        machine = Machine(rig, dice.choice((50.0, 100.0, 200.0)), seed=k)
        watch = Stale(machine)
        try:
            machine.start()
            for _ in range(20):
                case = dice.choice(CASES[kind])
                watch.where = f"{kind} seed {k}: {case.name}"
                outcome = machine.strike(*pair_of(rig, kind), case)
                struck += 1
                ends[outcome.end] += 1
                if not outcome.survived:
                    print(f"{kind}: {case.name}: {outcome.end}", flush=True)
                if outcome.end != "came back":
                    break  # a person has to help: another head
        except (AssertionError, DriverError) as error:
            ends["broken"] += 1
            print(f"{watch.where}: {type(error).__name__}: {error}", flush=True)
        stale += watch.stale
        seen_s += machine.clock.now_s() - 50.0
        if k % 100 == 0:
            mb, files = resources()
            row = f"{seen_s / 3600:.2f} h, {struck} faults, {dict(ends)}, stale {stale}"
            print(f"{row}, {mb:.0f} MB, {files} files", flush=True)
    mb, files = resources()
    print(f"{seen_s / 3600:.2f} h, {struck} faults: {dict(ends)}; stale as fresh: {stale}")
    print(f"memory {first_mb:.0f} -> {mb:.0f} MB at most, open files {first_files} -> {files}")


class Stale:
    """Counts and prints readings said to be fresh that are not where the joint was in that tick.

    where: what is being done, for what is printed
    """

    def __init__(self, machine: Machine) -> None:
        self.stale, self.where = 0, ""
        self._read, self._machine = machine.body.read, machine
        machine.body.read = self.read  # type: ignore[method-assign]

    def read(self, t_s: float):  # type: ignore[no-untyped-def]
        """Read, and compare with the truth before and after."""
        before = self._machine.true_rad()
        joints = self._read(t_s)
        after = self._machine.true_rad()
        for i, name in enumerate(self._machine.names):
            if name in joints.missing or not joints.measured[i] or joints.rearmed[i]:
                continue
            low, high = sorted((before[i], after[i]))
            now = joints.position_rad[i]
            if low - STALE_ROOM_RAD <= now <= high + STALE_ROOM_RAD:
                continue
            self.stale += 1
            print(
                f"{self.where}: at {t_s:.3f} s {name} is said to be at {now:.4f} rad, "
                f"truly {low:.4f} to {high:.4f}; heard {joints.measured_s[i] - t_s:+.4f} s, "
                f"torque {joints.torque[i]}",
                flush=True,
            )
        return joints


def resources() -> tuple[float, int]:
    """Return the most memory used so far in MB, and the number of open files."""
    return getrusage(RUSAGE_SELF).ru_maxrss / 1024.0, len(os.listdir("/proc/self/fd"))


def main() -> None:
    """Print the table, or soak."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("mode", nargs="?", choices=("table", "soak"), default="table")
    parser.add_argument("--seconds", type=float, default=600.0, help="simulated, of each run")
    parser.add_argument("--rigs", nargs="*", default=list(RIGS))
    parser.add_argument("--scenes", nargs="*", default=list(scenes()))
    parser.add_argument("--late", nargs="*", default=list(LATES), choices=list(LATES))
    parser.add_argument("--kinds", nargs="*", default=list(CASES), choices=list(CASES))
    parser.add_argument("--hours", type=float, default=12.0)
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    (soak if args.mode == "soak" else table)(args)


if __name__ == "__main__":
    main()
