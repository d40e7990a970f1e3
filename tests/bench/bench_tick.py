"""Cost of one tick, stage by stage: python tests/bench/bench_tick.py [--seconds 60]

The run is that of ``gazerig run --mock`` without a page: real time, 200 Hz, the scene visitor,
servos behind a pseudo-terminal that a process of their own emulates. Stages are given in processor
time of the loop's thread, so that waiting for bytes costs nothing. Ticks with timers around the
stages and ticks without take turns: the whole tick is measured without them, and what the timers
cost is measured in the same run and subtracted from the stages. Before and after
the loop, in the same process and at the same rate, ruckig computes a step of nine axes and
rustypot reads and writes nine servos.

    --save FILE        keeps the figures as JSON
    --against FILE     prints them next to stored ones, or those of another version:
                       PYTHONPATH=/path/to/other python tests/bench/bench_tick.py --save FILE
    --table            also prints them as rows of docs/measurements/performance.md
    --page             with the live page, watched by Chromium, or with --browsers N by N clients
                       that take all that is sent
    --record           with a recording
    --fast             simulated seconds a second, of the wall's clock and of processor time

Nothing here passes or fails.
"""

import argparse
import gc
import json
import os
import platform
import resource
import subprocess
import sys
import sysconfig
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import fields
from pathlib import Path
from shutil import which
from typing import Any

import numpy as np
from stage_timers import Noted, Timers, follow, now_ns, quantiles, summed

from gazerig.robot.app import session
from gazerig.robot.app.options import RunOptions
from gazerig.robot.control.loop import TickLoop

WARM_S, PEERS_S = 3.0, 3.0


def peers(kind: str, rate_hz: float, seconds: float) -> dict[str, list[float]]:
    """Return microseconds of processor time of others that are there, paced as the loop is."""
    found: dict[str, list[float]] = {}
    with ExitStack() as stack:
        works: dict[str, Callable[[int], object]] = {}
        with absent("ruckig"):
            works["ruckig, a step of nine axes"] = ruckig_step()
        with absent("rustypot"):
            works["rustypot, read and write of nine servos"] = stack.enter_context(
                rustypot_cycle(kind)
            )
        start_s = time.monotonic()
        for k in range(round(seconds * rate_hz)):
            time.sleep(max(0.0, start_s + k / rate_hz - time.monotonic()))
            for name, work in works.items():
                began = now_ns()
                work(k)
                found.setdefault(name, []).append((now_ns() - began) / 1e3)
    return found


@contextmanager
def absent(name: str) -> Iterator[None]:
    """Report in one line that a program for comparison is missing."""
    try:
        yield
    except ImportError as error:
        print(f"not compared with {name}: {error}")


