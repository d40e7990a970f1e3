"""Cost of pauses between ticks on this machine: python tests/bench/bench_pacing.py [--rounds 6]

The same simulated tick (desk rig, visitor, ideal bus), the same step of ruckig and the same loop of
a thousand additions, each run one after the other, after 5 ms of sleep and after 5 ms of spinning
in place, by turns in one run. The work is the same to the byte; what a pause adds is what the
processor has forgotten meanwhile (caches, address translation, branch history, clock speed), in
microseconds of the thread's processor time, median / mean. Nothing here passes or fails.
"""

import argparse
import time
from collections.abc import Callable

import numpy as np
from bench_tick import absent, now_ns, ruckig_step

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import TickLoop

PAUSE_S, BATCH, WARM_TICKS = 0.005, 200, 1000


def spin(pause_s: float) -> None:
    """Wait without leaving the processor."""
    until = time.perf_counter() + pause_s
    while time.perf_counter() < until:
        pass


PAUSES: dict[str, Callable[[], None]] = {
    "at once": lambda: None,
    "after 5 ms asleep": lambda: time.sleep(PAUSE_S),
    "after 5 ms of spinning": lambda: spin(PAUSE_S),
}


def additions() -> None:
    """Add a thousand numbers: a few hundred bytes of code and data."""
    total = 0.0
    for k in range(1000):
        total += k * 1.5


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=6)
    rounds = parser.parse_args().rounds
    made = assemble(load_rig("desk"), RunOptions(True, True, 0, "visitor", bus="ideal"))
    made.robot.start(made.clock)
    loop = TickLoop(made.robot, made.clock, made.loop, lambda at_s: None, lambda tick: None)
    for _ in range(WARM_TICKS):
        loop.step()
    works: dict[str, Callable[[], object]] = {
        "a tick in simulated time, ideal bus": loop.step,
        "a thousand additions": additions,
    }
    with absent("ruckig"):
        step, count = ruckig_step(), iter(range(10**9))
        works["ruckig, a step of nine axes"] = lambda: step(next(count))
    for name, work in works.items():
        spent: dict[str, list[float]] = {pause: [] for pause in PAUSES}
        for _ in range(rounds):
            for pause, wait in PAUSES.items():
                for _ in range(BATCH):
                    wait()
                    began = now_ns()
                    work()
                    spent[pause].append((now_ns() - began) / 1e3)
        cells = (
            f"{pause} {np.median(us):6.1f} / {np.mean(us):6.1f}" for pause, us in spent.items()
        )
        print(f"{name:36} {' | '.join(cells)}")
    made.close()


if __name__ == "__main__":
    main()
