"""Costs and faults of the servo driver: python tests/bench/bench_bus.py [--seconds 20]

One run, nine emulated servos: the rate against the wire's own limit and a silent servo on a
simulated line; a silent servo side by side with the maker's SDK and rustypot; an unplugged
adapter, and faults by the dice with a count of stale values. Rates and processor time next to
the others are in bench_bus_peers.py. Nothing here passes or fails: machines differ and are
shared, so compare figures of one run with each other.
"""

import argparse
import os
import random
import time
from collections.abc import Callable
from contextlib import AbstractContextManager
from math import isfinite
from statistics import fmean, median

from bus_clients import Cycle, ours, robotis, rustypot
from rich.console import Console
from rich.table import Table

from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.dynamixel.params import DynamixelParams
from gazerig.drivers.serial.port import BlockingPort
from gazerig.drivers.servo_bus.bus import SmartServoBus
from gazerig.drivers.types import Feedback, ServoConfig
from gazerig.sim_mock.dynamixel.chain import build_dynamixel
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec

IDS = tuple(range(1, 10))
MODEL = "xl330-m077"
SPECS = [ServoSpec(i, MODEL, 2048) for i in IDS]
SETUPS = [ServoConfig(i, MODEL, 1000, 3000, 6000.0, f"joint_{i}") for i in IDS]
WIRE_BYTES = 59 + 23 + 134
"""Sync write of nine goals, fast sync read of 10 bytes from nine servos, and its answer."""

out = Console(width=110)


