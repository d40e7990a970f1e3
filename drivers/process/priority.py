"""Scheduling priority of the processes of a run: the control loop first.

Linux groups the processes of a session (autogroup). Niceness then only counts within a session, and
that of the session counts among sessions, so both are lowered. That needs no privileges.
"""

import ctypes
import os
import platform
import struct
import threading
from contextlib import suppress
from pathlib import Path

SHORT_S = 0.0001
"""Shortest time slice of Linux; a thread with a shorter slice than the others runs immediately when
it wakes up (EEVDF, since 6.12; older kernels ignore it).
"""

_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
"""Numbers of the system call, for which neither Python nor most C libraries have a function."""
_RESET_ON_FORK = 1
_ATTRIBUTES = "=IIQiIQQQ"
"""struct sched_attr: size, policy, flags, nice, priority, runtime, deadline, period (ns)."""
_AGAIN_S = (0.0, 0.15, 0.3)
"""Waits before attempts: the kernel allows unprivileged users one write per 0.1 s."""


def request_slice(slice_s: float) -> bool:
    """Request a time slice for the calling thread; threads that it starts have the usual one.

    A thread with a real-time priority or another niceness keeps it.

    Args:
        slice_s: length, seconds; 0.0: the usual one.

    Returns:
        Whether the system accepts the request.
    """
    call = _SCHED_SETATTR.get(platform.machine())
    if call is None:
        return False
    policy = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK
    if policy not in (os.SCHED_OTHER, os.SCHED_BATCH):
        return False
    size, nice = struct.calcsize(_ATTRIBUTES), os.getpriority(os.PRIO_PROCESS, 0)
    values = size, policy, _RESET_ON_FORK, nice, 0, round(slice_s * 1e9), 0, 0
    attributes = ctypes.create_string_buffer(struct.pack(_ATTRIBUTES, *values), size)
    return bool(ctypes.CDLL(None).syscall(call, 0, attributes, 0) == 0)


def lower_priority(steps: int, group: Path = Path("/proc/self/autogroup")) -> None:
    """Lower the priority of this process, and that of its session, which becomes its own.

    Args:
        steps: increase of the niceness; the session gets half of it, because a browser would starve
            it otherwise.
        group: file with the niceness of the session.
    """
    os.nice(steps)
    if os.getsid(0) != os.getpid():
        try:
            os.setsid()
        except OSError:  # it leads a group of processes: niceness counts within their session
            return
    for wait_s in _AGAIN_S:
        threading.Event().wait(wait_s)
        with suppress(OSError):
            group.write_text(str(steps // 2), encoding="ascii")
            return
