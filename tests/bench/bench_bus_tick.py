"""Cost of joints per tick, by kind of bus: python tests/bench/bench_bus_tick.py [--rounds 4]

Nine joints through ``Body``: angles and speeds are read, angles are written, on pseudo-terminals
without the bytes' time on the wire, next to rustypot's clients if installed. Twice:

    warm    tick after tick without a pause
    200 Hz  the loop's rate: between ticks this process sleeps, and after reading as before sleeping
            some megabytes are copied, as the rest of a tick and other programs use the caches too

Thread time, least and median of all ticks, rounds of all clients taking turns; and how often
functions written in Python are called in one tick. Nothing here passes or fails: compare figures of
one run with each other.
"""

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from functools import partial
from math import sin
from statistics import median
from typing import Any, NamedTuple

from bench_bus_peers import emulated
from bus_clients import IDS, rustypot_halves
from rich.console import Console
from rich.table import Table

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.feetech.params import FeetechParams
from gazerig.drivers.maestro.board import MaestroBus, MaestroParams
from gazerig.drivers.pca9685.board import Pca9685Bus, Pca9685Params
from gazerig.drivers.serial.port import BlockingPort, port_at_path
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import ServoBus, ServoConfig
from gazerig.robot.control.body import Body, servo_setups
from gazerig.robot.model.clock import RealClock
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.types import GAZE_JOINTS
from gazerig.sim_mock.devices import Emulated, MaestroLine, Pca9685Line
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.pty.client import PtyBus

PERIOD_S = 0.005
CHURN = bytes(3_000_000)
"""More than the second level of a cache holds."""

MODELS = {"dynamixel": "xl330-m077", "feetech": "sts3215", "maestro": "hobby", "pca9685": "hobby"}

out = Console(width=110)


class Client(NamedTuple):
    """One that ticks; both take the number of the tick."""

    read: Callable[[int], Any]
    write: Callable[[int], Any]


class Spans(NamedTuple):
    """Thread time of one tick, us."""

    read: float
    write: float


def device(kind: str) -> Emulated:
    """Return nine servos of one kind."""
    servos = tuple(HobbySpec(i, start_steps=6000) for i in IDS)
    if kind == "maestro":
        return MaestroLine(12, servos=servos)
    if kind == "pca9685":
        return Pca9685Line(servos=servos)
    return emulated(kind, None)


def made(kind: str, path: str, configs: Sequence[ServoConfig]) -> ServoBus:
    """Make our driver of one bus."""
    if kind == "maestro":
        return MaestroBus(BlockingPort(path), configs, MaestroParams(stagger_ms=0.0))
    if kind == "pca9685":
        return Pca9685Bus(port_at_path(path), configs, Pca9685Params(stagger_ms=0.0))
    if kind == "feetech":
        return SmartServoBus(FEETECH, BlockingPort(path), configs, FeetechParams())
    # While others have their turn it is silent for longer than servos bear.
    return SmartServoBus(DYNAMIXEL, BlockingPort(path), configs, DynamixelParams(watchdog_ms=0))


@contextmanager
def ours(kind: str) -> Iterator[Client]:
    """Tick with our driver, torque on."""
    names = GAZE_JOINTS[: len(IDS)]
    joints = {
        name: JointParams(i, MODELS[kind], -30.0, 30.0, 600.0, 45_000.0)
        for i, name in zip(IDS, names, strict=True)
    }
    with PtyBus() as server:
        body = Body(made(kind, server.start_device(device(kind)), servo_setups(joints, {})), joints)
        body.start(RealClock())

        goals = [tuple([0.1 * sin(0.01 * k + i) for i in IDS]) for k in range(629)]

        try:
            yield Client(
                lambda k: body.read(time.monotonic()), lambda k: body.write(goals[k % len(goals)])
            )
        finally:
            body.stop()


@contextmanager
def rusty(kind: str) -> Iterator[Client]:
    """Tick with rustypot: positions alone, converted to radians; goals in radians."""
    with PtyBus() as server:
        path = server.start_device(device(kind))
        bus = made(kind, path, [ServoConfig(i, MODELS[kind], 1000, 3000, 3000.0) for i in IDS])
        bus.open()  # sets the servos up: they answer at once
        bus.close()
        with rustypot_halves(kind, path, 1_000_000) as (read, write):
            yield Client(read, write)


def clients() -> dict[str, Callable[[], Any]]:
    """Return all that tick, by name."""
    found: dict[str, Callable[[], Any]] = {kind: partial(ours, kind) for kind in MODELS}
    found["rustypot, dynamixel"] = lambda: rusty("dynamixel")
    found["rustypot, feetech"] = lambda: rusty("feetech")
    return found


def churn() -> None:
    """Use the caches for something else."""
    bytearray(CHURN)


def a_round(client: Client, ticks: int, cold: bool) -> list[Spans]:
    """Run n ticks, at the loop's rate if caches must be cold."""
    now_ns, found = time.thread_time_ns, []
    due_s = time.monotonic()
    for k in range(ticks):
        if cold:
            churn()
            due_s += PERIOD_S
            time.sleep(max(0.0, due_s - time.monotonic()))
        a = now_ns()
        client.read(k)
        b = now_ns()
        if cold:
            churn()
        c = now_ns()
        client.write(k)
        d = now_ns()
        found.append(Spans(1e-3 * (b - a), 1e-3 * (d - c)))
    return found


def calls(client: Client, ticks: int = 64) -> float:
    """Return how many functions written in Python are called a tick; two are the benchmark's."""
    count = 0

    def profile(frame: object, event: str, arg: object) -> None:
        nonlocal count
        count += event == "call"

    sys.setprofile(profile)
    for k in range(ticks):
        client.read(k)
        client.write(k)
    sys.setprofile(None)
    return count / ticks


def main() -> None:
    """Measure, and print a table and one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--rounds", type=int, default=4)
    parser.add_argument("--ticks", type=int, default=300, help="in each round")
    parser.add_argument("--only", nargs="*", default=(), help="clients by name")
    args = parser.parse_args()
    load = os.getloadavg()[0]
    out.print(f"{os.cpu_count()} processors, load {load:.2f} at the start")
    spans: dict[tuple[str, bool], list[Spans]] = {}
    counts = {}
    with ExitStack() as stack:
        opened = {
            name: stack.enter_context(client())
            for name, client in clients().items()
            if not args.only or name in args.only
        }
        for nth in range(args.rounds + 1):
            for name, client in opened.items():
                for cold in (False, True):
                    found = a_round(client, args.ticks if nth else 50, cold)
                    if nth:  # the first, to warm up, is not counted
                        spans.setdefault((name, cold), []).extend(found)
        for name, client in opened.items():
            counts[name] = calls(client)
    table = Table(title=f"one tick of {len(IDS)} joints: us of thread time, least / median")
    for head in ("client", "", "read", "write", "together", "Python calls"):
        table.add_column(head)
    figures = []
    for (name, cold), ticks in spans.items():
        columns = [
            [tick.read for tick in ticks],
            [tick.write for tick in ticks],
            [sum(tick) for tick in ticks],
        ]
        pairs = [(round(min(column), 1), round(median(column), 1)) for column in columns]
        when = "200 Hz" if cold else "warm"
        number = "" if cold else f"{counts[name]:.1f}"
        table.add_row(name, when, *(f"{least} / {mid}" for least, mid in pairs), number)
        figures.append((name, when, *pairs, counts[name]))
    out.print(table)
    print(json.dumps({"load": load, "figures": figures}))


if __name__ == "__main__":
    main()
