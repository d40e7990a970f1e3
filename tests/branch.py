"""A program in a branch of this process: it has all that a process has, only its start is saved.

It has its own id, standard streams, signals and exit status, and what it imports has been imported
already: Python and the whole program take .8 s of a processor to start, in every process again.
Tests of the start itself (test_cli_start.py, command_line.gazerig) have processes of their own.
"""

import atexit
import gc
import importlib
import inspect
import multiprocessing
import os
import pickle
import runpy
import signal
import subprocess
import sys
import threading
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import child_processes
import pytest

from gazerig.drivers.camera import process as camera_process
from gazerig.drivers.process import child_process

_GIVEN = inspect.signature(subprocess.Popen._execute_child)  # type: ignore[attr-defined]
_SIGNALS = (
    *(signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT),
    *(signal.SIGTTIN, signal.SIGTTOU, signal.SIGTSTP, signal.SIGUSR1),
)


class Branch(subprocess.Popen[Any]):
    """A program in a fork of this process, with all that subprocess.Popen has.

    One starts at a time: another fork meanwhile would keep the ends of its pipes open.
    """

    starting = threading.Lock()

    def __init__(self, work: Callable[[], object], **options: Any) -> None:
        self._work = work
        with Branch.starting:
            super().__init__(["branch"], **options)

    def _execute_child(self, *given: Any) -> None:
        """Fork; the parent goes on as after a program has been started."""
        a = _GIVEN.bind(self, *given).arguments
        standard = a["p2cread"], a["c2pwrite"], a["errwrite"]
        ends = a["p2cwrite"], a["c2pread"], a["errread"]
        main = threading.current_thread() is threading.main_thread()
        self.pid = os.fork()
        if self.pid == 0:
            if main:  # a thread ends before what it has started
                child_processes.end_with_parent()
            if a["start_new_session"]:
                os.setsid()
            become(self._work, standard, ends, a["cwd"], a["env"], a["preexec_fn"])
        self._child_created = True
        self._close_pipe_fds(  # type: ignore[attr-defined]
            *(a[name] for name in ("p2cread", "p2cwrite", "c2pread", "c2pwrite")),
            *(a["errread"], a["errwrite"]),
        )


def become(
    work: Callable[[], object],
    standard: Iterable[int] = (),
    ends: Iterable[int] = (),
    cwd: str | os.PathLike[str] | None = None,
    env: dict[str, str] | None = None,
    first: Callable[[], object] | None = None,
) -> NoReturn:
    """Be another program from here on, in a process that has just been forked."""
    code = 1
    try:
        for fd in ends:
            if fd != -1:
                os.close(fd)
        for number, fd in enumerate(standard):
            if fd != -1:
                os.dup2(fd, number)
        if cwd is not None:
            os.chdir(cwd)
        if env is not None:
            os.environ.clear()
            os.environ.update(env)
        if first is not None:
            first()
        _begin_afresh()
        code = _status(work)
        threading._shutdown()  # type: ignore[attr-defined]
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        if code == -signal.SIGINT:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGINT)
    finally:
        os._exit(code)


def _begin_afresh() -> None:
    """Leave behind what the parent, a run of tests, has that a fresh process has not."""
    Branch.starting = threading.Lock()  # the fork was made while it was held
    gc.freeze()
    gc.unfreeze = lambda: None  # a full pass would copy all of the parent's memory
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    atexit._clear()
    sys.excepthook, sys.unraisablehook = sys.__excepthook__, sys.__unraisablehook__
    threading.excepthook = threading.__excepthook__
    kept.append((sys.stdin, sys.stdout, sys.stderr))  # else their files would be closed
    sys.stdin, sys.stdout = os.fdopen(0, closefd=False), os.fdopen(1, "w", closefd=False)
    sys.stderr = os.fdopen(2, "w", buffering=1, errors="backslashreplace", closefd=False)


kept: list[object] = []
fresh_start = child_process.start
"""Starts another Python, whatever stands in its place."""


