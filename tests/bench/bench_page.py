"""Cost of the live page for the control loop, and its reaction time.

    python tests/bench/bench_page.py [SECONDS]

A simulated rig in real time, its servos behind a pseudo-terminal, with the page off and with
0, 1 and 5 browsers that take all that comes. Printed a run: how far ticks are off their slots,
skipped slots, and the processor time of the rig's and of the page's process, in per cent of
one core. Then, with one browser, seconds without tuning, the door is knocked at ten
times a second, a parameter is changed ten times a second, another program sets a value ten times
a second, or it reads all of them as often, in turn. Then the time until the page can be opened,
until a browser has its first picture, and from a slider that is moved (and from a stop) to the
goals on the bus. Last, what the page, a recording and both add to the loop's process
(observer_cost.py, which also runs alone); before that, the same figures as above with five
browsers, a recording, images and a camera's process that never waits, all at once.
"""

import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import ExitStack
from dataclasses import replace
from math import radians
from pathlib import Path
from typing import Any, NamedTuple, cast

import numpy as np
from websockets.sync.client import ClientConnection
from websockets.sync.connection import Connection

from gazerig.config.schema import load_rig
from gazerig.drivers.types import Camera, Detections
from gazerig.robot.app.assemble import RIGS_OWN, Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.app.run_observers import RunObservers
from gazerig.robot.control.loop import LoopCount, Tick, run
from gazerig.robot.recording.recorder import Recorder

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS))
import observer_cost  # noqa: E402
from observer_cost import recorder_at  # noqa: E402
from page_visitor import LOOKING, Visitor  # noqa: E402

TRIES = 30


def browser(url: str) -> ClientConnection:
    """Connect to the panels as a browser does, so that they are drawn for it, all of them."""
    return Visitor(url).open("/rig/panels")


def view(url: str) -> ClientConnection:
    """Connect to the view as a browser does, so that the head is drawn for it."""
    there = Visitor(url).open()
    there.send(LOOKING)
    return there


class Run(NamedTuple):
    off_slot_ms: np.ndarray
    overruns: int
    rig_percent: float
    page_percent: float


class Bench:
    """A rig that runs in a thread of this process, as gazerig run does."""

    def __init__(self, page: bool, recorder: Recorder | None = None) -> None:
        substitutes = Substitutes(body=recorder.wrap_body) if recorder is not None else RIGS_OWN
        asked = RunOptions(mock=True, fast=False, seed=0, scene="visitor")
        self.made = made = assemble(load_rig("desk"), asked, substitutes)
        robot = made.robot
        tuning = ParamStore(made.live_params, robot.command, "desk")
        options = RunOptions(page="127.0.0.1:8700" if page else None)
        quiet = lambda _: None  # noqa: E731
        self.audience = RunObservers(made, options, quiet, quiet, tuning, recorder)
        self.audience.open_files()
        if recorder is not None:
            robot.camera = cast(Camera, _WithImages(robot.camera))
        self.page = self.audience._page
        self.times: list[float] = []
        self.obeyed: list[tuple[float, object]] = []
        self.over = False
        self.count = 0
        robot.start(made.clock)
        self.opened_s = time.monotonic()
        self.audience.open()
        self.thread = threading.Thread(target=self._run)
        self.thread.start()

    def _run(self) -> None:
        stop = lambda _: "over" if self.over else None  # noqa: E731
        count = run(self.made.robot, self.made.clock, lambda: self.made.loop, stop, self._note)
        self.count = count.overruns

    def _note(self, tick: Tick) -> None:
        self.audience.update(tick)
        self.times.append(tick.t_s)
        if tick.commands:  # the goals of this tick are written
            now_s = time.monotonic()
            self.obeyed += [(now_s, order) for order in tick.commands]

    def url(self) -> str:
        assert self.page is not None
        while (url := self.page.url()) is None:
            time.sleep(0.002)
        return url

    def measure(self, seconds: float) -> Run:
        pid = self.page._process.pid if self.page is not None and self.page._process else None
        before = len(self.times), cpu_s(os.getpid()), cpu_s(pid)
        time.sleep(seconds)
        off = 1e3 * np.abs(np.diff(self.times[before[0] :]) - 0.005)
        rig, page = cpu_s(os.getpid()) - before[1], cpu_s(pid) - before[2]
        skipped = int((np.round(np.diff(self.times[before[0] :]) / 0.005) - 1).clip(0).sum())
        return Run(off, skipped, 100 * rig / seconds, 100 * page / seconds)

    def close(self) -> None:
        self.over = True
        self.thread.join()
        self.made.robot.stop()
        self.audience.close(LoopCount(0, 0, "over"))
        self.made.close()