def ruckig_step() -> Callable[[int], object]:
    """Return one update of ruckig, with nine axes in constant motion."""
    from ruckig import InputParameter, OutputParameter, Ruckig

    otg, given, found = Ruckig(9, 0.005), InputParameter(9), OutputParameter(9)
    given.max_velocity, given.max_acceleration = [6.0] * 9, [60.0] * 9
    given.max_jerk = [1000.0] * 9

    def step(k: int) -> object:
        if k % 30 == 0:  # a new target three to seven times a second, as a gaze has
            given.target_position = [(-1) ** (k // 30) * (0.1 + 0.05 * axis) for axis in range(9)]
        result = otg.update(given, found)
        found.pass_to_input(given)
        return result

    return step


@contextmanager
def rustypot_cycle(kind: str) -> Iterator[Callable[[int], object]]:
    """Open nine emulated servos in another process; yield one read and write of all."""
    from bench_bus_peers import emulated
    from bus_clients import rustypot

    from gazerig.sim_mock.pty.client import PtyBus

    with PtyBus() as server:
        path = server.start_device(emulated(kind, None), wire_time=False)
        with rustypot(kind, path, 1_000_000) as cycle:
            yield cycle


@contextmanager
def watched(run: session.Session, browsers: int | None) -> Iterator[str]:
    """Open the page in Chromium, or in n clients that accept all messages."""
    page: Any = run._run_observers._page
    if page is None:
        yield ""
        return
    while (url := page.url()) is None:
        time.sleep(0.01)
    chromium = which("chromium") or which("chromium-browser") or which("google-chrome")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        if browsers is None and chromium is not None:
            flags = ("--headless", "--no-sandbox", "--use-angle=swiftshader", "--disable-gpu",
                     "--enable-unsafe-swiftshader", "--no-first-run", f"--user-data-dir={folder}",
                     "--remote-debugging-port=0")  # fmt: skip
            quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
            process = subprocess.Popen([chromium, *flags, url], **quiet)  # type: ignore[call-overload]
            name = "Chromium"
        else:
            from bench_page import watched as visited

            process, name = visited(url, browsers or 1), f"{browsers or 1} clients"
        try:
            time.sleep(4.0)
            yield name
        finally:
            process.terminate()
            process.wait()


def options_of(args: argparse.Namespace, folder: Path) -> RunOptions:
    """Return the run that is measured."""
    given: dict[str, Any] = {"mock": True, "scene": args.scene, "rig": args.rig, "fast": args.fast}
    if args.bus != "emulated":
        if "bus" not in {field.name for field in fields(RunOptions)}:
            raise SystemExit(f"--bus {args.bus}: this version has emulated servos only")
        given["bus"] = args.bus
    if args.page and not args.fast:
        given["page"] = "127.0.0.1:8790"
    if args.fast:
        given["seconds"] = args.seconds + 1.0  # a simulated run has an end of its own, not before
    if args.record:
        given["record"] = folder / "run.mcap"
    return RunOptions(**given)


def measure(args: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Run, and return the figures."""
    composed = session.compose(options_of(args, folder))
    lines: list[str] = []
    noted = Noted()
    kind = "feetech" if args.rig == "feetech" else "dynamixel"
    rate_hz = composed.assembly.loop.rate_hz
    beside = peers(kind, rate_hz, PEERS_S)
    run = session.Session(composed, lambda: None, lines.append, summarised=False)
    try:
        with run.power_on() as loop:
            timers = Timers(loop)
            with in_thread_of_its_own(loop, run, args.browsers) as who:
                follow(loop, timers, Noted(), WARM_S)
                overruns = loop._overruns
                began = time.monotonic(), time.process_time()
                follow(loop, timers, noted, args.seconds)
                wall_s, cpu_s = time.monotonic() - began[0], time.process_time() - began[1]
                overruns = loop._overruns - overruns
                own_ns = timers.own_ns()
            run.stopped_by = "seconds"
    finally:
        composed.assembly.close()
    for name, spent in peers(kind, rate_hz, PEERS_S).items():
        beside[name] += spent
    figures = summed(noted, timers, own_ns)
    figures["loop"] = {
        "ticks": len(noted.starts_s),
        "slots skipped": overruns,
        "process, % of a core": 100 * cpu_s / wall_s,
        "memory at most, MiB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
        **jitter(noted.starts_s, rate_hz),
    }
    figures["peers"] = {name: quantiles(spent) for name, spent in beside.items()}
    figures["about"] = {
        "rig": args.rig, "scene": args.scene, "seconds": args.seconds, "rate_hz": rate_hz,
        "python": python_used(),
        "page": who or None, "record": bool(args.record), "load": os.getloadavg()[0],
        "timer_ns": [round(x) for x in own_ns], "absent": timers.absent,
    }  # fmt: skip
    return figures


@contextmanager
def in_thread_of_its_own(
    loop: TickLoop, run: session.Session, browsers: int | None
) -> Iterator[str]:
    """Keep the loop going while a browser starts, as servos must not wait."""
    told: list[str] = []
    ready, over = threading.Event(), threading.Event()

    def look() -> None:
        with watched(run, browsers) as who:
            told.append(who)
            ready.set()
            over.wait()

    thread = threading.Thread(target=look, daemon=True)
    thread.start()
    try:
        while not ready.is_set():
            loop.step()
        yield told[0]
    finally:
        over.set()
        while thread.is_alive():
            loop.step()


def jitter(starts_s: Sequence[float], rate_hz: float) -> dict[str, float]:
    """Return how far from their slots ticks began, in milliseconds."""
    times = np.array(starts_s)
    phase = (times - times[0]) * rate_hz
    off_ms = 1e3 / rate_hz * (phase - np.round(phase))
    off_ms = np.abs(off_ms - np.median(off_ms))
    p50, p99, most = np.percentile(off_ms, (50, 99, 100))
    return {
        "jitter p50, ms": float(p50),
        "jitter p99, ms": float(p99),
        "jitter max, ms": float(most),
    }


def python_used() -> str:
    """Return which Python this is: one built without optimisations takes a fifth longer."""
    optimised = "--enable-optimizations" in (sysconfig.get_config_var("CONFIG_ARGS") or "")
    built = ", built with optimisations" if optimised else ""
    return f"{platform.python_version()} in {sys.base_prefix}{built}"


def simulated(args: argparse.Namespace, folder: Path) -> dict[str, Any]:
    """Return simulated seconds a second, of wall and processor, of three runs."""
    wall, cpu = [], []
    for _ in range(3):
        composed = session.compose(options_of(args, folder))
        run = session.Session(composed, lambda: None, lambda line: None, summarised=False)
        with run.power_on() as loop:
            gc.collect()
            began = time.monotonic(), time.process_time()
            for _ in range(round(args.seconds * composed.assembly.loop.rate_hz)):
                if (reason := loop.step()) is not None:
                    raise SystemExit(f"the run ended: {reason}")
            wall.append(args.seconds / (time.monotonic() - began[0]))
            cpu.append(args.seconds / (time.process_time() - began[1]))
            run.stopped_by = "seconds"
        composed.assembly.close()
        for file in folder.iterdir():
            file.unlink()
    return {
        "about": {"rig": args.rig, "scene": args.scene, "seconds": args.seconds, "bus": args.bus,
                  "python": python_used(), "record": bool(args.record), "load": os.getloadavg()[0]},
        "simulated seconds a second": {
            "of the wall, best": max(wall), "of the wall, median": float(np.median(wall)),
            "of processor, best": max(cpu), "of processor, median": float(np.median(cpu)),
        },
    }  # fmt: skip


def show(figures: dict[str, Any], before: dict[str, Any] | None) -> None:
    """Print the tables, with stored figures as "before -> now"."""
    print(json.dumps(figures["about"]))
    if before is not None:
        print(f"before: {json.dumps(before['about'])}")
    for table, rows in figures.items():
        if table == "about" or not isinstance(rows, dict):
            continue
        other = before.get(table, {}) if before is not None else {}
        if not any(isinstance(row, dict) for row in rows.values()):
            rows, other = {table: rows}, {table: other}
        print(f"\n{table.replace('_us', ', us of processor time')}")
        for name, row in rows.items():
            if isinstance(row, dict):
                then = other.get(name, {}) if isinstance(other.get(name), dict) else {}
                cells = (f"{key} {number(then.get(key), value)}" for key, value in row.items())
                print(f"  {name:40} {' | '.join(cells)}")
            else:
                print(f"  {name:40} {number(other.get(name), row)}")
    if "timers_left_us" in figures:
        print(
            f"\ntick with timers less their cost, minus tick without: {figures['timers_left_us']:.1f} us"
        )


def table(figures: dict[str, Any], before: dict[str, Any] | None) -> Iterator[str]:
    """Yield rows of docs/measurements/performance.md: mean / 99th percentile, new frames apart."""
    runs = [figures] if before is None else [before, figures]
    for part in ("stages_us", "calls", "peers"):
        rows = {part: figures[part]} if part == "calls" else figures[part]
        for name in rows:
            cells = []
            for run in runs:
                row = run[part] if part == "calls" else run[part].get(name, {})
                for mean, p99 in (("mean", "p99"), ("new mean", "new p99")):
                    there = mean in row
                    cells.append(f"{row[mean]:.0f} / {row[p99]:.0f}" if there else "-")
            yield f"| {name} | {' | '.join(cells)} |"


def number(before: float | None, now: float) -> str:
    """Return one figure, after the former one."""
    digits = 3 if abs(now) < 10 and now != int(now) else 1
    old = f"{before:8.{digits}f} -> " if before is not None else ""
    return f"{old}{now:8.{digits}f}"


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--rig", default="desk")
    parser.add_argument("--scene", default="visitor")
    parser.add_argument("--page", action="store_true", help="with the live page")
    parser.add_argument("--browsers", type=int, help="clients instead of Chromium")
    parser.add_argument("--record", action="store_true")
    parser.add_argument("--fast", action="store_true", help="simulated time")
    parser.add_argument("--bus", default="emulated", choices=("emulated", "ideal"))
    parser.add_argument("--table", action="store_true", help="also as rows of Markdown")
    parser.add_argument("--save", type=Path)
    parser.add_argument("--against", type=Path)
    args = parser.parse_args()
    before = json.loads(args.against.read_text(encoding="utf-8")) if args.against else None
    with tempfile.TemporaryDirectory() as folder:
        figures = (simulated if args.fast else measure)(args, Path(folder))
    show(figures, before)
    if args.table:
        print("\n".join(("", *table(figures, before))))
    if args.save:
        args.save.write_text(json.dumps(figures, indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
