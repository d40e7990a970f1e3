"""Cost of a tick on every kind of servo bus: python tests/bench/bench_bus_kinds.py

One run, six servos each: our drivers for Dynamixel, Feetech STS and a Maestro, all three as
one bus of two servos each, and next to them clients of other projects, if there are
any. A tick is one reading of all servos and one packet of goals, tick after tick without a
pause. First in this process, where the emulator's arithmetic is part of a tick; then over
pseudo-terminals, with the emulator in a process of its own and the bytes' time on the wire
at each kind's usual rate. Rounds of all clients take turns, so that what else the machine
does strikes them alike; the least and the median of the rounds are given. Nothing here
passes or fails: compare figures of one run with each other.
"""

import argparse
import json
import os
import time
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, ExitStack
from statistics import median
from typing import NamedTuple

import bus_clients
from bus_clients import Cycle, driven, robotis, rustypot
from rich.console import Console
from rich.table import Table

from gazerig.drivers.bus.multi_bus import BusShare, MultiBus
from gazerig.drivers.maestro.board import MaestroBus, MaestroParams
from gazerig.drivers.serial.port import BlockingPort, BusPort
from gazerig.drivers.types import ServoBus, ServoConfig
from gazerig.sim_mock.devices import DynamixelLine, Emulated, FeetechLine, MaestroLine, build
from gazerig.sim_mock.hobby_servo import HobbySpec
from gazerig.sim_mock.in_process_port import InProcessPort
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.smart_servo.physics import ServoSpec

IDS = (1, 2, 3, 4, 5, 6)
BAUD = {"dynamixel": 1_000_000, "feetech": 1_000_000, "maestro": 115_200}
MIXED = {"dynamixel": (1, 2), "feetech": (3, 4), "maestro": (5, 6)}

Ports = Mapping[str, BusPort | str]
"""By the kind of their bus: opened ones, or paths."""

out = Console(width=118)


class Client(NamedTuple):
    """One that ticks.

    peer: whom it is compared with; reads: what it reads of each servo
    make: opens it on ports by the kind of their bus
    """

    name: str
    kinds: Mapping[str, tuple[int, ...]]
    reads: str
    make: Callable[[Ports], AbstractContextManager[Cycle]]
    peer: str = ""
    in_process: bool = True


class Spans(NamedTuple):
    """Of one round: half and 99 % of ticks took no longer; processor time a tick; values lost.

    A shared machine stops a server for longer than drivers wait, so some values are lost.
    """

    p50_us: float
    p99_us: float
    cpu_us: float
    lost: float


# --- servos and drivers


def emulated(kind: str, ids: tuple[int, ...]) -> Emulated:
    """Return the servos of one bus."""
    if kind == "maestro":
        return MaestroLine(12, servos=tuple(HobbySpec(i) for i in ids))
    model = "sts3215" if kind == "feetech" else "xl330-m077"
    specs = tuple(ServoSpec(i, model, 2048) for i in ids)
    return FeetechLine(specs, BAUD[kind]) if kind == "feetech" else DynamixelLine(specs, BAUD[kind])


def driver(kind: str, port: BusPort, ids: tuple[int, ...]) -> ServoBus:
    """Make our driver of one bus, as it comes."""
    if kind == "maestro":
        setups = [ServoConfig(i, "hobby", 4400, 7600, 12_000.0, rest_steps=6000) for i in ids]
        return MaestroBus(port, setups, MaestroParams(stagger_ms=0.0))
    return bus_clients.driver(kind, port, BAUD[kind], ids)


def ours(kinds: Mapping[str, tuple[int, ...]], ports: Ports) -> AbstractContextManager[Cycle]:
    """Tick with our drivers, torque on."""
    opened = {k: BlockingPort(p) if isinstance(p, str) else p for k, p in ports.items()}
    shares: list[BusShare] = []
    goals: list[int] = []
    for kind, ids in kinds.items():
        places = tuple(range(len(goals), len(goals) + len(ids)))
        shares.append(BusShare(kind, driver(kind, opened[kind], ids), places))
        goals += [6000 if kind == "maestro" else 2048] * len(ids)
    bus = MultiBus(shares) if len(shares) > 1 else shares[0].bus
    return driven(bus, goals, next(iter(opened.values())).now_s)


def sdk(ports: Ports) -> AbstractContextManager[Cycle]:
    """Tick with ROBOTIS' SDK."""
    return robotis(ports["dynamixel"], BAUD["dynamixel"], IDS)


def rusty(kind: str, ports: Ports) -> AbstractContextManager[Cycle]:
    """Tick with rustypot."""
    return rustypot(kind, str(ports[kind]), BAUD[kind], servo_ids=IDS)


def of_ours(name: str, kinds: Mapping[str, tuple[int, ...]], reads: str) -> Client:
    """Describe one of our drivers."""
    return Client(name, kinds, reads, lambda ports: ours(kinds, ports))


def rusty_one(name: str, peer: str, kind: str, reads: str) -> Client:
    """Describe rustypot on one kind; it opens serial ports only."""
    return Client(name, {kind: IDS}, reads, lambda ports: rusty(kind, ports), peer, False)


def clients() -> list[Client]:
    """List all that tick; after each of ours those it is compared with."""
    alone = {kind: {kind: IDS} for kind in BAUD}
    return [
        of_ours("Dynamixel", alone["dynamixel"], "13-14 B"),
        rusty_one("rustypot", "Dynamixel", "dynamixel", "4 B"),
        Client("ROBOTIS' SDK", alone["dynamixel"], "10 B", sdk, "Dynamixel"),
        of_ours("Feetech", alone["feetech"], "15 B, 31 every 8th"),
        rusty_one("rustypot STS", "Feetech", "feetech", "2 B"),
        of_ours("Maestro (no peer)", alone["maestro"], "1 pulse, errors"),
        of_ours("all three mixed", MIXED, "as each"),
    ]


