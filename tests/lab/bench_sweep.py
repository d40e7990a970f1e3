"""Duration of a sweep of 64 runs on two processes, and of the same runs one after the other.

    PYTHONPATH=. python tests/lab/bench_sweep.py [--runs N] [--seconds S] [--bus BUS]

Scene visitor, desk rig, one parameter at 8 levels and 8 seeds each, starting the processes and
measuring the gaze of each run included. Processor time is that of the processes that run.
"""

import argparse
import resource
import time

from rich.console import Console
from rich.table import Table

from gazerig.config.save_text import params_text
from gazerig.config.schema import load_rig
from gazerig.features.lab.sweep.axes import Point
from gazerig.features.lab.sweep.worker_pool import Job, WorkerPool
from gazerig.robot.app.options import BUSES, RunOptions

LEVELS = (4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 18.0)


def timed(job: Job, jobs: int, runs: int) -> tuple[float, float, dict[int, object]]:
    """Return wall and processor time in s, and the figures by run."""
    points: list[Point] = [{"gaze.head.comfort_deg": level} for level in LEVELS]
    wanted = [(points[i % len(points)], i // len(points)) for i in range(runs)]
    began_s, used_s = time.monotonic(), _children_s()
    with WorkerPool(job, jobs, lambda: None) as pool:
        found = {i: outcome for i, outcome in pool.outcomes(wanted)}
    failed = [one.failed for one in found.values() if one.failed]
    assert not failed, failed[0]
    figures: dict[int, object] = {i: one.figures for i, one in found.items()}
    return time.monotonic() - began_s, _children_s() - used_s, figures


def _children_s() -> float:
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def main() -> None:
    """Run both and print a table."""
    parser = argparse.ArgumentParser()
    parser.add_argument("--runs", type=int, default=64)
    parser.add_argument("--seconds", type=float, default=44.0)
    parser.add_argument("--bus", choices=BUSES, default="ideal")
    given = parser.parse_args()
    options = RunOptions(
        mock=True, fast=True, scene="visitor", seconds=given.seconds, bus=given.bus
    )
    job = Job(options, params_text(load_rig("desk")))
    table = Table(title=f"{given.runs} runs of {given.seconds:g} s, {given.bus} servos")
    for title in ("processes", "wall s", "processor s", "simulated s a wall s"):
        table.add_column(title, justify="right")
    results = []
    for jobs in (1, 2):
        wall_s, used_s, figures = timed(job, jobs, given.runs)
        results.append((wall_s, figures))
        rate = given.runs * given.seconds / wall_s
        table.add_row(str(jobs), f"{wall_s:.1f}", f"{used_s:.1f}", f"{rate:.1f}")
    console = Console()
    console.print(table)
    (one_s, one), (two_s, two) = results
    console.print(
        f"two processes are {one_s / two_s:.2f} times as fast; figures equal: {one == two}"
    )


if __name__ == "__main__":
    main()
