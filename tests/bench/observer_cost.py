"""Cost of observers for the control loop's process, in microseconds of processor a tick.

    python tests/bench/observer_cost.py [SECONDS]

One run of the desk rig in real time before a simulated visitor, its servos behind a
pseudo-terminal. In turn, a quarter of a second each, nobody is given the ticks, the page with one
browser, the recording, and both; so all are measured under the same load. The process's time has
all its threads in it, the loop's thread's only its own.
"""

import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
from bench_recording import recorder as recorder_at

from gazerig.config.schema import load_rig
from gazerig.robot.app.assemble import Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.app.run_observers import RunObservers
from gazerig.robot.control.loop import LoopCount, Tick, run
from gazerig.robot.recording.recorder import Recorder

TESTS = Path(__file__).parents[1]

SETTLING_S = 4.0
WINDOW_TICKS, SKIPPED = 60, 10
"""Ticks in which the same ones look on; the first of them still find what was before."""
WAYS = ("alone", "page", "recording", "both")


class Costs:
    """Times of the ticks of a run, by who looks on."""

    def __init__(self, observers: RunObservers, recorder: Recorder) -> None:
        self._observers, self._recorder = observers, recorder
        self._sinks = {sink[0]: sink for sink in recorder.stream._sinks}
        self.windows: dict[str, list[tuple[float, float, float]]] = {way: [] for way in WAYS}
        self._way, self._number, self._start = "both", 0, (0, 0)
        self._calls_ns = 0

    def watch(self, tick: Tick) -> None:
        """Hand a tick to those whose turn it is, and read the clocks."""
        way, observers = self._way, self._observers
        start_ns = time.thread_time_ns()
        if way == "recording":
            self._recorder.record(tick)
        elif way != "alone":
            observers.update(tick)
        self._calls_ns += time.thread_time_ns() - start_ns
        self._number += 1
        place = self._number % WINDOW_TICKS
        if place == SKIPPED:
            self._start, self._calls_ns = (time.process_time_ns(), time.thread_time_ns()), 0
        elif place == 0:
            now = time.process_time_ns(), time.thread_time_ns()
            process, thread = (
                (end - start) / (WINDOW_TICKS - SKIPPED) / 1e3
                for start, end in zip(self._start, now, strict=True)
            )
            calls = self._calls_ns / (WINDOW_TICKS - SKIPPED) / 1e3
            self.windows[way].append((process, thread, calls))
            self._turn()

    def _turn(self) -> None:
        """Let the next ones look on."""
        self._way = way = WAYS[(WAYS.index(self._way) + 1) % len(WAYS)]
        names = {"page": ["the page"], "recording": ["the recording"], "both": list(self._sinks)}
        self._recorder.stream._sinks = tuple(self._sinks[name] for name in names.get(way, ()))
        self._recorder._body_records.clear()

    def show(self) -> None:
        """Print the lower quartile of the windows: other programs only ever make them longer."""
        low = {way: np.percentile(windows, 25, axis=0) for way, windows in self.windows.items()}
        process, thread, _ = low["alone"]
        print(
            f"loop's process alone: {process:.0f} us of processor a tick, of these {thread:.0f} in "
            "the loop's thread"
        )
        for way in WAYS[1:]:
            process, thread, calls = low[way] - low["alone"]
            print(
                f"loop's process: {process:4.0f} us a tick added by {way}, of these {thread:4.0f} "
                f"in the loop's thread; the calls themselves take {calls:.0f}"
            )


def show(seconds: float) -> None:
    """Measure and print all."""
    with tempfile.TemporaryDirectory() as folder:
        recorder = recorder_at(Path(folder) / "run.mcap", fast=False)
        substitutes = Substitutes(body=recorder.wrap_body)
        asked = RunOptions(mock=True, fast=False, seed=0, scene="visitor")
        made = assemble(load_rig("desk"), asked, substitutes)
        tuning = ParamStore(made.live_params, made.robot.command, "desk")
        options = RunOptions(page="127.0.0.1:8760")
        observers = RunObservers(made, options, _drop, None, tuning, recorder)
        observers.open_files()
        made.robot.start(made.clock)
        observers.open()
        costs = Costs(observers, recorder)
        whole_s = SETTLING_S + seconds
        stop: Callable[[float], str | None] = lambda s: "over" if s >= whole_s else None  # noqa: E731
        over = threading.Event()
        spectator = threading.Thread(target=_spectate, args=(observers, over), name="bench")
        spectator.start()
        loop = threading.Thread(
            target=lambda: run(made.robot, made.clock, lambda: made.loop, stop, costs.watch),
            name="loop",
        )
        loop.start()
        time.sleep(SETTLING_S)
        for windows in costs.windows.values():
            windows.clear()
        threads = sorted(one.name for one in threading.enumerate())
        loop.join()
        over.set()
        spectator.join()
        made.robot.stop()
        observers.close(LoopCount(0, 0, "over"))
        made.close()
    costs.show()
    print(f"threads: {', '.join(threads)}")


SPECTATOR = """
import sys
sys.path.insert(0, {tests!r})
from page_visitor import LOOKING, Visitor
there = Visitor({url!r}).open()
there.send(LOOKING)
for _ in there: pass
"""


def _spectate(observers: RunObservers, over: threading.Event) -> None:
    """Look at the page as one browser does, from a process of its own."""
    page = observers._page
    assert page is not None
    while (url := page.url()) is None:
        time.sleep(0.05)
    code = SPECTATOR.format(tests=str(TESTS), url=url)
    with subprocess.Popen([sys.executable, "-c", code]) as browser:
        over.wait()
        browser.kill()


def _drop(line: str) -> None:
    """Print nothing."""


if __name__ == "__main__":
    sys.setswitchinterval(0.0003)
    show(float(sys.argv[1]) if len(sys.argv) > 1 else 20.0)
