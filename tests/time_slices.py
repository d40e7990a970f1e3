"""Time for which a process computes before another one.

Workers that compute share the processors with other workers. Linux lets them take turns of one to
three milliseconds, and after each turn the caches of the processor hold what the others used: on
two processors, five files of tests that only compute take 28.4 s of processor time in two workers,
36.9 s in five, and 28.6 s in five with turns of a tenth of a second. What waits for other processes
keeps short turns, which the kernel prefers when it wakes up; so does all that a test starts.
"""

import ctypes
import os
import platform
import struct

LONG_S = 0.1
"""The longest that Linux grants (EEVDF, since 6.12); older kernels take the wish and ignore it."""

_SCHED_SETATTR = {"x86_64": 314, "aarch64": 274}
"""Numbers of the system call, for which neither Python nor most C libraries have a function."""

_RESET_ON_FORK = 1
_ATTRIBUTES = "=IIQiIQQQ"
"""struct sched_attr: size, policy, flags, nice, priority, runtime, deadline, period (ns)."""


def ask_for(slice_s: float | None) -> bool:
    """Ask for turns of this length for the calling thread; processes it starts have usual ones."""
    call = _SCHED_SETATTR.get(platform.machine())
    if call is None:
        return False
    size = struct.calcsize(_ATTRIBUTES)
    runtime_ns = round((slice_s or 0.0) * 1e9)
    policy = os.sched_getscheduler(0) & ~os.SCHED_RESET_ON_FORK
    nice = os.getpriority(os.PRIO_PROCESS, 0)
    if policy not in (os.SCHED_OTHER, os.SCHED_BATCH):
        return False
    wish = struct.pack(_ATTRIBUTES, size, policy, _RESET_ON_FORK, nice, 0, runtime_ns, 0, 0)
    libc = ctypes.CDLL(None, use_errno=True)
    return libc.syscall(call, 0, ctypes.create_string_buffer(wish, size), 0) == 0


def granted_s() -> float | None:
    """Return the length of the calling thread's turns, None if the system does not report it."""
    call = _SCHED_SETATTR.get(platform.machine())
    if call is None:
        return None
    size = struct.calcsize(_ATTRIBUTES)
    answer = ctypes.create_string_buffer(size)
    libc = ctypes.CDLL(None, use_errno=True)
    if libc.syscall(call + 1, 0, answer, size, 0) != 0:
        return None
    return float(struct.unpack(_ATTRIBUTES, answer.raw)[5]) / 1e9
