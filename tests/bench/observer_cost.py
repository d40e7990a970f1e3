"""What those who look on cost the control loop's process, in microseconds of processor a tick.

    python tests/bench/observer_cost.py [SECONDS] [ROUNDS]

The desk rig in real time before a simulated visitor, its servos behind a pseudo-terminal: alone,
with the page and one browser, with a recording, and with both; in turn, and the least of the
rounds counts. The process's time has all its threads in it, the loop's thread's only its own.
"""

import sys
import tempfile
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from gazerig.config.schema import load_rig
from gazerig.config.text import rig_text, walk_text
from gazerig.robot.app.assemble import Substitutes, assemble
from gazerig.robot.app.options import RunOptions
from gazerig.robot.app.param_store import ParamStore
from gazerig.robot.app.run_observers import RunObservers
from gazerig.robot.control.loop import LoopCount, Tick, run
from gazerig.robot.recording.recorder import Recorder
from gazerig.robot.recording.run_info import RunInfo, versions

TESTS = Path(__file__).parents[1]
sys.path.insert(0, str(TESTS))

SETTLING_S = 3.0
WAYS = {"alone": (False, False), "page": (True, False), "recording": (False, True), "both": (True, True)}  # fmt: skip


class Cost(NamedTuple):
    """Microseconds of processor a tick: of the whole process, of the loop's thread alone."""

    process_us: float
    thread_us: float


def measured(page: bool, record: bool, seconds: float) -> tuple[Cost, list[str]]:
    """Run the rig once; return what a tick cost, and the names of its process's threads."""
    with tempfile.TemporaryDirectory() as folder:
        recorder = _recorder(Path(folder) / "run.mcap") if record else None
        rig = load_rig("desk")
        substitutes = Substitutes(body=recorder.recorded) if recorder else Substitutes()
        made = assemble(
            rig, RunOptions(mock=True, fast=False, seed=0, scene="visitor"), substitutes
        )
        tuning = ParamStore(made.live, made.robot.command, "desk")
        options = RunOptions(page="127.0.0.1:8760" if page else None, fast=not page)
        observers = RunObservers(made, options, _drop, None, tuning, recorder)
        observers.open_files()
        made.robot.start(made.clock)
        observers.open()
        marks: list[tuple[int, int]] = []
        threads: list[str] = []

        def watch(tick: Tick) -> None:
            observers.update(tick)
            marks.append((time.process_time_ns(), time.thread_time_ns()))

        over = threading.Event()
        spectator = threading.Thread(target=_spectate, args=(observers, over)) if page else None
        if spectator is not None:
            spectator.start()
        whole_s = SETTLING_S + seconds
        stop: Callable[[float], str | None] = lambda s: "over" if s >= whole_s else None  # noqa: E731
        loop = threading.Thread(target=lambda: run(made.robot, made.clock, lambda: made.loop, stop, watch), name="loop")  # fmt: skip
        loop.start()
        time.sleep(SETTLING_S)
        threads = sorted(one.name for one in threading.enumerate())
        loop.join()
        over.set()
        if spectator is not None:
            spectator.join()
        made.robot.stop()
        observers.close(LoopCount(0, 0, "over"))
        made.close()
    used = marks[-int(0.9 * seconds * 200) :]
    count = len(used) - 1
    process, thread = ((used[-1][i] - used[0][i]) / count / 1e3 for i in (0, 1))
    return Cost(process, thread), threads


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
    import subprocess

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


def _recorder(path: Path) -> Recorder:
    rig = load_rig("desk")
    info = RunInfo(
        "desk", rig.profile, rig_text(rig), 0, rig.loop.rate_hz, "2026-01-31T00:00:00+00:00",
        walk_yaml=walk_text(rig.gaze.scanpath.transition_matrix), scene="visitor", mock=True,
        versions=versions(),
    )  # fmt: skip
    return Recorder(path, info)


def show(seconds: float, rounds: int) -> None:
    """Measure and print all."""
    sys.setswitchinterval(0.0003)
    least: dict[str, Cost] = {}
    names: dict[str, list[str]] = {}
    for _ in range(rounds):
        for way, (page, record) in WAYS.items():
            cost, names[way] = measured(page, record, seconds)
            least[way] = min(least.get(way, cost), cost)
    alone = least["alone"]
    print(
        f"loop's process alone: {alone.process_us:.0f} us of processor a tick, of these "
        f"{alone.thread_us:.0f} in the loop's thread"
    )
    for way in ("page", "recording", "both"):
        cost = least[way]
        print(
            f"added by {way:9s}: {cost.process_us - alone.process_us:4.0f} us a tick, of these "
            f"{cost.thread_us - alone.thread_us:4.0f} in the loop's thread"
        )
    for way, found in names.items():
        print(f"threads {way}: {', '.join(found)}")


if __name__ == "__main__":
    show(float(sys.argv[1]) if len(sys.argv) > 1 else 10.0, int(sys.argv[2]) if len(sys.argv) > 2 else 2)  # fmt: skip
