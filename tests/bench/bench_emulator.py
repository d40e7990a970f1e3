"""Cost of the emulated bus and error of its wire time: python tests/bench/bench_emulator.py

One run prints how fast the shipped rigs run on emulated and on ideal servos, what the emulated
side costs a tick, packets per second in this process and through a pseudo-terminal, simulated
seconds per second of processor time of nine servos, and the cycle time on a line
with wire time next to the formula. Work in this process alone is measured in processor
time, the rest in real time. Nothing here passes or fails: machines differ and are shared, so
compare figures of one run with each other.
"""

import argparse
import os
import struct
import time
from collections.abc import Callable

import numpy as np
from fastcrc.crc16 import umts
from rich.console import Console
from rich.table import Table
from simulated_runs import RIGS, emulated_cost, simulated

from gazerig.drivers.serial.port import BlockingPort
from gazerig.sim_mock.dynamixel.chain import DynamixelChain, build_dynamixel
from gazerig.sim_mock.pty.client import PtyBus
from gazerig.sim_mock.wire import ServoLine

IDS = tuple(range(1, 10))
SPECS = [(i, "xl330-m077" if i < 7 else "xc330-m288", 2048) for i in IDS]
FAST_REPLY, SYNC_REPLY = 8 + 9 * 14, 9 * 21


def instruction(servo_id: int, code: int, params: bytes = b"") -> bytes:
    """Build an instruction packet; nothing in it needs stuffing."""
    packet = b"\xff\xff\xfd\x00" + struct.pack("<BHB", servo_id, len(params) + 3, code) + params
    return packet + struct.pack("<H", umts(packet))


def goals(steps: int) -> bytes:
    """Build a sync write of one goal position for all."""
    rows = b"".join(struct.pack("<Bi", i, steps) for i in IDS)
    return instruction(0xFE, 0x83, struct.pack("<HH", 116, 4) + rows)


SENSED = struct.pack("<HH", 126, 10) + bytes(IDS)
FAST, SYNC, PING = (
    instruction(0xFE, 0x8A, SENSED),
    instruction(0xFE, 0x82, SENSED),
    instruction(1, 1),
)
TORQUE_ON = instruction(0xFE, 3, struct.pack("<HB", 64, 1))
NO_DELAY = instruction(0xFE, 3, struct.pack("<HB", 9, 0))
GOALS = goals(2048)


