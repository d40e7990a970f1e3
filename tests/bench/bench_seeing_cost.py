"""Cost of perception: python tests/bench/bench_seeing_cost.py [--scene boxing]

Processor time of the thread in the camera, the perception and the attention of the desk rig, in
simulated time with emulated servos. Every round is the same run, so each call counts with
the least of the rounds. Nothing here passes or fails.
"""

import argparse
import time
from collections.abc import Callable
from typing import Any

import numpy as np

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import Assembly, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import run

STAGES = ("camera", "see", "choose")


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--scene", default="visitor")
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--rounds", type=int, default=5)
    chosen = parser.parse_args()
    least: np.ndarray | None = None
    fresh = np.zeros(0, bool)
    for _ in range(chosen.rounds):
        spent, fresh = one_round(chosen.scene, chosen.seconds)
        least = spent if least is None else np.minimum(least, spent)
    assert least is not None
    print(f"us, scene {chosen.scene}: {least.shape[1]} ticks, {fresh.sum()} with a new frame")
    print(f"{'':10}{'a tick':>10}{'new frame':>12}{'no frame':>12}")
    for name, row in zip((*STAGES, "together"), (*least, least.sum(axis=0)), strict=True):
        print(f"{name:10}{row.mean():10.1f}{row[fresh].mean():12.1f}{row[~fresh].mean():12.1f}")


def one_round(scene: str, seconds: float) -> tuple[np.ndarray, np.ndarray]:
    """Return the us of each stage and tick, (3, ticks), and in which ticks a frame was new."""
    made = assemble(load_rig("desk"), RunOptions(mock=True, fast=True, seed=0, scene=scene))
    columns: dict[str, list[int]] = {name: [] for name in STAGES}
    robot = made.robot
    robot.camera.latest = timed(robot.camera.latest, columns["camera"])  # type: ignore[method-assign]
    robot.perception.see = timed(robot.perception.see, columns["see"])  # type: ignore[method-assign]
    robot.attention.choose = timed(robot.attention.choose, columns["choose"])  # type: ignore[method-assign]
    times = captured(made, seconds)
    fresh = np.diff(np.array([-1.0, *times])) != 0.0
    return np.array([columns[name] for name in STAGES]) / 1e3, fresh


def timed(call: Callable[..., Any], column: list[int]) -> Callable[..., Any]:
    """Return a call that adds its processor time to a column, ns."""

    def measured(*given: Any) -> Any:
        began = time.thread_time_ns()
        found = call(*given)
        column.append(time.thread_time_ns() - began)
        return found

    return measured


def captured(made: Assembly, seconds: float) -> list[float]:
    """Run, and return the capture time of the percept of each tick, -1 before the first."""
    times: list[float] = []
    made.robot.start(made.clock)
    try:
        run(
            made.robot,
            made.clock,
            made.loop,
            lambda at_s: "seconds" if at_s >= seconds else None,
            lambda tick: times.append(tick.percept.captured_s if tick.percept else -1.0),
        )
    finally:
        made.robot.stop()
        made.close()
    return times


if __name__ == "__main__":
    main()
