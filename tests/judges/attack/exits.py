"""Every exit of every interface on every kind of bus: how many servos keep their torque?

    python tests/judges/attack/exits.py [--rig desk] [--interface python] [--exit SIGKILL]

Servos are emulated on pseudo-terminals of another process, which reports their true state.
Before the blow, each case waits until every servo has its torque and the loop sends packets; a case
in which that does not come is counted as void. A servo that has its torque 20 s after the blow
counts as powered.
"""

import argparse
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from itertools import product
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2] / "helpers"))

from attack.ways_out import RIGS, START, Bench, Steps, bench, side_by_side, until
from child_processes import children, end, running_as

LONGEST_S = 20.0

HEADS = """
import logging, os, signal, sys, threading, time
import gazerig

logging.basicConfig(level="INFO")

def hold(stack):
    for rig, port in zip(sys.argv[1::2], sys.argv[2::2]):
        stack.enter_context(gazerig.open(rig, port=port, scene="visitor"))
    print("held", flush=True)

# The program's own faults, at a signal that it handles.
def blow(number, frame):
    word = open(os.environ["BLOW"]).read()
    if word == "fds":
        os.closerange(0, 4096)
    elif word == "_exit":
        os._exit(3)
    elif word == "exit":
        sys.exit(3)
    elif word == "raise":
        raise ZeroDivisionError

signal.signal(signal.SIGUSR2, blow)
"""

PYTHON = (
    HEADS
    + """
from contextlib import ExitStack
with ExitStack() as stack:
    hold(stack)
    while True:
        time.sleep(1.0)
"""
)

DAEMON = (
    HEADS
    + """
from contextlib import ExitStack
over = threading.Event()

def work():
    with ExitStack() as stack:
        hold(stack)
        while True:
            time.sleep(1.0)

def quit(number, frame):
    over.set()

signal.signal(signal.SIGUSR2, quit)
threading.Thread(target=work, daemon=True).start()
over.wait()
"""
)

POOLS = {
    "to_thread": """
import asyncio

async def main():
    await asyncio.to_thread(work)

asyncio.run(main())
""",
    "thread pool": """
from concurrent.futures import ThreadPoolExecutor
with ThreadPoolExecutor() as pool:
    pool.submit(work).result()
""",
    "thread pool, shut down": """
from concurrent.futures import ThreadPoolExecutor
pool = ThreadPoolExecutor()
try:
    pool.submit(work).result()
finally:
    pool.shutdown(wait=True)
""",
    "event loop": """
import asyncio
loop = asyncio.new_event_loop()
try:
    loop.run_until_complete(loop.run_in_executor(None, work))
finally:
    loop.run_until_complete(loop.shutdown_default_executor())
""",
    "thread pool, left open": """
from concurrent.futures import ThreadPoolExecutor
ThreadPoolExecutor().submit(work).result()
""",
}
"""Threads that the program waits for before it ends."""

POOL = (
    HEADS
    + """
from contextlib import ExitStack

def work():
    with ExitStack() as stack:
        hold(stack)
        while True:
            time.sleep(1.0)
"""
)


class Target(NamedTuple):
    """A program that holds heads.

    pid: of the process that has the loop, which may be a child of the program
    """

    program: "subprocess.Popen[bytes]"
    pid: int
    folder: Path

    def guardians(self) -> list[int]:
        """Return the guardians of the heads."""
        return running_as(self.pid, "guardian")


Strike = Callable[[Target], Iterator[float]]
"""Yields the seconds between its blows."""


def send(*numbers: signal.Signals, gap_s: float = 0.03) -> Strike:
    def strike(target: Target) -> Iterator[float]:
        for i, number in enumerate(numbers):
            if i:
                yield gap_s
            with suppress(ProcessLookupError) if i else nullcontext():
                os.kill(target.pid, number)

    return strike


def fault(word: str) -> Strike:
    """Have the program do something to itself."""

    def strike(target: Target) -> Iterator[float]:
        (target.folder / "blow").write_text(word)
        os.kill(target.pid, signal.SIGUSR2)
        yield 0.0

    return strike


def without_guardian(target: Target) -> Iterator[float]:
    """Suspend the guardian; it is replaced within a second, and then the loop is killed."""
    guardians = target.guardians()
    if not guardians:
        raise OSError("there is no guardian")
    for one in guardians:
        os.kill(one, signal.SIGSTOP)
    yield 2.0
    os.kill(target.pid, signal.SIGKILL)


def without_page(target: Target) -> Iterator[float]:
    """Suspend every child but the guardian, then ask for the end."""
    for one in {*children(target.pid)} - {*target.guardians()}:
        os.kill(one, signal.SIGSTOP)
    yield 1.0
    os.kill(target.pid, signal.SIGTERM)


INT, TERM = signal.SIGINT, signal.SIGTERM
EXITS: dict[str, Strike] = {
    "SIGINT": send(INT),
    "2x SIGINT, 30 ms": send(INT, INT),
    "2x SIGINT, .3 s": send(INT, INT, gap_s=0.3),
    "2x SIGINT, 1 s": send(INT, INT, gap_s=1.0),
    "5x SIGINT, .4 s": send(*[INT] * 5, gap_s=0.4),
    "SIGTERM": send(TERM),
    "3x SIGTERM, .4 s": send(TERM, TERM, TERM, gap_s=0.4),
    "SIGHUP": send(signal.SIGHUP),
    "SIGQUIT": send(signal.SIGQUIT),
    "SIGUSR1": send(signal.SIGUSR1),
    "SIGSEGV": send(signal.SIGSEGV),
    "SIGABRT": send(signal.SIGABRT),
    "SIGKILL": send(signal.SIGKILL),
    "SIGSTOP": send(signal.SIGSTOP),
    "guardian suspended, then SIGKILL": without_guardian,
    "children suspended, then SIGTERM": without_page,
    "all descriptors closed": fault("fds"),
    "os._exit": fault("_exit"),
    "sys.exit": fault("exit"),
    "exception": fault("raise"),
    "the main thread ends": fault(""),
}
OWN = {"all descriptors closed", "os._exit", "sys.exit", "exception"}
"""What a program does to itself: programs of Python alone."""

