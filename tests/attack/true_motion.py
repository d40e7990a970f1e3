"""True joints of emulated rigs: python tests/attack/true_motion.py [--seconds 600]

Every shipped rig in every scene, and looks all around, on time and with missed slots: how far true
joints went beyond their ranges, how fast they were for their limits, which stops they touched.
"""

import argparse
import sys
from collections.abc import Callable
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))

from mixed_rig import rig_of
from true_shafts import Judge, Late, group_of, looked_at, on_time, run, sometimes_late

from gazerig.config.schema import Rig
from gazerig.robot.model.commands import LookAt
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.surroundings import scene_names

RIGS = ("desk", "feetech", "maker", "pca9685", "mixed")
LATES: dict[str, Callable[[], Late]] = {
    "on time": lambda: on_time,
    "1 slot, half of all": lambda: sometimes_late(1, 0.5, 1),
    "1-10 slots, 3 %": lambda: sometimes_late(2, 0.03, 10),
    "1-400 slots, 1 %": lambda: sometimes_late(3, 0.01, 400),
}
STILL_DEG_S = 0.5


def all_around(seed: int) -> Callable[[Run, float], None]:
    """Return what orders looks at random places all around, near and far."""
    rng, due_s = np.random.default_rng(seed), 0.5

    def order(made: Run, t_s: float) -> None:
        nonlocal due_s
        if t_s < due_s:
            return
        due_s = t_s + rng.uniform(0.15, 1.0)
        yaw, pitch, far = rng.uniform(-1.6, 1.6), rng.uniform(-1.0, 1.0), rng.choice([0.25, 1, 3])
        level = far * np.cos(pitch)
        place = level * np.cos(yaw), level * np.sin(yaw), 0.12 + far * np.sin(pitch)
        made.robot.command(LookAt((float(place[0]), float(place[1]), float(place[2]))))

    return order


def one(rig: Rig, scene: str, late: Late, seconds: float) -> tuple[int, Judge]:
    """Run one rig in one scene; returns the ticks and what true joints did."""
    looks = scene not in scene_names()
    choice = RunOptions(mock=True, fast=True, seed=0, scene="visitor" if looks else scene)
    with looked_at(rig, choice) as (made, shafts):
        judge = Judge(rig)
        orders = (all_around(0),) if looks else ()
        ticks = run(made, shafts, judge, seconds, late, *orders)
    eyes = [one.speed_deg_s for name, one in judge.worst.items() if group_of(name) == "eyes"]
    assert ticks and max(eyes) > STILL_DEG_S, f"{scene}: after {ticks} ticks no eye has moved"
    return ticks, judge


def main() -> None:
    """Print a row for each group of joints in each run."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=600.0, help="simulated, of each run")
    parser.add_argument("--rigs", nargs="*", default=list(RIGS))
    args = parser.parse_args()
    print("rig", "scene, lateness", "ticks", "joints", "beyond deg", sep="\t", end="\t")
    print("speed / limit", "accel / limit", "stops", sep="\t")
    total = 0
    with TemporaryDirectory() as folder:
        runs = product(args.rigs, (*scene_names(), "looks all around"), LATES)
        for name, scene, lateness in runs:
            rig = rig_of(name, Path(folder))
            ticks, judge = one(rig, scene, LATES[lateness](), args.seconds)
            total += ticks
            for group, (beyond, speed, accel, stops) in judge.by_group().items():
                figures = (f"{figure:.2f}" for figure in (beyond, speed, accel))
                print(name, f"{scene}, {lateness}", ticks, group, *figures, stops, sep="\t")
    print(f"{total} ticks")


if __name__ == "__main__":
    main()
