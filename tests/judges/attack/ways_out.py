"""Every exit of every command that switches torque on: how many servos stay on?

    python tests/judges/attack/ways_out.py [--rig desk] [--command run] [--way SIGHUP]

Servos are emulated on a pseudo-terminal, which reports their true state. A row is one
command on one rig, and how it was ended: servos left on, how far the joints are from their
parking pose, seconds until the program was gone, its exit code and the last line that it printed. A
command that takes longer than 20 s to end counts as hanging and is killed. A case proves nothing,
and is counted as void, unless torque was on and the program spoke to its servos right before the
blow, and the program told of a blow that it can tell of.
"""

import argparse
import contextlib
import fcntl
import json
import os
import pty
import re
import resource
import select
import signal
import subprocess
import sys
import termios
import time
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator
from heapq import heappop, heappush
from itertools import product
from math import degrees
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, NamedTuple, TypeVar

sys.path.insert(0, str(Path(__file__).parents[2] / "helpers"))

from board_rig import on_pca9685
from child_processes import running_as
from present import present
from slow_rigs import at_rate

from gazerig.config.schema import Rig, load_rig
from gazerig.robot.run.emulated import emulated_lines
from gazerig.robot.run.rig_limits import park_rad
from gazerig.sim_mock.pty.client import PtyBuses

RIGS = {"desk": "dynamixel", "feetech": "feetech", "maker": "maestro", "pca9685": "pca9685"}
BOARDS = ("maker", "pca9685")
LONGEST_S = 20.0
# Broken on purpose, from outside: what a plug-in, a small machine or a bug of ours would do.
BROKEN = {
    "observer raises": "import gazerig.robot.loop.joint_faults as m\n"
    "def update(self, tick):\n    raise RuntimeError('plug-in')\nm.JointFaults.update = update\n",
    "MemoryError in the loop": "import gazerig.robot.loop.loop as m\n"
    "tick, n = m.Robot.tick, []\n"
    "def update(self, *words):\n    n.append(0)\n"
    "    if len(n) > 200:\n        raise MemoryError\n"
    "    return tick(self, *words)\nm.Robot.tick = update\n",
}
TOLD = {
    "observer raises": "plug-in",
    "MemoryError in the loop": "unexpected MemoryError",
    "page killed": "the page has stopped",
    "recorder's disk full": "recording",
}
"""What the program says of a blow that it notices."""
START = (
    "import sys; sys.argv[0] = 'gazerig'; from gazerig.robot.cli.entry_point import main; main()"
)


def commands(name: str, rig: str = "") -> dict[str, list[str]]:
    """Return what is typed, by name; each holds the torque on until it is ended."""
    rig = rig or name
    joint = "eyes_pan" if name in BOARDS else "left_eye_pan"
    out = ["--out", "/tmp/ways_out_face.yaml"] if rig == name else []
    return {
        "run": ["run", rig, "--scene", "visitor", "--no-page"],
        "jog": ["jog", rig, joint, "8", "--hold", "--yes"],
        "calibrate": ["calibrate", rig, "--dry-run", "--joint", joint, "--yes"],
        "calibrate face": ["calibrate", "face", rig, "--scene", "sits-still", *out],
        "monitor": ["monitor", rig, "--json"],
    }  # fmt: skip


class Bench(NamedTuple):
    """A rig whose servos are emulated; file: what is typed for it."""

    name: str
    file: str
    rig: Rig
    buses: PtyBuses
    port: str

    def servos(self) -> list[dict[str, Any]]:
        """Return the servos as they are."""
        found: list[dict[str, Any]] = json.loads(self.buses.command("status"))["servos"]
        ids = {joint.id for joint in self.rig.joints.values()}
        return [servo for servo in found if servo["id"] in ids]

    def on(self) -> int:
        """Count the servos with torque, or with pulses."""
        return sum(bool(servo.get("torque", servo.get("target"))) for servo in self.servos())

    def busy(self) -> "Steps[bool]":
        """Return whether a program goes on speaking to the servos: its loop ticks."""
        before = self._read_bytes()
        return (yield from until(lambda: self._read_bytes() > before, 2.0))

    def _read_bytes(self) -> int:
        """Return what the emulator has read until now, including requests for its status."""
        return int(Path(f"/proc/{self.buses.pid}/io").read_text().split()[1])

    def off_park_deg(self) -> float:
        """Return how far the worst joint is from its parking pose."""
        at = {servo["id"]: servo.get("place", servo.get("position")) for servo in self.servos()}
        park = park_rad(self.rig)
        return max(
            abs(degrees(j.make_linkage().angle_rad(present(at[j.id])) - park.get(name, 0.0)))
            for name, j in self.rig.joints.items()
        )