def main() -> None:
    """Run all parts and print their figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=20.0, help="for all parts together")
    share = parser.parse_args().seconds / 40.0
    out.print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start")
    line_alone()
    silent_servo(max(500, int(3000 * share)))
    unplug(max(2, int(4 * share)))
    dice(int(60 * 100 * share))


# --- a silent servo


def silent_servo(cycles: int) -> None:
    """Print what one silent servo of nine costs, in the middle of the group."""
    table = Table(
        "client", "healthy ms", "first extra ms", "mean extra", "values kept", title="silent servo"
    )
    clients: dict[str, Callable[[str], AbstractContextManager[Cycle]]] = {
        "ours": lambda path: ours("dynamixel", path, 1_000_000),
        "rustypot": lambda path: rustypot("dynamixel", path, 1_000_000, wait_s=0.05),
        "SDK": lambda path: robotis(path, 1_000_000),
    }
    for name, client in clients.items():
        with PtyBus() as server:
            path = server.start(SPECS, baud=1_000_000, wire_time=True)
            with ours("dynamixel", path, 1_000_000):  # lets all servos answer at once
                pass
            with client(path) as cycle:
                for k in range(400):
                    cycle(k)
                healthy, first, ill = [], [], []
                for _ in range(5):
                    healthy += [_timed(cycle, k) for k in range(300)]
                    server.command("lose 5")
                    first.append(_timed(cycle, 0))
                    ill += [_timed(cycle, k) for k in range(cycles // 5 if name == "ours" else 8)]
                    server.command("clear")
                    for k in range(100):
                        cycle(k)
        usual = fmean(span for span, _ in healthy)
        extra = median(span for span, _ in first) - median(span for span, _ in healthy)
        mean = fmean(span for span, _ in ill) / usual - 1.0
        kept = fmean(values for _, values in first + ill)
        row = f"{usual * 1e3:.2f}", f"{extra * 1e3:.2f}", f"{mean:+.1%}", f"{kept:.2f} of 9"
        table.add_row(name, *row)
    out.print(table)


def _timed(cycle: Cycle, k: int) -> tuple[float, int]:
    start = time.perf_counter()
    values = cycle(k)
    return time.perf_counter() - start, values


def line_alone() -> None:
    """Print the same on a simulated line: what the exchange itself costs, without any host."""
    table = Table(title="simulated line, no host: rate, and servo 5 silent")
    for head in ("reads", "Mbaud", "Hz", "of limit", "first extra ms", "mean extra", "values kept"):
        table.add_column(head)
    for baud in (1_000_000, 4_000_000):
        for indirect in (False, True):
            now = [0.0]
            chain = build_dynamixel(SPECS, lambda now=now: now[0])  # type: ignore[misc]
            port = InProcessPort(
                chain,
                sleep_until=lambda t, now=now: now.__setitem__(0, max(now[0], t)),  # type: ignore[misc]
                wire_time=True,
            )
            bus = SmartServoBus(
                DYNAMIXEL, port, SETUPS, DynamixelParams(baud=baud, indirect_block=indirect)
            )
            bus.open()
            bus.enable_torque()
            _line_cycles(bus, now, 300)
            usual_s, _ = _line_cycles(bus, now, 500)
            chain.faults.command("lose 5")
            first_s, _ = _line_cycles(bus, now, 1)
            mean_s, kept = _line_cycles(bus, now, 2000)
            table.add_row(
                "13 or 14 B" if indirect else "10 B",
                f"{baud // 1_000_000}",
                f"{1.0 / usual_s:.0f}",
                f"{10.0 * WIRE_BYTES / baud / usual_s:.1%}",
                f"{(first_s - usual_s) * 1e3:.2f}",
                f"{mean_s / usual_s - 1.0:+.1%}",
                f"{kept:.2f} of 9",
            )
    out.print(table)


def _line_cycles(bus: SmartServoBus, now: list[float], cycles: int) -> tuple[float, float]:
    """Run cycles in simulated time; gives the mean time and the mean number of values."""
    began, values = now[0], 0
    for k in range(cycles):
        feedback = bus.read(now[0])
        bus.write([2048 + k % 8] * len(IDS))
        values += len(IDS) - len(feedback.missing)
    return (now[0] - began) / cycles, values / cycles


# --- unplugged


def unplug(times: int) -> None:
    """Print how soon an unplugged adapter is noticed, and motion goes on after replugging."""
    notices, returns = [], []
    with PtyBus() as server:
        path = server.start(SPECS)
        bus = SmartServoBus(DYNAMIXEL, BlockingPort(path), SETUPS, DynamixelParams())
        bus.open()
        bus.enable_torque()
        for _ in range(times):
            _cycles(bus, lambda reported: False, 0.3)
            bus.events()
            server.command("unplug")
            notices.append(_cycles(bus, lambda reported: "lost" in " ".join(bus.events()), 5.0))
            _cycles(bus, lambda reported: False, 0.5)
            server.command("plug")
            returns.append(
                _cycles(bus, lambda reported: all(reported.torque) and not reported.missing, 5.0)
            )
        bus.disable_torque()
        bus.close()
    table = Table("", "median ms", "worst ms", title=f"unplugged for 0.5 s, {times} times, 100 Hz")
    table.add_row("unplug to notice", f"{median(notices):.1f}", f"{max(notices):.1f}")
    table.add_row("replug to torque", f"{median(returns):.0f}", f"{max(returns):.0f}")
    out.print(table)


def _cycles(bus: SmartServoBus, done: Callable[[Feedback], bool], most_s: float) -> float:
    """Run at 100 Hz until something is so; gives how long that took in ms."""
    start = time.perf_counter()
    while time.perf_counter() - start < most_s:
        feedback = bus.read(time.monotonic())
        bus.write([2060] * len(IDS))
        if done(feedback):
            break
        time.sleep(0.01)
    return (time.perf_counter() - start) * 1e3


# --- faults by the dice

FAULTS = (
    "lose {i} count {n}", "delay {i} {ms} count {n}", "truncate {i} {k} count {n}",
    "duplicate {i} count {n}", "corrupt {i} count {n}", "drop {i} {k} count {n}",
    "stall {i} {ms} count {n}", "noise before random count {n}", "noise after random count {n}",
    "fragment {i} count {n}", "reorder count {n}", "wrong-id {i} {j} count {n}",
    "short {i} 2 count {n}", "long {i} 2 count {n}", "refuse {i} 7 count {n}",
    "lose-writes {n}", "delay all {ms} count {n}", "lose all count {n}", "unplug for 0.3",
    "brown-out {i}", "echo on for 0.05",
)  # fmt: skip


def dice(cycles: int) -> None:
    """Print faults injected, survived, and values delivered that were not true in their cycle."""
    now = [10.0]
    chain = build_dynamixel(SPECS, lambda: now[0])
    truth: list[tuple[float, ...]] = []
    port = InProcessPort(
        chain,
        tap=lambda data: truth.append(chain.positions_steps()),
        sleep_until=lambda t: now.__setitem__(0, max(now[0], t)),
    )
    bus = SmartServoBus(DYNAMIXEL, port, SETUPS, DynamixelParams(give_up_s=600.0))
    bus.open()
    bus.enable_torque()
    dice = random.Random(7)
    injected = stale = values = missing = 0
    longest = 0.0
    for k in range(cycles):
        if dice.random() < 0.1:
            i, j = dice.sample(IDS, 2)
            words = {"i": i, "j": j, "n": dice.randint(1, 4), "k": dice.randint(0, 20)}
            chain.faults.command(dice.choice(FAULTS).format(ms=dice.randint(1, 120), **words))
            injected += 1
        now[0] += 0.01
        began = now[0]
        truth.clear()
        truth.append(chain.positions_steps())
        reported = bus.read(now[0])
        truth.append(chain.positions_steps())
        longest = max(longest, now[0] - began)
        missing += len(reported.missing)
        values += len(IDS) - len(reported.missing)
        for at, *places in zip(reported.position_steps, *truth, strict=True):
            stale += isfinite(at) and not min(places) - 1 <= at <= max(places) + 1
        bus.write([2048 + round(300 * ((k / 40 + i / 9) % 2 - 1)) for i in IDS])
    chain.faults.clear()
    for _ in range(300):
        now[0] += 0.01
        reported = bus.read(now[0])
    table = Table(title=f"faults by the dice, {cycles} cycles at 100 Hz, simulated time")
    for head in ("injected", "values", "missing", "stale as fresh", "longest read", "well after"):
        table.add_column(head)
    well = sum(reported.torque) - len(reported.missing)
    row = (injected, values, missing, stale, f"{longest * 1e3:.0f} ms", f"{well} of 9")
    table.add_row(*map(str, row))
    out.print(table)
    out.print("faults that stay:", bus.faults() or "none")


if __name__ == "__main__":
    main()
