"""Start of child processes that run modules of this package.

A child runs with the same interpreter. It imports no module from the working folder (``-P``). It
has its own session, as Ctrl-C in the terminal is for the program, which ends its children in order.
Its numerics run in one thread, to leave the control loop's core free. A child ends when its pipe or
socket is closed; its parent waits for it or kills it. Only the camera's process is started by
``multiprocessing`` (drivers/camera/worker.py), as its parts hold memory that both share.
"""

import os
import subprocess
import sys
import threading
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from subprocess import DEVNULL
from types import ModuleType

_HIDING = threading.Lock()
_NO_VARIABLES: Mapping[str, str] = {}


def start(
    module: str,
    *arguments: str,
    stdin: int = DEVNULL,
    stdout: int = DEVNULL,
    stderr: int | None = None,
    pass_fds: Sequence[int] = (),
    variables: Mapping[str, str] = _NO_VARIABLES,
    bufsize: int = -1,
) -> subprocess.Popen[bytes]:
    """Start a module of this package as a process.

    Args:
        module: Full name; it is run as with ``python -m``.
        arguments: Its command line.
        stdin: PIPE to write to it, or DEVNULL.
        stdout: PIPE to read from it, or DEVNULL.
        stderr: A file descriptor; None for this process's.
        pass_fds: File descriptors that it inherits with the same numbers.
        variables: Additions to its environment.
        bufsize: Buffer size of the pipes, as for ``subprocess.Popen``.

    Raises:
        OSError: it cannot be started.
    """
    return subprocess.Popen(
        _command(module, arguments),
        stdin=stdin,
        stdout=stdout,
        stderr=stderr,
        pass_fds=tuple(pass_fds),
        env=_environment(variables),
        start_new_session=True,
        bufsize=bufsize,
    )


def run(module: str, given: bytes, timeout_s: float) -> subprocess.CompletedProcess[bytes]:
    """Run a module of this package to its end.

    Args:
        module: Full name.
        given: Its standard input.
        timeout_s: Time after which it is killed, seconds.

    Raises:
        OSError: it cannot be started.
        subprocess.TimeoutExpired: it took too long.
    """
    return subprocess.run(
        _command(module, ()),
        input=given,
        capture_output=True,
        env=_environment({}),
        start_new_session=True,
        timeout=timeout_s,
        check=False,
    )


def is_suspended(pid: int) -> bool:
    """Return whether a process is suspended (SIGSTOP); False if the system does not report it."""
    try:
        with open(f"/proc/{pid}/stat", "rb") as file:
            return file.read().rpartition(b")")[2].split()[0] == b"T"
    except (OSError, IndexError):
        return False


def _command(module: str, arguments: Sequence[str]) -> list[str]:
    return [sys.executable, "-P", "-m", module, *arguments]


def _environment(variables: Mapping[str, str]) -> dict[str, str]:
    return {**os.environ, "OPENBLAS_NUM_THREADS": "1", **variables}


@contextmanager
def hide_script() -> Iterator[None]:
    """Prevent processes that multiprocessing starts meanwhile from running the script again.

    Such a process imports the program's script, in case its names are needed. A script that opens a
    head outside ``if __name__ == "__main__"`` would open a second one there.
    """
    with _HIDING:
        script = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = script
