"""The one way in which this program starts a process of its own code.

A child runs a module of this package with the same interpreter. It finds no module in the
working folder (``-P``), is in a session of its own, as Ctrl-C in the terminal is for the program,
which ends its children in order, and does its numerics in one thread beside the control loop's.
A child ends when its end of a pipe or socket says so; its parent waits for it or kills it.
The camera's process alone is started by ``multiprocessing`` (drivers/camera/process.py), as
frames go through memory that both share.
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
        module: full name; it is run as ``python -m`` does.
        arguments: its command line.
        stdin: PIPE to write to it, DEVNULL.
        stdout: PIPE to read from it, DEVNULL.
        stderr: a file descriptor; None: this process's.
        pass_fds: file descriptors that it inherits under their numbers.
        variables: added to its environment.
        bufsize: of the pipes, as ``subprocess.Popen`` has it.

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
        module: full name.
        given: its standard input.
        timeout_s: it is killed when it takes longer.

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
    """Return whether a process was suspended (SIGSTOP); False where the system does not tell."""
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
def hidden_script() -> Iterator[None]:
    """Have processes that multiprocessing starts meanwhile not run the program's script again.

    Such a process imports the script it was started from, in case something of it is needed; a
    script that opens a head, and not below ``if __name__ == "__main__"``, would open another one
    there.
    """
    with _HIDING:
        script = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = script
