"""Shared by all tests: steady examples, compiled modules, one thread a process.

Property tests draw the same examples every time; HYPOTHESIS_PROFILE=search draws others. None has a
deadline: a busy machine is no fault.
"""

import gc
import os
import signal
import sys
import time
from collections.abc import Iterator
from typing import Any

import child_processes
import pytest
import running_order
import shared_compiling
import skipped_tests
import starvation
import time_slices
from _pytest.runner import runtestprotocol
from hypothesis import settings

settings.register_profile("steady", derandomize=True, deadline=None)
settings.register_profile("search", derandomize=False, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "steady"))

# If Python keeps no compiled modules, every program that a test starts compiles
# the whole source again: one second of processor time each, in more than a hundred programs.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# A shell that starts the tests in the background has them ignore Ctrl-C, and every program that
# a test starts would inherit that.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
for number in (signal.SIGQUIT, signal.SIGHUP):
    if signal.getsignal(number) == signal.SIG_IGN:
        signal.signal(number, signal.SIG_DFL)

# Tests do not use files that the user of this machine has fetched.
os.environ["GAZERIG_MODELS"] = os.path.join(os.devnull, "models")

# Tests run side by side, one worker a core: threads of a numeric library in each of them would
# only wait for each other. Read when the library loads, so before any test imports it.
for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
    os.environ.setdefault(threads, "1")


@pytest.hookimpl(hookwrapper=True)
def pytest_collection(session: pytest.Session) -> Iterator[None]:
    """Share compiled modules among processes, and keep imported ones.

    It stays, and looking it through takes a third of the time. Garbage of the tests is looked for
    less often than by default: that takes a twentieth of the time of them all. Nor
    does a robot that starts in real time look through it all, half a second for each of them;
    test_garbage.py has that done.
    """
    gc.disable()
    if worker := os.environ.get("PYTEST_XDIST_WORKER"):
        shared_compiling.compile_missing(worker, session.config)
    yield
    gc.freeze()
    gc.unfreeze = _stays_frozen
    gc.set_threshold(50_000, 20, 50)
    gc.enable()


def _stays_frozen() -> None:
    """Stands for gc.unfreeze."""


_PTY = {"PtyBus", "PtyBuses", "TerminalLine", "commands_started", "hear", "pty"}
"""Who imports one of these speaks over a pseudo-terminal, mostly with another process."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests that need a browser or pseudo-terminals; slow tests have their own mark."""
    for item in items:
        if "tab" in getattr(item, "fixturenames", ()):
            item.add_marker("browser")
        if "simulated_wires" in getattr(item, "fixturenames", ()):
            continue
        cases = getattr(getattr(item, "callspec", None), "id", "").split("-")
        if "pty" in cases or _PTY & vars(getattr(item, "module", object)).keys():
            item.add_marker("pty")
    items[:] = running_order.spread(items)


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Name the groups of skipped tests."""
    skipped = terminalreporter.stats.get("skipped", [])
    reasons = [str(report.longrepr[2]) for report in skipped if isinstance(report.longrepr, tuple)]
    for line in skipped_tests.groups(reasons):
        terminalreporter.write_line(line)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Return four workers for two processors: for a third of the time tests wait.

    More processors have fewer each, as a worker takes 0.8 GB.
    """
    processors = os.cpu_count() or 1
    return processors + min(processors, 2)


@pytest.hookimpl(optionalhook=True)
def pytest_handlecrashitem(crashitem: str, sched: Any) -> None:
    """Run the rest of a file whose worker ended, without the test that ended it."""
    running_order.leave_out(crashitem, sched.workqueue)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Function, nextitem: pytest.Item | None) -> bool | None:
    """Try a test of a client with time-outs of its own again if the machine starved it.

    In workers, tests that compute have long turns of the processor.
    """
    if "PYTEST_XDIST_WORKER" in os.environ:
        time_slices.ask_for(None if running_order.waits(item) else time_slices.LONG_S)
    if item.get_closest_marker("own_timeouts") is None:
        return None
    attempts = starvation.Attempts()
    item.ihook.pytest_runtest_logstart(nodeid=item.nodeid, location=item.location)
    while True:
        attempts.begin()
        reports = runtestprotocol(item, log=False, nextitem=nextitem)
        if not any(report.failed for report in reports) or not attempts.again():
            break
    for report in reports:
        item.ihook.pytest_runtest_logreport(report=report)
    item.ihook.pytest_runtest_logfinish(nodeid=item.nodeid, location=item.location)
    return True


@pytest.fixture(autouse=True)
def signals_stay_as_they_were() -> Iterator[None]:
    """Put back what a command that was called in the test's own process did with Ctrl-C."""
    before = signal.getsignal(signal.SIGINT)
    yield
    if signal.getsignal(signal.SIGINT) is not before:
        signal.signal(signal.SIGINT, before)


_GRACE_S = 10.0
"""So long may a process that a test has told to end go on, on a machine that does much else."""


@pytest.fixture(autouse=True)
def no_process_outlives_its_test() -> Iterator[None]:
    """End what a test has started and left, whatever became of the test; leaving it is a fault.

    What fixtures of a wider scope have started is theirs.
    """
    before = child_processes.running()
    yield
    end_s = time.monotonic() + _GRACE_S
    while left := {p: said for p, said in child_processes.running().items() if p not in before}:
        if time.monotonic() > end_s:
            child_processes.end(left)
            pytest.fail(f"the test left processes that went on: {left}")
        time.sleep(0.01)


@pytest.fixture(scope="module")
def ideal_servos() -> Iterator[None]:
    """Have all robots of a file's tests on servos without bytes; see ideal_bus."""
    from ideal_bus import ideal_buses

    with ideal_buses():
        yield


@pytest.fixture(scope="module")
def branched_children() -> Iterator[None]:
    """Have the program's own processes start as branches of this one; see branch.py."""
    from branch import branched_children

    with branched_children():
        yield


@pytest.fixture
def branched_children_here() -> Iterator[None]:
    """Have them start so in one test, in a file of which others judge the start itself."""
    from branch import branched_children

    with branched_children():
        yield


@pytest.fixture
def branched_camera() -> Iterator[None]:
    """Have cameras' processes start as forks of this one in one test."""
    from branch import branched_cameras

    with branched_cameras():
        yield


@pytest.fixture
def unlaid_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Draw figures small and without finding room for their labels, in a third of the time."""
    plotting = pytest.importorskip("gazerig.features.lab.report.plotting")

    monkeypatch.setattr(plotting, "_LAYOUT", None)
    monkeypatch.setattr(plotting, "_DPI", 30)


@pytest.fixture
def few_drawings(unlaid_figures: None, monkeypatch: pytest.MonkeyPatch) -> int:
    """Draw the first three figures alone: all of them take longest, and are drawn elsewhere."""
    report = pytest.importorskip("gazerig.features.lab.report.report")

    monkeypatch.setattr(report, "DRAWINGS", report.DRAWINGS[:3])
    return 3


@pytest.fixture
def simulated_wires(request: pytest.FixtureRequest) -> Iterator[None]:
    """Have emulated buses in this process and in simulated time; see simulated_wires.py.

    A test that is itself marked ``pty`` has them on pseudo-terminals all the same.
    """
    from simulated_wires import simulated_wires as served_here

    if request.node.get_closest_marker("pty") is not None:
        yield
        return
    with served_here():
        yield