STAYS = {"SIGSTOP", "all descriptors closed"}
"""The program itself does not end."""

INTERFACES = ("command", "python", "daemon thread", *POOLS, "two heads")


def meets(interface: str, exit_: str) -> bool:
    """Return whether an interface can end like that."""
    if exit_ in OWN:
        return interface in ("python", "two heads")
    return exit_ != "the main thread ends" or interface == "daemon thread"


Begin = Callable[..., "subprocess.Popen[bytes]"]
"""Starts Python with a program, its words and options of subprocess.Popen."""


def fresh(code: str, words: list[str], **options: Any) -> "subprocess.Popen[bytes]":
    """Start it as a shell does."""
    return subprocess.Popen(
        [sys.executable, "-c", code, *words],
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),  # nohup has it ignored
        **options,
    )


@contextmanager
def held(interface: str, benches: list[Bench], begin: Begin) -> Iterator[Target]:
    """Start a program of an interface that holds the heads of some rigs."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        rigs = [word for one in benches for word in (one.file, one.port)]
        (at,) = benches[:1]
        code = {
            "command": START, "python": PYTHON, "daemon thread": DAEMON, "two heads": PYTHON,
            **{name: POOL + rest for name, rest in POOLS.items()},
        }[interface]  # fmt: skip
        words = {
            "command": ["run", at.file, "--port", at.port, "--scene", "visitor", "--page", "127.0.0.1:8911"],
        }.get(interface, rigs)  # fmt: skip
        environment = {**os.environ, "BLOW": str(folder / "blow"), "XDG_RUNTIME_DIR": name}
        null = subprocess.DEVNULL
        program = begin(
            code,
            words,
            env=environment,
            start_new_session=True,
            stdin=null,
            stdout=null,
            stderr=(folder / "errors").open("w"),
        )
        try:
            yield Target(program, program.pid, folder)
        finally:
            end([program.pid])
            program.wait()


def _holds(program: "subprocess.Popen[bytes]", benches: list[Bench]) -> bool:
    """Return whether all servos have their torque, and the loop ticks."""
    if program.poll() is not None:
        raise RuntimeError(f"the program ended before the blow, with {program.returncode}")
    return all(one.on() == len(one.rig.joints) for one in benches)


class Row(NamedTuple):
    """Outcome of a case; void: reason why it proves nothing, or ""; told: its standard error."""

    powered: int
    of: int
    seconds: float
    code: int | None
    void: str
    off_park_deg: float = 0.0
    told: str = ""


def case(
    kind: str, interface: str, exit_: str, begin: Begin = fresh, rate_hz: float | None = None
) -> Steps[Row]:
    """Carry out one case, with another rate of the loops if one is given."""
    with ExitStack() as stack:
        names = [kind]
        if interface == "two heads":
            names.append("feetech" if kind != "feetech" else "desk")
        benches = [stack.enter_context(bench(name, rate_hz)) for name in names]
        of = sum(len(one.rig.joints) for one in benches)
        target = stack.enter_context(held(interface, benches, begin))
        program = target.program
        try:
            if not (yield from until(lambda: _holds(program, benches))):
                return Row(0, of, 0.0, program.poll(), "no torque within 60 s")
            yield 0.5
            for at in benches:
                if not (yield from at.busy()):
                    return Row(0, of, 0.0, program.poll(), "the loop does not tick")
            yield from EXITS[exit_](target)
        except (OSError, ValueError, RuntimeError) as error:
            return Row(0, of, 0.0, program.poll(), f"the blow failed: {error}")
        struck_s = time.monotonic()
        off = lambda: not any(at.on() for at in benches)  # noqa: E731
        yield from until(off, LONGEST_S, every_s=0.01)
        took_s = time.monotonic() - struck_s
        yield 0.3  # and it stays off
        left = sum(at.on() for at in benches)
        if exit_ not in STAYS:
            yield from until(lambda: program.poll() is not None, 8.0)
        off_deg = max(at.off_park_deg() for at in benches)
        told = (target.folder / "errors").read_text()
        return Row(left, of, took_s, program.poll(), "", off_deg, told)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rig", action="append", choices=RIGS)
    parser.add_argument("--interface", action="append", choices=INTERFACES)
    parser.add_argument("--exit", action="append", choices=EXITS)
    asked = parser.parse_args()
    print("| bus | interface | exit | powered | s | code |\n|--|--|--|--|--|--|")
    cases = powered = void = 0
    for kind, interface, exit_ in product(
        asked.rig or RIGS, asked.interface or INTERFACES, asked.exit or EXITS
    ):
        if not meets(interface, exit_):
            continue
        (row,) = side_by_side([case(kind, interface, exit_)])
        cases, powered, void = cases + 1, powered + bool(row.powered), void + bool(row.void)
        what = row.void or f"{row.powered} of {row.of}"
        print(
            f"| {RIGS[kind]} | {interface} | {exit_} | {what} | {row.seconds:.2f} | {row.code} |",
            flush=True,
        )
    print(f"\n{cases} cases: {powered} with powered servos, {void} void")
    return 1 if powered or void else 0


if __name__ == "__main__":
    sys.exit(main())