class _WithImages:
    """A camera whose detections carry an image, as a webcam's do."""

    def __init__(self, camera: Camera) -> None:
        self._camera = camera
        self._image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), np.uint8)
        self._found: Detections | None = None

    def __getattr__(self, name: str) -> Any:
        return getattr(self._camera, name)

    def latest(self, now_s: float) -> Detections | None:
        found = self._camera.latest(now_s)
        if found is not None and (self._found is None or found.number != self._found.number):
            self._found = replace(found, image=self._image.copy())
        return self._found


BUSY = """
import os, cv2, numpy as np
os.nice(5)
image = np.random.default_rng(0).integers(0, 255, (480, 640, 3), np.uint8)
while True:
    cv2.resize(image, (320, 240)); cv2.GaussianBlur(image, (9, 9), 0)
"""
"""A camera's process that never waits."""


def flat_out(seconds: float) -> None:
    """Print the jitter with everything at once: five browsers, a recording, a busy camera."""
    busy = subprocess.Popen([sys.executable, "-c", BUSY])
    with tempfile.TemporaryDirectory() as folder:
        bench = Bench(page=True, recorder=recorder_at(Path(folder) / "run.mcap", fast=False))
        spectators = watched(bench.url(), 5)
        time.sleep(3)
        show("everything", bench.measure(seconds))
        for one in (spectators, busy):
            one.kill()
            one.wait()
        bench.close()


def cpu_s(pid: int | None) -> float:
    """Processor time of a process until now."""
    if pid is None:
        return 0.0
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


SPECTATORS = """
import sys, threading
sys.path.insert(0, {here!r})
from bench_page import browser, view
socks = [way({url!r}) for _ in range({n}) for way in (browser, view)]
def take(sock):
    for _ in sock: pass
for sock in socks: threading.Thread(target=take, args=(sock,), daemon=True).start()
sys.stdin.read()
"""


def watched(url: str, n: int) -> "subprocess.Popen[bytes]":
    """Browsers in a process of their own, which take all that comes."""
    code = SPECTATORS.format(here=str(Path(__file__).parent), url=url, n=n)
    return subprocess.Popen([sys.executable, "-c", code], stdin=subprocess.PIPE)


HANDS = {
    "no request": """
import sys, time
sys.path.insert(0, {tests!r})
from page_visitor import LOOKING, Visitor
visitor = Visitor({url!r})
while True:
    time.sleep(1 / 10)
    visitor.ask("no object")
""",
    "drag": """
import itertools, sys, time
sys.path.insert(0, {tests!r})
from page_visitor import LOOKING, Visitor
visitor = Visitor({url!r})
for n in itertools.count():
    time.sleep(1 / 10)
    visitor.ask({{"do": "set", "changes": {{"gaze.head.align": 0.5 + 0.001 * (n % 100)}}}})
""",
    "remote set": """
import itertools, time
from gazerig.robot.remote.client import RobotClient
rig = RobotClient.connect({pid})
for n in itertools.count():
    time.sleep(0.1)
    rig.set("gaze.head.align", 0.5 + 0.001 * (n % 100))
""",
    "remote get": """
import time
from gazerig.robot.remote.client import RobotClient
rig = RobotClient.connect({pid})
while True:
    time.sleep(0.1)
    rig.get()
""",
}
"""What somebody who tunes does, in a process of its own; a browser sends 60 times a second.

What the door turns away never reaches the rig: it is what the sending itself costs the machine.
"""


def tuned(how: str, url: str) -> "subprocess.Popen[bytes]":
    """Somebody who tunes until killed."""
    code = HANDS[how].format(url=url, pid=os.getpid(), tests=str(TESTS))
    return subprocess.Popen([sys.executable, "-c", code])


def tuning_rows(bench: Bench, url: str, rounds: int) -> None:
    """Cost of tuning: alternating seconds of each, as a machine is never quiet for long."""
    hands = {how: tuned(how, url) for how in HANDS}
    time.sleep(3.0)  # until they have started
    for hand in hands.values():
        hand.send_signal(signal.SIGSTOP)
    found: dict[str, list[Run]] = {how: [] for how in ("nobody", *HANDS)}
    changes = dict.fromkeys(found, 0)
    for _ in range(rounds):
        for how, runs in found.items():
            if how in hands:
                assert hands[how].poll() is None, f"{how} has ended"
                hands[how].send_signal(signal.SIGCONT)
            time.sleep(0.3)
            before = len(bench.obeyed)
            runs.append(bench.measure(1.0))
            changes[how] += len(bench.obeyed) - before
            if how in hands:
                hands[how].send_signal(signal.SIGSTOP)
    for hand in hands.values():
        hand.kill()
        hand.wait()
    for how, runs in found.items():
        show_seconds(how, runs, changes[how] / rounds)


