"""Test files run side by side, in forks of the one process that has collected all tests.

A worker of pytest-xdist is a program of its own: four of them import the whole product and all test
files four times, one minute of processor time before the first test. A fork has all of it at once.
``pytest --workers 4`` runs files in four forks; each takes the next file when it has done one.
"""

import os
import pickle
import signal
import sys
import warnings
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import groupby
from multiprocessing import Pipe
from multiprocessing.connection import Connection, wait
from typing import Any, NoReturn

import child_processes
import pytest
import running_order
import time_slices

START, REPORT, FINISH, WARNING, READY = "start", "report", "finish", "warning", "ready"
"""What a worker tells."""


def count(config: pytest.Config) -> int:
    """Return how many workers are wanted: one means none besides this process."""
    said = str(config.getoption("--workers"))
    if said == "auto":
        return enough()
    if not said.isdigit() or int(said) < 1:
        raise pytest.UsageError(f"--workers {said}: a whole number from 1 on, or auto")
    return int(said)


def enough() -> int:
    """Return five workers for two processors: for a third of the time tests wait.

    With four of them both processors would still be idle for 6 % of the time, by chance.
    """
    processors = os.cpu_count() or 1
    return 2 * processors + 1


def run(session: pytest.Session, workers: int) -> None:
    """Run the collected tests."""
    by_file = groupby(session.items, key=lambda item: item.nodeid.partition("::")[0])
    files = deque([list(items) for _, items in by_file])
    factory: Any = session.config._tmp_path_factory  # type: ignore[attr-defined]
    factory.getbasetemp()  # else each fork would make one
    if len(files) > 10 * workers:
        _read_rigs()
    crew = [_Worker(session) for _ in range(min(workers, len(files)))]
    try:
        while crew:
            _hear(session, crew, files)
            if session.shouldfail:
                raise session.Failed(session.shouldfail)
            if session.shouldstop:
                raise session.Interrupted(session.shouldstop)
    finally:
        child_processes.end(worker.pid for worker in crew)


def _read_rigs() -> None:
    """Load the shipped rigs: their YAML and what judges it are kept, once for all forks."""
    from gazerig.config.schema import load_rig
    from gazerig.config.shipped_files import shipped_names

    for name in shipped_names("rigs"):
        load_rig(name)


def _hear(session: pytest.Session, crew: list["_Worker"], files: deque[list[pytest.Item]]) -> None:
    """Receive one message from each worker that has one; give files, replace who has died."""
    ready = wait([worker.line for worker in crew])
    for worker in [worker for worker in crew if worker.line in ready]:
        try:
            kind, what = worker.line.recv()
        except (EOFError, ConnectionError):
            crew.remove(worker)
            if left := worker.died(session):
                files.appendleft(left)
            if files:
                crew.append(_Worker(session, [one.line for one in crew]))
            continue
        if kind == READY:
            worker.items = files.popleft() if files else []
            worker.line.send([item.nodeid for item in worker.items])
            if not worker.items:
                crew.remove(worker)
                worker.line.close()
                os.waitpid(worker.pid, 0)
        else:
            worker.tell(session.config, kind, what)


class _Worker:
    """One fork, as its parent sees it."""

    def __init__(self, session: pytest.Session, others: Iterable[Connection] = ()) -> None:
        self.line, theirs = Pipe()
        self.items: list[pytest.Item] = []
        self._begun: list[str] = []
        sys.stdout.flush()
        sys.stderr.flush()
        self.pid = os.fork()
        if self.pid == 0:
            for line in (self.line, *others):
                line.close()
            _serve(session, theirs)
        theirs.close()

    def tell(self, config: pytest.Config, kind: str, what: Any) -> None:
        """Pass on to pytest what happens in the worker."""
        if kind == START:
            self._begun.append(what["nodeid"])
            config.hook.pytest_runtest_logstart(**what)
        elif kind == FINISH:
            config.hook.pytest_runtest_logfinish(**what)
        elif kind == WARNING:
            config.hook.pytest_warning_recorded.call_historic(kwargs=what)
        else:
            report = config.hook.pytest_report_from_serializable(config=config, data=what)
            config.hook.pytest_runtest_logreport(report=report)

    def died(self, session: pytest.Session) -> list[pytest.Item]:
        """Report the test during which the worker died; return those of its file after that."""
        self.line.close()
        _, status = os.waitpid(self.pid, 0)
        code = os.waitstatus_to_exitcode(status)
        how = f"by signal {signal.Signals(-code).name}" if code < 0 else f"with status {code}"
        names = [item.nodeid for item in self.items]
        done = [name for name in self._begun if name in names]
        if not self.items:
            raise session.Interrupted(f"a worker ended {how} before its first test")
        at = names.index(done[-1]) if done else 0
        item = self.items[at]
        report = pytest.TestReport(
            item.nodeid, item.location, {}, "failed", f"the worker ended {how} in this test", "call"
        )
        item.ihook.pytest_runtest_logreport(report=report)
        return self.items[at + 1 :]


def _serve(session: pytest.Session, line: Connection) -> NoReturn:
    """Run files as long as the parent gives some; this is the fork."""
    code = 1
    try:
        child_processes.end_with_parent()
        plugins = session.config.pluginmanager
        plugins.unregister(name="terminalreporter")
        teller = _Teller(session.config, line)
        plugins.register(teller)
        teller.listens = True
        capture = plugins.getplugin("capturemanager")
        capture.stop_global_capturing()  # its file is the parent's, with one place for all
        capture.start_global_capturing()
        known = {item.nodeid: item for item in session.items}
        while True:
            line.send((READY, None))
            items = [known[name] for name in line.recv()]
            if not items:
                break
            for item, following in zip(items, [*items[1:], None], strict=True):
                time_slices.ask_for(None if running_order.waits(item) else time_slices.LONG_S)
                item.config.hook.pytest_runtest_protocol(item=item, nextitem=following)
        code = 0
    finally:
        os._exit(code)


@dataclass
class _Teller:
    """Reports of pytest in a fork, sent to the parent."""

    config: pytest.Config
    line: Connection
    listens: bool = False
    """Not while it is registered: pytest repeats then what it warned of before the fork."""

    @property
    def _all_of_them(self) -> bool:
        """Whether reports of setup and teardown are requested although all passed."""
        option = self.config.option
        return option.durations is not None or option.xmlpath is not None

    def pytest_runtest_logstart(self, nodeid: str, location: object) -> None:
        self.line.send((START, {"nodeid": nodeid, "location": location}))

    def pytest_runtest_logfinish(self, nodeid: str, location: object) -> None:
        self.line.send((FINISH, {"nodeid": nodeid, "location": location}))

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        if report.passed and report.when != "call" and not self._all_of_them:
            return
        data = self.config.hook.pytest_report_to_serializable(config=self.config, report=report)
        self.line.send((REPORT, data))

    def pytest_warning_recorded(
        self, warning_message: warnings.WarningMessage, when: str, nodeid: str, location: object
    ) -> None:
        if not self.listens:
            return
        said: Any = warning_message
        try:
            pickle.dumps(said)
        except Exception:  # whatever a warning carries
            text = f"{said.category.__name__}: {said.message}"
            said = warnings.WarningMessage(
                UserWarning(text), UserWarning, said.filename, said.lineno
            )
        what = {"warning_message": said, "when": when, "nodeid": nodeid, "location": location}
        self.line.send((WARNING, what))