@contextlib.contextmanager
def bench(name: str, rate_hz: float | None = None) -> Iterator[Bench]:
    """Emulate the servos of a rig, whose loop may have another rate than the shipped one."""
    with TemporaryDirectory() as folder, PtyBuses() as buses:
        file = on_pca9685(folder) if name == "pca9685" else name
        if rate_hz is not None:
            file = at_rate(Path(folder), file, rate_hz)
        rig = load_rig(file)
        (path,) = buses.start(emulated_lines(rig)).values()
        yield Bench(name, file, rig, buses, path)


class Started(NamedTuple):
    """A command at work.

    errors: where its standard error can be read, -1 nowhere; master: of its terminal, or -1
    reader: process that reads its output, None for this one
    """

    process: "subprocess.Popen[bytes]"
    errors: int
    master: int
    reader: "subprocess.Popen[bytes] | None" = None

    @property
    def pid(self) -> int:
        return self.process.pid


def typed(words: list[str], breaks: str = "") -> list[str]:
    return [sys.executable, "-c", breaks + START, *words]


Begin = Callable[..., "subprocess.Popen[bytes]"]
"""Starts gazerig with words that are typed and options of subprocess.Popen."""


def fresh(words: list[str], breaks: str = "", **options: Any) -> "subprocess.Popen[bytes]":
    """Start it as a shell does."""
    return subprocess.Popen(typed(words, breaks), **options)


def started(words: list[str], way: str, folder: str, begin: Begin) -> Started:
    """Start a command as its end requires; no other program finds its socket in its folder."""
    env = {**os.environ, "COLUMNS": "100", "XDG_RUNTIME_DIR": folder}
    breaks = BROKEN.get(way, "")
    command = typed(words, breaks)
    pipe = subprocess.PIPE
    if way == "reader killed":
        reader = subprocess.Popen(["cat"], stdin=pipe, stdout=subprocess.DEVNULL)
        assert reader.stdin is not None
        with reader.stdin as into:
            process = begin(
                words, breaks, stdin=pipe, stdout=into, stderr=into,
                env=env, preexec_fn=os.setsid,
            )  # fmt: skip
        return Started(process, -1, -1, reader)
    if way.startswith("tty"):
        master, slave = pty.openpty()

        def own() -> None:
            os.close(master)
            os.setsid()
            fcntl.ioctl(0, termios.TIOCSCTTY, 0)

        process = begin(
            words, breaks, stdin=slave, stdout=slave, stderr=slave, env=env, preexec_fn=own
        )
        os.close(slave)
        return Started(process, -1, master)
    if way == "stderr and stdout closed":
        shell = ["bash", "-c", 'exec "$@" >&- 2>&-', "-", *command]
        begin = lambda *words, **options: subprocess.Popen(shell, **options)  # noqa: E731
    errors: int = pipe
    if way == "stderr on a full disk":
        errors = os.open("/dev/full", os.O_WRONLY)

    def small_files() -> None:
        os.setsid()
        if way == "recorder's disk full":
            resource.setrlimit(resource.RLIMIT_FSIZE, (300_000, 300_000))

    process = begin(
        words, breaks, stdin=pipe, stdout=pipe, stderr=errors, env=env, preexec_fn=small_files
    )
    assert process.stderr is not None or errors != pipe
    got = process.stderr.fileno() if process.stderr is not None else -1
    if way == "full pipe that nobody reads":
        fcntl.fcntl(got, fcntl.F_SETPIPE_SZ, 4096)
        full = os.open(f"/proc/self/fd/{got}", os.O_WRONLY | os.O_NONBLOCK)
        with contextlib.suppress(BlockingIOError):
            while True:
                os.write(full, b"." * 4096)
        os.close(full)
    return Started(process, got, -1)


T = TypeVar("T")
Steps = Generator[float, None, T]
"""A case at work: it yields the seconds that it waits, and returns its outcome."""


def side_by_side(cases: Iterable[Steps[T]], at_once: int = 1) -> list[T]:
    """Carry out cases, several at once; return their outcomes in order."""
    waiting, outcomes = deque(enumerate(cases)), {}
    due: list[tuple[float, int, Steps[T]]] = []
    try:
        while waiting or due:
            while waiting and len(due) < at_once:
                heappush(due, (0.0, *waiting.popleft()))
            at_s, number, case = due[0]
            time.sleep(max(0.0, at_s - time.monotonic()))
            heappop(due)
            try:
                heappush(due, (time.monotonic() + next(case), number, case))
            except StopIteration as end:
                outcomes[number] = end.value
    finally:
        for _, _, case in due:
            case.close()
    return [outcomes[number] for number in sorted(outcomes)]