def main() -> None:
    """Run all parts and print their figures."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cycles", type=int, default=2000)
    parser.add_argument("--seconds", type=float, default=30.0, help="of each simulated run")
    chosen = parser.parse_args()
    cycles, seconds = chosen.cycles, chosen.seconds
    console = Console(width=100)
    console.print(f"{os.cpu_count()} processors, load {os.getloadavg()[0]:.2f} at the start")
    console.print(runs(seconds))
    console.print(emulated_side())
    console.print(packets_per_second(cycles))
    console.print(simulated_seconds())
    console.print(wire_time(cycles))


def runs(seconds: float) -> Table:
    """Run all rigs with scene visitor in simulated time, byte-true and ideal."""
    table = Table("simulated seconds per second of processor", "emulated servos", "ideal servos")
    for rig in RIGS:
        table.add_row(
            rig, *(f"{simulated(rig, bus, seconds):8.1f}" for bus in ("emulated", "ideal"))
        )
    return table


def emulated_side() -> Table:
    """Measure what the emulated servos of a run cost, by part."""
    table = Table("emulated servos, us a tick", "all", "replies", "of these motion", "goals")
    for rig in RIGS:
        cost = emulated_cost(rig)
        parts = cost.whole, cost.replies, cost.motion, cost.others
        table.add_row(rig, *(f"{part:8.1f}" for part in parts))
    return table


def packets_per_second(cycles: int) -> Table:
    """Count instructions answered (or taken) a second, servos holding still, no wire time."""
    table = Table("instruction to nine servos", "in this process", "through a terminal")
    now = [0.0]
    chain = build_dynamixel(SPECS, lambda: now[0])
    line = ServoLine(chain)
    with PtyBus() as bus:
        port = BlockingPort(bus.start(SPECS))
        port.setBaudRate(1_000_000)
        instant(now, line, TORQUE_ON)
        port.write(TORQUE_ON)
        for name, packet, reply in (
            ("fast sync read, 10 bytes each", FAST, FAST_REPLY),
            ("sync read, 10 bytes each", SYNC, SYNC_REPLY),
            ("sync write of goals + ping", GOALS + PING, 14),
            ("ping", PING, 14),
        ):
            inside = per_call(lambda p=packet: instant(now, line, p), cycles)  # type: ignore[misc]
            outside = per_call(
                lambda p=packet, n=reply: ask(port, p, n),  # type: ignore[misc]
                cycles,
                time.perf_counter,
            )
            table.add_row(name, f"{1 / inside:8.0f}/s", f"{1 / outside:8.0f}/s")
        port.closePort()
    return table


def instant(now: list[float], line: ServoLine, packet: bytes) -> None:
    """Send one packet, five simulated milliseconds after the last."""
    now[0] += 0.005
    line.send(packet, 1_000_000)


def ask(port: BlockingPort, packet: bytes, reply: int) -> float:
    """Send one packet and wait for its whole answer; gives the seconds it took."""
    began = time.perf_counter()
    port.write(packet)
    got = port.read_until(reply, port.now_s() + 1.0)
    assert len(got) == reply, f"{len(got)} of {reply} bytes"
    return time.perf_counter() - began


def simulated_seconds() -> Table:
    """Measure simulated seconds per second of processor, one read and one write every 5 ms."""
    table = Table(
        "nine servos, read and written every 5 ms", "simulated s per processor s", "us a tick"
    )
    for name, path in (
        ("at rest, torque off", None),
        ("holding a goal", lambda k: 2048),
        ("steps of 300 every 0.25 s", lambda k: 2048 + 300 * (k // 50 % 2)),
        ("a sine of 1 Hz, 20 deg", lambda k: round(2048 + 228 * np.sin(2 * np.pi * k / 200))),
    ):
        now = [0.0]
        chain = build_dynamixel(SPECS, lambda now=now: now[0])  # type: ignore[misc]
        if path is not None:
            chain.receive(TORQUE_ON)
        packets = [FAST + (goals(path(k)) if path else b"") for k in range(200)]
        tick_s = per_call(ticker(chain, now, packets), 2000)
        table.add_row(name, f"{0.005 / tick_s:8.1f}", f"{1e6 * tick_s:8.1f}")
    return table


def ticker(chain: DynamixelChain, now: list[float], packets: list[bytes]) -> Callable[[], None]:
    """Return one tick: the clock goes on by 5 ms, one packet is exchanged."""
    count = [0]

    def tick() -> None:
        now[0] += 0.005
        chain.receive(packets[count[0] % len(packets)])
        count[0] += 1

    return tick


def wire_time(cycles: int) -> Table:
    """Compare sync write + read on a line with wire time with the formula."""
    table = Table("sync write + read of nine", "baud", "formula us", "p50 us", "p90 us", "rate of")
    for baud in (1_000_000, 4_000_000):
        with PtyBus() as bus:
            port = BlockingPort(bus.start(SPECS, baud=baud, wire_time=True))
            port.setBaudRate(baud)
            port.write(NO_DELAY)
            port.drain()
            for name, packet, reply in (
                ("fast sync read", FAST, FAST_REPLY),
                ("sync read", SYNC, SYNC_REPLY),
            ):
                formula = (len(GOALS) + len(packet) + reply) * 10 / baud
                took = [ask(port, GOALS + packet, reply) for _ in range(cycles)]
                p50, p90 = np.percentile(took, [50, 90])
                share = f"{100 * formula / p50:.1f} % of the limit"
                table.add_row(
                    name, str(baud), f"{1e6 * formula:.1f}",
                    f"{1e6 * p50:.1f}", f"{1e6 * p90:.1f}", share,
                )  # fmt: skip
            port.closePort()
    return table


def per_call(
    work: Callable[[], object], times: int, clock: Callable[[], float] = time.process_time
) -> float:
    """Return seconds per call, the median of five batches."""
    batches = []
    for _ in range(5):
        began = clock()
        for _ in range(times // 5):
            work()
        batches.append((clock() - began) / (times // 5))
    return float(np.median(batches))


if __name__ == "__main__":
    main()