def _status(work: Callable[[], object]) -> int:
    """Do the work; return the exit status that Python makes of its end, less than 0: a signal."""
    try:
        work()
    except SystemExit as end:
        if end.code is None or isinstance(end.code, int):
            return end.code or 0
        print(end.code, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        traceback.print_exc()
        return -signal.SIGINT
    except BaseException:
        traceback.print_exc()
        return 1
    return 0


def gazerig(*words: str) -> Callable[[], None]:
    """Return the program gazerig with these arguments."""

    def work() -> None:
        from gazerig.robot.cli import terminal
        from gazerig.robot.cli.entry_point import main
        from gazerig.robot.cli.terminal import LineWriter

        # That of the parent may have had a thread, which a fork has not.
        terminal._writer = LineWriter(2)
        atexit.register(terminal._writer.flush, 1.0)
        sys.argv = ["gazerig", *words]
        main()

    return work


def ran(*words: str, timeout_s: float = 120.0) -> "subprocess.CompletedProcess[str]":
    """Run a command of gazerig to its end."""
    pipe = subprocess.PIPE
    with Branch(
        gazerig(*words), stdin=subprocess.DEVNULL, stdout=pipe, stderr=pipe, text=True
    ) as branch:
        out, err = branch.communicate(timeout=timeout_s)
    return subprocess.CompletedProcess(branch.args, branch.returncode, out, err)


def script(file: Path, *words: str) -> Callable[[], None]:
    """Return what ``python`` does with a file."""

    def work() -> None:
        sys.argv = [str(file), *words]
        sys.path.insert(0, str(file.parent))
        runpy.run_path(str(file), run_name="__main__")

    return work


@contextmanager
def branched_children() -> Iterator[None]:
    """Have the program start its own processes as branches too.

    A module that such a process runs is imported here before, once for all of them.
    """

    def start(
        module: str,
        *arguments: str,
        stdin: int = subprocess.DEVNULL,
        stdout: int = subprocess.DEVNULL,
        stderr: int | None = None,
        pass_fds: Sequence[int] = (),
        variables: Mapping[str, str] = child_process._NO_VARIABLES,
        bufsize: int = -1,
    ) -> Branch:
        return Branch(
            _module(module, arguments), stdin=stdin, stdout=stdout, stderr=stderr, bufsize=bufsize,
            env=child_process._environment(variables), start_new_session=True,
        )  # fmt: skip

    def run(module: str, given: bytes, timeout_s: float) -> subprocess.CompletedProcess[bytes]:
        pipe = subprocess.PIPE
        with start(module, stdin=pipe, stdout=pipe, stderr=pipe) as branch:
            try:
                out, err = branch.communicate(given, timeout_s)
            except subprocess.TimeoutExpired:
                branch.kill()
                raise
        return subprocess.CompletedProcess(branch.args, branch.returncode, out, err)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(child_process, "start", start)
        patch.setattr(child_process, "run", run)
        yield


@contextmanager
def branched_cameras() -> Iterator[None]:
    """Have cameras' processes start as forks of this one."""
    context = multiprocessing.get_context("fork")

    def process(
        target: Callable[..., None], args: tuple[object, ...], name: str, daemon: bool
    ) -> BaseProcess:
        pipe, *given = args
        words = target, pipe, pickle.dumps(given)
        return context.Process(target=_camera, args=words, name=name, daemon=daemon)

    forking = SimpleNamespace(Pipe=context.Pipe, Process=process)
    chosen = SimpleNamespace(get_context={"spawn": forking}.__getitem__)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(camera_process, "multiprocessing", chosen)
        yield


def _camera(target: Callable[..., None], pipe: object, given: bytes) -> None:
    child_processes.end_with_parent()
    _begin_afresh()
    target(pipe, *pickle.loads(given))


def _module(name: str, arguments: Sequence[str]) -> Callable[[], None]:
    """Return what ``python -m`` does."""
    importlib.import_module(name)

    def work() -> None:
        sys.argv = [name, *arguments]
        warnings.simplefilter("ignore")  # that it has been imported already
        runpy.run_module(name, run_name="__main__", alter_sys=True)

    return work
