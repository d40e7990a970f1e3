"""From a program's call to the bytes for the servos: python tests/bench/bench_api.py [CALLS]

The desk rig in real time, its servos on a pseudo-terminal. At random moments of the control
cycle a program asks the head to look elsewhere: the program that opened the head, and another
one through its socket. Measured to the moment at which the goals of the tick that obeys have been
handed to the port. Nothing here passes or fails.
"""

import logging
import os
import sys
import time
from collections.abc import Callable, Sequence

import numpy as np

import gazerig
from gazerig.local_head import LocalHead
from gazerig.robot.control.tick import Tick
from gazerig.robot.model.commands import LookAt

CALLS = 300


def main() -> None:
    """Measure and print."""
    calls = int(sys.argv[1]) if len(sys.argv) > 1 else CALLS
    logging.disable()
    print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start")
    began_s = time.perf_counter()
    with gazerig.open("desk", mock=True) as head:
        print(f"open until the loop ticks: {time.perf_counter() - began_s:.2f} s")
        assert isinstance(head, LocalHead)
        obeyed = stamped(head)
        with gazerig.connect(os.getpid()) as far:
            print(f"\n{'ms':<44}{'p50':>8}{'p95':>8}{'p99':>8}{'worst':>8}")
            for name, one in (("local", head), ("remote", far)):
                called, sent = measured(one, obeyed, calls)
                show(f"{name}: call to servo bytes", sent)
                show(f"{name}: the call itself", called)
            show("local: head.state", timed(lambda: head.state, calls))
            show("remote: head.state", timed(lambda: far.state, calls))


def stamped(head: LocalHead) -> dict[float, float]:
    """Have the time noted at which the goals after an order were sent, by its point's x."""
    assert head._composed is not None
    robot = head._composed.assembly.robot
    write, update = robot.body.write, head._feed.update
    sent_s = 0.0
    obeyed: dict[float, float] = {}

    def timed_write(angles: tuple[float, ...]) -> None:
        nonlocal sent_s
        write(angles)
        sent_s = time.perf_counter()

    def noted(tick: Tick) -> None:
        for command in tick.commands:
            if isinstance(command, LookAt) and command.p_world_m is not None:
                obeyed[command.p_world_m[0]] = sent_s
        update(tick)

    robot.body.write = timed_write  # type: ignore[method-assign, assignment]
    head._feed.update = noted  # type: ignore[method-assign]
    return obeyed


def measured(
    head: gazerig.Head, obeyed: dict[float, float], calls: int
) -> tuple[list[float], list[float]]:
    """Return how long calls took, and how long until the servos had their goals; seconds."""
    rng = np.random.default_rng(1)
    called, sent = [], []
    for _ in range(calls):
        x_m = float(rng.uniform(0.8, 1.6))
        time.sleep(float(rng.uniform(0.02, 0.04)))
        began_s = time.perf_counter()
        head.look_at(x_m, float(rng.uniform(-0.3, 0.3)), 0.3)
        called.append(time.perf_counter() - began_s)
        while x_m not in obeyed:
            time.sleep(0.001)
        sent.append(obeyed[x_m] - began_s)
    return called, sent


def timed(work: Callable[[], object], calls: int) -> list[float]:
    """Return how long each of some calls took, seconds."""
    found = []
    for _ in range(calls):
        time.sleep(0.005)
        began_s = time.perf_counter()
        work()
        found.append(time.perf_counter() - began_s)
    return found


def show(name: str, seconds: Sequence[float]) -> None:
    """Print one row in milliseconds."""
    row = [*np.percentile(seconds, (50, 95, 99)), max(seconds)]
    print(f"{name:<44}" + "".join(f"{1e3 * value:8.2f}" for value in row))


if __name__ == "__main__":
    main()
