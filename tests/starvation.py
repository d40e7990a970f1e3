"""Whether this machine let processes wait for a processor, and tests that are tried again if so.

Clients that others wrote have time-outs of their own, some of 30 ms. On a busy machine the emulator
or the client gets no processor for longer, and the client reports a time-out that no servo caused.
A test marked ``own_timeouts`` that fails is tried again, from its fixtures on, only if processes
waited for a processor while it ran; if none did, its failure counts at once.
"""

import time
from collections.abc import Callable
from pathlib import Path

ATTEMPTS = 8
LONGEST_S = 100.0
"""After so long no attempt is begun any more."""
SHORTEST_TIMEOUT_S = 0.01
"""No client gives up sooner: who waited for less was not starved."""

_PRESSURE = Path("/proc/pressure/cpu")
_STAT = Path("/proc/stat")
_JIFFY_S = 0.01
_STEAL = 8
"""Where the first line of /proc/stat has the time that another machine on the host took."""


def waited_s() -> float:
    """Return for how long some process has waited for a processor, since the machine started.

    Infinite time passes between two looks if the kernel was built without PSI.
    """
    stolen = int(_STAT.read_text(encoding="ascii").split("\n", 1)[0].split()[_STEAL])
    try:
        some = _PRESSURE.read_text(encoding="ascii").split("\n", 1)[0]
    except OSError:
        return _unknown()
    return int(some.rpartition("total=")[2]) / 1e6 + stolen * _JIFFY_S


_looks = [0.0]


def _unknown() -> float:
    _looks[0] += 1e6
    return _looks[0]


def eventually(check: Callable[[], object], timeout_s: float = 20.0) -> bool:
    """Wait for a condition; return False if it does not become true."""
    deadline_s = time.monotonic() + timeout_s
    while time.monotonic() < deadline_s:
        if check():
            return True
        time.sleep(0.02)
    return False


class Attempts:
    """Number of attempts of one test."""

    def __init__(self) -> None:
        self._left = ATTEMPTS
        self._end_s = time.monotonic() + LONGEST_S
        self._before_s = 0.0

    def begin(self) -> None:
        """Begin an attempt."""
        self._left -= 1
        self._before_s = waited_s()

    def again(self) -> bool:
        """Return whether a failed attempt proves nothing, and another one is left."""
        in_time = self._left > 0 and time.monotonic() < self._end_s
        return in_time and waited_s() - self._before_s >= SHORTEST_TIMEOUT_S