def until(
    true: Callable[[], bool], within_s: float = 60.0, master: int = -1, every_s: float = 0.05
) -> Steps[bool]:
    """Wait, and read meanwhile what the program shows on its terminal, as a terminal does."""
    end_s = time.monotonic() + within_s
    while time.monotonic() < end_s:
        if true():
            return True
        if master >= 0 and select.select([master], [], [], 0.0)[0]:
            with contextlib.suppress(OSError):  # no process is left
                os.read(master, 65536)
        yield every_s
    return False


def send(*numbers: signal.Signals, gap_s: float = 0.7) -> Callable[[Started], Iterator[float]]:
    def end(run: Started) -> Iterator[float]:
        for number in numbers:
            if run.process.poll() is None:
                run.process.send_signal(number)
            yield gap_s

    return end


def close_tty(run: Started) -> Iterator[float]:
    null = os.open(os.devnull, os.O_RDWR)
    os.dup2(null, run.master)  # so that no other case gets its number
    os.close(null)
    yield 0.0


def stop_tty(run: Started) -> Iterator[float]:
    """Ctrl-S, lines that no one reads for a while, then a request to end."""
    slave = os.open(f"/proc/{run.pid}/fd/2", os.O_RDWR | os.O_NOCTTY)
    termios.tcflow(slave, termios.TCOOFF)
    yield 2.0
    run.process.send_signal(signal.SIGTERM)
    os.close(slave)


def kill_page(run: Started) -> Iterator[float]:
    """The page dies; a while later a request to end."""
    for page in running_as(run.pid, "gazerig.robot.dashboard.page_main"):
        os.kill(page, signal.SIGKILL)
    yield 1.0
    run.process.send_signal(signal.SIGTERM)


def nothing(run: Started) -> Iterator[float]:
    """It ends without a request."""
    yield 0.0


def later(run: Started) -> Iterator[float]:
    yield 1.5
    if run.process.poll() is None:
        run.process.send_signal(signal.SIGTERM)


def kill_reader(run: Started) -> Iterator[float]:
    """The other end of the pipe goes away, which is a request to end; then another one."""
    assert run.reader is not None
    run.reader.kill()
    run.reader.wait()
    yield from later_unless_ended(run)


def broken_pipe(run: Started) -> Iterator[float]:
    """The reader of standard error goes away, which is a request to end; then another one."""
    assert run.process.stderr is not None
    run.process.stderr.close()
    yield from later_unless_ended(run)


def later_unless_ended(run: Started) -> Iterator[float]:
    """Request the end of a run that goes on: a second request skips the parking."""
    if not (yield from until(lambda: run.process.poll() is not None, 6.0)):
        yield from later(run)


WAYS: dict[str, Callable[[Started], Iterator[float]]] = {
    "SIGHUP": send(signal.SIGHUP),
    "SIGQUIT": send(signal.SIGQUIT),
    "SIGTERM": send(signal.SIGTERM),
    "SIGINT": send(signal.SIGINT),
    "2x SIGINT while parking": send(signal.SIGINT, signal.SIGINT),
    "6x SIGINT": send(*[signal.SIGINT] * 6, gap_s=0.1),
    "tty closed": close_tty,
    "tty stopped (Ctrl-S)": stop_tty,
    "reader killed": kill_reader,
    "stderr broken": broken_pipe,
    "stderr and stdout closed": later,
    "stderr on a full disk": later,
    "full pipe that nobody reads": later,
    "observer raises": later,
    "MemoryError in the loop": nothing,
    "page killed": kill_page,
    "recorder's disk full": later,
}
ONLY_RUN = {"observer raises", "MemoryError in the loop", "page killed", "recorder's disk full"}


class Row(NamedTuple):
    """What became of it.

    void: why the case proves nothing, "" where its target was running and the blow landed
    """

    on: int
    of: int
    off_park_deg: float
    seconds: float
    code: int | None
    lines: int
    said: str
    void: str


def case(
    kind: str, name: str, way: str, begin: Begin = fresh, rate_hz: float | None = None
) -> Steps[Row]:
    """Carry out one case, with another rate of the loop if one is given."""
    with bench(kind, rate_hz) as at:
        return (yield from attack(at, name, way, begin))


