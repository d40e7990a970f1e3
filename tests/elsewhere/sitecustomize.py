"""Hides from gazerig's own modules what Windows does not have; loaded by every Python beneath it.

Modules and functions of POSIX are missing as they are there, sockets of a file too. What the
standard library of this system needs for itself stays: it has its own ways on Windows.
"""

import asyncio  # noqa: F401  # loaded before anything is hidden
import builtins
import multiprocessing.connection
import multiprocessing.resource_tracker
import multiprocessing.shared_memory
import multiprocessing.util  # noqa: F401
import os
import select
import signal
import socket
import stat
import subprocess  # noqa: F401
import sys
import tempfile  # noqa: F401
from typing import Any

MODULES = {"fcntl", "grp", "pty", "pwd", "resource", "smbus2", "syslog", "termios", "tty"}
ATTRIBUTES: dict[Any, str] = {
    os: "MFD_CLOEXEC O_CLOEXEC O_NONBLOCK chown fork forkpty getegid geteuid getgid getuid killpg "
    "memfd_create mkfifo nice openpty pread pwrite sched_getaffinity sched_setaffinity "
    "sched_setscheduler set_blocking setsid ttyname",
    select: "epoll poll",
    signal: "SIGALRM SIGCHLD SIGHUP SIGQUIT SIGTTIN SIGTTOU SIGUSR1 SIGUSR2 "
    "pthread_sigmask setitimer",
    socket: "AF_UNIX MSG_DONTWAIT SCM_RIGHTS SOCK_SEQPACKET SO_PEERCRED CMSG_LEN CMSG_SPACE",
}
_import, _select = builtins.__import__, select.select


def _of_gazerig(name: object) -> bool:
    return str(name).startswith("gazerig")


def _imported(name: str, globals: Any = None, *others: Any, **named: Any) -> Any:
    if name.partition(".")[0] in MODULES and globals and _of_gazerig(globals.get("__name__")):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return _import(name, globals, *others, **named)


def _selected(*given: Any) -> Any:
    """Wait for sockets alone."""
    if _of_gazerig(sys._getframe(1).f_globals.get("__name__")):
        for one in (one for some in given[:3] for one in some):
            number = one if isinstance(one, int) else one.fileno()
            if not stat.S_ISSOCK(os.fstat(number).st_mode):
                raise OSError(10038, "An operation was attempted on something that is not a socket")
    return _select(*given)


def _socketpair(
    family: int = socket.AF_INET, kind: int = socket.SOCK_STREAM, proto: int = 0
) -> Any:
    """Make a pair as Windows does: over the loopback."""
    if family != socket.AF_INET:
        raise ValueError("Only AF_INET and AF_INET6 socket address families are supported")
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        listener.listen(1)
        one = socket.create_connection(listener.getsockname())
        return one, listener.accept()[0]


builtins.__import__ = _imported
select.select = _selected
socket.socketpair = _socketpair
for module, names in ATTRIBUTES.items():
    for attribute in names.split():
        if hasattr(module, attribute):
            delattr(module, attribute)