def show_seconds(name: str, runs: list[Run], changes_per_s: float) -> None:
    skipped = [run.overruns for run in runs]
    p99 = np.median([np.percentile(run.off_slot_ms, 99) for run in runs])
    rig, page = (np.median([r[i] for r in runs]) for i in (2, 3))
    low, middle, high = np.percentile(skipped, (25, 50, 75))
    print(
        f"{name:12s} of {len(runs)} s each: {middle:3.0f} slots skipped ({low:.0f} to {high:.0f} "
        f"in half of them) | off slot p99 {p99:5.2f} ms | rig {rig:4.1f} % page {page:4.1f} % "
        f"of a core | {changes_per_s:4.1f} changes a second",
        flush=True,
    )


def show(name: str, run: Run) -> None:
    off = run.off_slot_ms
    print(
        f"{name:12s} off slot p50 {np.median(off):5.2f} p99 {np.percentile(off, 99):5.2f} "
        f"worst {off.max():6.2f} ms | {run.overruns:3d} slots skipped of {len(off)} | "
        f"rig {run.rig_percent:4.1f} % page {run.page_percent:4.1f} % of a core",
        flush=True,
    )


def first_picture(url: str) -> tuple[float, float]:
    """Seconds until a browser has the page's script, and until it has a picture and traces."""
    start_s = time.monotonic()
    Visitor(url).get()
    script_s = time.monotonic() - start_s
    with browser(url) as there:
        while True:
            if isinstance(there.recv(timeout=30), bytes):
                return script_s, time.monotonic() - start_s


def slider_number(there: Connection, label: str) -> int:
    """Return the number of the slider of a joint."""
    while True:
        data = there.recv(timeout=30)
        for number, props in json.loads(data).get("put", []) if isinstance(data, str) else ():
            if (props.get("kind"), props.get("label")) == ("slider", label):
                return int(number)


def slider_ms(bench: Bench, url: str) -> np.ndarray:
    """From a slider's message at the door to the tick that has written its goal."""
    took = []
    with browser(url) as there:
        number = slider_number(there, "neck yaw")
        taking = threading.Thread(target=lambda: [None for _ in there], daemon=True)
        taking.start()
        for n in range(TRIES):
            angle = float(5 + n % 2)
            before = len(bench.obeyed)
            start_s = time.monotonic()
            there.send(json.dumps({"set": [number, angle]}))
            while len(bench.obeyed) == before:
                time.sleep(0.0005)
            at_s, order = bench.obeyed[before]
            assert abs(order.angles_rad[0][1] - radians(angle)) < 1e-9  # type: ignore[attr-defined]
            took.append(1e3 * (at_s - start_s))
            time.sleep(0.05)
    return np.array(took)


def stop_ms(bench: Bench, url: str) -> np.ndarray:
    """From a stop at the door to the tick that has taken the torque off."""
    took, visitor = [], Visitor(url)
    for _ in range(TRIES):
        for order in ({"do": "stop", "why": "bench"}, {"do": "resume"}):
            before = len(bench.obeyed)
            start_s = time.monotonic()
            visitor.ask(order)
            while len(bench.obeyed) == before:
                time.sleep(0.0005)
            if order["do"] == "stop":
                took.append(1e3 * (bench.obeyed[before][0] - start_s))
    return np.array(took)


def main(seconds: float) -> None:
    bench = Bench(page=False)
    time.sleep(2)
    show("page off", bench.measure(seconds))
    bench.close()
    with ExitStack() as stack:
        bench = Bench(page=True)
        stack.callback(bench.close)
        url = bench.url()
        ready_s = time.monotonic() - bench.opened_s
        script_s, picture_s = first_picture(url)
        time.sleep(2)
        show("0 browsers", bench.measure(seconds))
        for n in (1, 5):
            spectators = watched(url, n)
            time.sleep(3)
            show(f"{n} browser{'s' * (n > 1)}", bench.measure(seconds))
            spectators.kill()
            spectators.wait()
        spectators = watched(url, 1)
        time.sleep(2)
        tuning_rows(bench, url, round(2 * seconds))
        spectators.kill()
        spectators.wait()
        print(f"page there after {ready_s:.2f} s; a browser has the script after {script_s:.2f} s")
        print(f"and the first camera picture after {picture_s:.2f} s")
        for name, took in (("slider", slider_ms(bench, url)), ("stop", stop_ms(bench, url))):
            print(
                f"{name} to the bus: p50 {np.median(took):.1f} p90 {np.percentile(took, 90):.1f} "
                f"worst {took.max():.1f} ms of {len(took)}"
            )


if __name__ == "__main__":
    main(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
    flat_out(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0)
    observer_cost.show(20.0)