def attack(at: Bench, name: str, way: str, begin: Begin) -> Steps[Row]:
    """Start a command, wait for torque, end it, and inspect the servos."""
    words = [*commands(at.name, at.file)[name], "--port", at.port]
    folder = TemporaryDirectory()
    if way == "page killed":
        words.remove("--no-page")
    if way == "recorder's disk full":
        words += ["--record", f"{folder.name}/full.mcap", "--force"]
    run = started(words, way, folder.name, begin)
    if name == "calibrate" and at.name in BOARDS:
        keys = run.master if run.process.stdin is None else run.process.stdin.fileno()
        with contextlib.suppress(OSError):
            os.write(keys, b"1500\n+40\n")
    # A joint of smart servos is calibrated by hand, its torque off.
    is_limp = name == "monitor" or (name == "calibrate" and at.name not in BOARDS)
    needs = 0 if is_limp else 1
    # A lack of memory is timed by ticks; everything else starts when the program works.
    ended = lambda: run.process.poll() is not None  # noqa: E731
    on = lambda: at.on() >= needs or ended()  # noqa: E731
    ticks, end_s = False, time.monotonic() + 60.0
    while not ticks and not ended() and time.monotonic() < end_s:
        yield from until(on, master=run.master)
        ticks = (yield from at.busy()) and at.on() >= needs
    void = "" if ticks and not ended() else "no torque, or no loop that ticks"
    if way != "MemoryError in the loop":
        yield from until(ended, 4.2 if way == "recorder's disk full" else 1.2, run.master)
        if ended() or not on() or not (yield from at.busy()):
            void = void or "it had ended before the blow"
    began_s = time.monotonic()
    if not ended():
        yield from WAYS[way](run)
    said = b""
    reads = way not in ("full pipe that nobody reads", "stderr broken") and run.errors >= 0
    while time.monotonic() - began_s < LONGEST_S and not ended():
        if reads and select.select([run.errors], [], [], 0.0)[0]:
            said += os.read(run.errors, 65536)
        yield 0.02
    took_s = time.monotonic() - began_s if ended() else LONGEST_S
    code = run.process.poll()
    left, off = at.on(), at.off_park_deg()
    if code is None:
        os.killpg(run.pid, signal.SIGKILL)
        run.process.wait()
    if run.errors >= 0 and way != "stderr broken":
        os.set_blocking(run.errors, False)
        with contextlib.suppress(BlockingIOError, OSError):
            while more := os.read(run.errors, 65536):
                said += more
    if run.master >= 0:
        with contextlib.suppress(OSError):
            os.close(run.master)
    if run.reader is not None:
        run.reader.wait()
    for pipe in (run.process.stdin, run.process.stdout, run.process.stderr):
        with contextlib.suppress(OSError):
            if pipe is not None:
                pipe.close()
    folder.cleanup()
    lines = [line for line in said.decode(errors="replace").splitlines() if line.strip(". ")]
    last = re.sub(r"\x1b\[K|\r", "", lines[-1])[:70] if lines else ""
    if TOLD.get(way, "") not in said.decode(errors="replace"):
        void = void or f"nothing was said of: {way}"
    return Row(left, len(at.rig.joints), off, took_s, code, len(lines), last, void)


def main() -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--rig", action="append", choices=RIGS)
    parser.add_argument("--command", action="append")
    parser.add_argument("--way", action="append", choices=WAYS)
    asked = parser.parse_args()
    print("| rig | command | way out | left on | off park | s | code | last line |")
    print("|--|--|--|--|--|--|--|--|")
    left = hung = cases = void = 0
    for name in asked.rig or RIGS:
        for command, way in product(asked.command or commands(name), asked.way or WAYS):
            if way in ONLY_RUN and command != "run":
                continue
            (row,) = side_by_side([case(name, command, way)])
            cases, left, hung = cases + 1, left + row.on, hung + (row.code is None)
            void += bool(row.void)
            what = (RIGS[name], command, way, f"{row.on} of {row.of}")
            last = f"VOID: {row.void}: {row.said}" if row.void else row.said
            how = (f"{row.off_park_deg:.1f} deg", f"{row.seconds:.1f}", row.code, last)
            print("|", *[f"{cell} |" for cell in (*what, *how)], flush=True)
    print(f"\n{cases} ways out: {left} servos left on, {hung} hung, {void} void")
    return 1 if left or hung or void else 0


if __name__ == "__main__":
    sys.exit(main())