# --- measuring


def a_round(tick: Cycle, ticks: int, count: int, step: Callable[[], None]) -> Spans:
    """Run one round; ``step`` lets time pass if a clock must be moved."""
    spans, lost = [], 0
    cpu = time.process_time()
    for k in range(ticks):
        step()
        began = time.perf_counter()
        values = tick(k)
        spans.append(time.perf_counter() - began)
        lost += count - values
    used = time.process_time() - cpu
    spans.sort()
    p50_us, p99_us = (1e6 * spans[int(share * (ticks - 1))] for share in (0.5, 0.99))
    return Spans(p50_us, p99_us, 1e6 * used / ticks, lost)


def take_turns(
    ticking: Mapping[str, tuple[Cycle, int, Callable[[], None]]], rounds: int, ticks: int
) -> dict[str, list[Spans]]:
    """Run rounds of all alternately; the first, to warm up, is not counted."""
    found: dict[str, list[Spans]] = {name: [] for name in ticking}
    for nth in range(rounds + 1):
        for name, (tick, count, step) in ticking.items():
            spans = a_round(tick, ticks, count, step)
            if nth:
                found[name].append(spans)
    return found


def count_of(client: Client) -> int:
    """Return how many servos it has."""
    return sum(map(len, client.kinds.values()))


def in_process(rounds: int, ticks: int) -> dict[str, list[Spans]]:
    """Measure with the emulator in this process, on a clock that moves 10 ms a tick."""
    now = [50.0]

    def wait(t_s: float) -> None:
        now[0] = max(now[0], t_s)

    def step() -> None:
        now[0] += 0.01

    with ExitStack() as stack:
        ticking = {}
        for client in clients():
            if client.in_process:
                ports = {
                    kind: InProcessPort(
                        build(emulated(kind, ids), lambda: now[0]), sleep_until=wait
                    )
                    for kind, ids in client.kinds.items()
                }
                tick = stack.enter_context(client.make(ports))
                ticking[client.name] = (tick, count_of(client), step)
        return take_turns(ticking, rounds, ticks)


def over_terminals(rounds: int, ticks: int) -> dict[str, list[Spans]]:
    """Measure over pseudo-terminals with the bytes' time on the wire."""
    with ExitStack() as stack:
        ticking = {}
        for client in clients():
            paths = {}
            for kind, ids in client.kinds.items():
                server = stack.enter_context(PtyBus())
                paths[kind] = server.start_device(emulated(kind, ids), wire_time=True)
                if client.peer:
                    _set_up(kind, paths[kind], ids)
            tick = stack.enter_context(client.make(paths))
            ticking[client.name] = (tick, count_of(client), _no_wait)
        return take_turns(ticking, rounds, ticks)


def _no_wait() -> None:
    """Use real time."""


def _set_up(kind: str, path: str, ids: tuple[int, ...]) -> None:
    """Let all servos answer at once, as our driver does, for the other clients."""
    bus = driver(kind, BlockingPort(path), ids)
    bus.open()
    bus.close()


# --- telling


def row(client: Client, here: list[Spans], there: list[Spans]) -> dict[str, object]:
    """Return the figures of one client: least and median of the rounds."""
    figures: dict[str, object] = {"client": client.name, "reads": client.reads}
    for where, rounds in (("here", here), ("pty", there)):
        for key in Spans._fields:
            values = [getattr(spans, key) for spans in rounds]
            figures[f"{where}_{key}"] = (
                [round(min(values), 1), round(median(values), 1)] if values else None
            )
    return figures


def main() -> None:
    """Measure, and print a table and one line of JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--ticks", type=int, default=300, help="in each round")
    chosen = parser.parse_args()
    load = os.getloadavg()[0]
    out.print(
        f"{os.cpu_count()} processors, load {load:.2f} at the start; least / median of rounds"
    )
    here = in_process(chosen.rounds, chosen.ticks)
    there = over_terminals(chosen.rounds, chosen.ticks)
    rows = [row(c, here.get(c.name, []), there[c.name]) for c in clients()]
    by_name = {str(one["client"]): one for one in rows}
    table = Table(title="one tick (read and write) of six servos, us")
    heads = (
        "client",
        "reads",
        "here p50",
        "here p99",
        "pty p50",
        "pty p99",
        "pty CPU",
        "lost",
        "CPU of ours",
    )
    for head in heads:
        table.add_column(head)
    for client, one in zip(clients(), rows, strict=True):
        keys = ("here_p50_us", "here_p99_us", "pty_p50_us", "pty_p99_us", "pty_cpu_us")
        cells = [_pair(one[key]) for key in keys]
        if client.peer:
            mine = by_name[client.peer]["pty_cpu_us"][1]  # type: ignore[index]
            one["cpu_times_ours"] = round(one["pty_cpu_us"][1] / mine, 2)  # type: ignore[index]
        ratio = f"x {one['cpu_times_ours']}" if client.peer else ""
        asked = chosen.rounds * chosen.ticks * count_of(client)
        lost = f"{sum(spans.lost for spans in there[client.name]) / asked:.2%}"
        table.add_row(client.name, client.reads, *cells, lost, ratio)
    out.print(table)
    print(json.dumps({"load": load, "rounds": chosen.rounds, "ticks": chosen.ticks, "rows": rows}))


def _pair(values: object) -> str:
    return "-" if values is None else " / ".join(f"{value:.0f}" for value in values)  # type: ignore[attr-defined]


if __name__ == "__main__":
    main()
