"""A callable of a test as a program: a fork of this process with all that subprocess.Popen has."""

import atexit
import gc
import os
import runpy
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from itertools import pairwise
from pathlib import Path
from types import MappingProxyType
from typing import Any, NoReturn

from gazerig.drivers.process import child_process

_SIGNALS = (
    *(signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT),
    *(signal.SIGTTIN, signal.SIGTTOU, signal.SIGTSTP, signal.SIGUSR1),
)
_OF_MOST = (
    *("gazerig.local_head", "gazerig.robot.cli.main", "gazerig.robot.cli.run"),
    *("gazerig.robot.run.session", "gazerig.drivers.servo_bus.bus"),
    *("gazerig.drivers.hobby_board.bus", "gazerig.drivers.bus.port_bus"),
)
"""Modules that nearly every program needs: imported once here, not again in each fork."""
_keep: list[object] = []


class Branch(subprocess.Popen[Any]):
    """A program in a fork of this process."""

    def __init__(
        self,
        work: Callable[[], object],
        env: dict[str, str] | None = None,
        preexec_fn: Callable[[], object] = lambda: None,
        keep_fds: Sequence[int] = (),
        **options: Any,
    ) -> None:
        def begin() -> None:
            preexec_fn()
            become(work, env, keep_fds)

        for name in _OF_MOST:
            import_module(name)
        gc.collect()  # an unclosed film would wait for its decoder's threads, which no fork has
        gc.freeze()  # what is left is neither looked at nor copied by the next
        super().__init__(["fork"], preexec_fn=begin, **options)


def become(
    work: Callable[[], object], env: dict[str, str] | None = None, keep_fds: Sequence[int] = ()
) -> NoReturn:
    """Be another program from here on, in a process that has just been forked."""
    code = 1
    try:
        # Also the pipe on which Popen waits for the start.
        for before, after in pairwise((2, *sorted(keep_fds), 4096)):
            os.closerange(before + 1, after)
        if env is not None:
            os.environ.clear()
            os.environ.update(env)
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_DFL)
        signal.signal(signal.SIGINT, signal.default_int_handler)
        for number in (signal.SIGPIPE, signal.SIGXFSZ):
            signal.signal(number, signal.SIG_IGN)  # as Python has them at its start
        atexit._clear()
        sys.excepthook, sys.unraisablehook = sys.__excepthook__, sys.__unraisablehook__
        threading.excepthook = threading.__excepthook__
        _keep.append((sys.stdin, sys.stdout, sys.stderr))  # their ends would close descriptors
        sys.stdin, sys.stdout = os.fdopen(0, closefd=False), os.fdopen(1, "w", closefd=False)
        sys.stderr = os.fdopen(2, "w", buffering=1, errors="backslashreplace", closefd=False)
        code = _exit_status(work)
        threading._shutdown()  # type: ignore[attr-defined]
        atexit._run_exitfuncs()
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        if code == -signal.SIGINT:
            signal.signal(signal.SIGINT, signal.SIG_DFL)
            os.kill(os.getpid(), signal.SIGINT)
    finally:
        os._exit(code)


def _exit_status(work: Callable[[], object]) -> int:
    """Do the work; return the status with which Python would exit, negative for a signal."""
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

        # The parent's may have had a thread, which a fork has not.
        terminal._writer = LineWriter(2)
        atexit.register(terminal._writer.flush, 1.0)
        sys.argv = ["gazerig", *words]
        main()

    return work


def script(file: Path, *words: str) -> Callable[[], None]:
    """Return what ``python`` does with a file."""

    def work() -> None:
        sys.argv = [str(file), *words]
        sys.path.insert(0, str(file.parent))
        runpy.run_path(str(file), run_name="__main__")

    return work


_FORKED = ("gazerig.sim_mock.pty.server", "gazerig.robot.recording.writer")
_start = child_process.start


def start_child(
    module: str,
    *arguments: str,
    pass_fds: Sequence[int] = (),
    variables: Mapping[str, str] = MappingProxyType({}),
    **options: Any,
) -> "subprocess.Popen[bytes]":
    """Stand for child_process.start: servers and writers of many tests load nothing again."""
    if module not in _FORKED:
        return _start(module, *arguments, pass_fds=pass_fds, variables=variables, **options)
    return Branch(
        lambda: _run_module(module, arguments),
        env={**os.environ, **variables},
        preexec_fn=os.setsid,
        keep_fds=pass_fds,
        **{"stdin": subprocess.DEVNULL, "stdout": subprocess.DEVNULL, **options},
    )


def _run_module(module: str, arguments: Sequence[str]) -> None:
    sys.argv = [module, *arguments]
    entry = import_module(module).main
    entry(int(arguments[0])) if entry.__code__.co_argcount else entry()
