"""Shared by all tests: steady examples, the environment, marks and fixtures."""

import fcntl
import gc
import os
import resource
import signal
import sys
import tempfile
from collections.abc import Callable, Generator, Iterator
from contextlib import nullcontext
from math import inf
from typing import TYPE_CHECKING

import child_processes
import pytest
from branch import start_child
from hypothesis import settings

from gazerig.drivers.process import child_process

if TYPE_CHECKING:
    from commanded_robot import Running
    from recorded_run import Recorded

    from gazerig.config.schema import Rig
    from gazerig.robot.run.run import Run
    from gazerig.sim_mock.device import Device
    from gazerig.sim_mock.devices import Emulated

# The same examples every time; HYPOTHESIS_PROFILE=search draws others. A busy machine is no fault.
settings.register_profile("steady", derandomize=True, deadline=None)
settings.register_profile("search", derandomize=False, deadline=None)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "steady"))

# A shell that starts the tests in the background has them ignore Ctrl-C, and every
# program that a test starts would inherit that.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

# Without compiled modules, every program that a test starts would compile the source again.
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)
sys.dont_write_bytecode = False

# Tests do not use files that the user of this machine has fetched.
os.environ["GAZERIG_MODELS"] = os.path.join(os.devnull, "models")

# Tests run side by side, more than one worker a core: threads of a numeric library in each of
# them would only wait for each other. Read when the library loads, so before any test imports it.
for threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "OPENCV_FOR_THREADS_NUM"):
    os.environ.setdefault(threads, "1")


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_auto_num_workers() -> int:
    """Have two workers a core: their tests wait for other programs a third of the time.

    At most eight: a container may show cores that it has not got.
    """
    return min(8, 2 * len(os.sched_getaffinity(0)))


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Have one worker compile the tests of a fresh clone, while the others wait for it."""
    with open(__file__) as turn:
        try:
            fcntl.flock(turn, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            fcntl.flock(turn, fcntl.LOCK_SH)
        return (yield)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests that speak over a pseudo-terminal."""
    for item in items:
        fixtures, names = getattr(item, "fixturenames", ()), vars(getattr(item, "module", object))
        if "simulated_wires" not in fixtures and names.keys() & {"PtyBus", "PtyBuses", "pty"}:
            item.add_marker("pty")


def pytest_collection_finish() -> None:
    """Exempt what is loaded by now from garbage collection: a third of each fork's start."""
    gc.collect()
    gc.freeze()


@pytest.fixture(autouse=True)
def restored_signals() -> Iterator[None]:
    """Restore the handlers of signals after a command or a head in the test's own process."""
    numbers = signal.SIGINT, signal.SIGTERM, signal.SIGHUP
    before = [signal.getsignal(number) for number in numbers]
    yield
    for number, handler in zip(numbers, before, strict=True):
        if signal.getsignal(number) != handler:
            signal.signal(number, handler)


@pytest.fixture(scope="session", autouse=True)
def chromium_ends() -> Iterator[None]:
    """End the Chromium that a worker's tests have shared, if there was one."""
    yield
    if "browser" in sys.modules:
        sys.modules["browser"].end_chromium()


@pytest.fixture(scope="session", autouse=True)
def own_sockets() -> Iterator[None]:
    """Have a worker's heads listen where no other command reaches them, nor theirs a real head."""
    with tempfile.TemporaryDirectory(prefix="gz-") as folder, pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_RUNTIME_DIR", folder)
        yield


@pytest.fixture(scope="session", autouse=True)
def forked_children() -> Iterator[None]:
    """Have emulated buses and writers of recordings in forks, which load no module.

    Nor does each head that starts look for garbage among all that pytest has loaded.
    """
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(child_process, "start", start_child)
        patch.setattr("gazerig.robot.loop.loop.freeze_objects", lambda: None)
        patch.setattr("gazerig.robot.run.session.frozen_objects", nullcontext)
        yield


@pytest.fixture(autouse=True)
def no_process_outlives_its_test() -> Iterator[None]:
    """End what a test has started and left, and fail it; fixtures of a wider scope end theirs."""
    before = child_processes.running()
    yield
    if left := child_processes.end_others(before):
        pytest.fail(f"the test left processes that went on: {left}")


@pytest.fixture
def started() -> Iterator["Callable[[Rig], Run]"]:
    """Return what starts a rig before a visitor in simulated time; all are closed at the end."""
    from fakes.runs import simulated

    begun = []

    def start(rig: "Rig") -> "Run":
        made = simulated(rig)
        begun.append(made)
        made.robot.start(made.clock)
        return made

    yield start
    for made in begun:
        made.robot.stop()
        made.close()


@pytest.fixture
def running() -> Iterator["Running"]:
    """A desk rig face to face with a person, a second on, that ticks on request."""
    from commanded_robot import running_desk

    with running_desk() as running:
        yield running


@pytest.fixture
def still_people_count(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let people count who have not moved, except in tests of life."""
    if "sway_m" not in request.fixturenames:
        monkeypatch.setattr("gazerig.robot.perception.track._COUNTS_S", inf)


@pytest.fixture
def small_disk() -> Iterator[None]:
    """Let no file grow beyond 60 kB, as on a disk that is nearly full."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # by default it ends the process
    resource.setrlimit(resource.RLIMIT_FSIZE, (60_000, before[1]))
    yield
    resource.setrlimit(resource.RLIMIT_FSIZE, before)
    signal.signal(signal.SIGXFSZ, handler)


@pytest.fixture
def devices(monkeypatch: pytest.MonkeyPatch) -> "list[Device]":
    """Return a list that gets the emulated devices behind the runs of this test."""
    from gazerig.robot.run import buses

    made: list[Device] = []
    build = buses.build

    def built(line: "Emulated", now_s: "Callable[[], float]") -> "Device":
        made.append(build(line, now_s))
        return made[-1]

    monkeypatch.setattr(buses, "build", built)
    return made


@pytest.fixture(scope="session")
def desk_rig() -> "Rig":
    from gazerig.config.schema import load_rig

    return load_rig("desk")


@pytest.fixture(scope="session")
def maker_rig() -> "Rig":
    from gazerig.config.schema import load_rig

    return load_rig("maker")


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> "Recorded":
    """A run in which one of everything is ordered."""
    from recorded_run import ordered, record

    from gazerig.robot.loop import body

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(body, "MIN_HOLD_S", 0.1)  # a shorter run
        return record(tmp_path_factory.mktemp("runs") / "run.mcap", 1.5, ordered)


@pytest.fixture(scope="module")
def ideal_servos() -> Iterator[None]:
    """Have all robots of a file's tests on servos without bytes; see ideal_bus."""
    from ideal_bus import ideal_buses

    with ideal_buses():
        yield


@pytest.fixture
def simulated_wires(request: pytest.FixtureRequest) -> Iterator[None]:
    """Serve emulated buses here in simulated time, except to a test that is marked ``pty``."""
    from simulated_wires import simulated_wires as served_here

    if request.node.get_closest_marker("pty") is not None:
        yield
        return
    with served_here():
        yield
