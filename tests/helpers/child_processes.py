"""Processes that tests start: which of them still run, and the end of those.

One that outlives its test may hold the standard output of the whole run open; whoever reads that
would wait for ever.
"""

import os
import signal
import time
from collections.abc import Container, Iterable, Iterator
from contextlib import suppress
from multiprocessing import forkserver, resource_tracker
from pathlib import Path

GRACE_S = 10.0
"""Time in which a process that a test has ended may exit, on a busy machine."""
SHARED: set[int] = set()
"""Processes that serve many tests, and are no one's to end: a browser."""
_PROC = Path("/proc")


def running() -> dict[int, str]:
    """Return the children of this process that run, by id, each with its command line."""
    own = (resource_tracker._resource_tracker, forkserver._forkserver)
    kept = {getattr(one, name, None) for one in own for name in ("_pid", "_forkserver_pid")}
    found = {}
    for pid in children(os.getpid()):
        if pid not in kept | SHARED and (words := command(pid)):
            found[pid] = words
    return found


def end_others(kept: Container[int]) -> dict[int, str]:
    """Kill the children that still run after a grace time, except some; return which they were."""
    end_s = time.monotonic() + GRACE_S
    while left := {pid: words for pid, words in running().items() if pid not in kept}:
        if time.monotonic() > end_s:
            end(left)
            break
        time.sleep(0.01)
    return left


def end(pids: Iterable[int]) -> None:
    """Kill processes and all that these have started."""
    for pid in pids:
        family = [pid, *descendants(pid)]
        for one in family:
            with suppress(ProcessLookupError):
                os.kill(one, signal.SIGKILL)
        with suppress(ChildProcessError):
            os.waitpid(pid, 0)


def children(pid: int) -> Iterator[int]:
    """Return the children of a process; each of its threads has a list of its own."""
    with suppress(OSError):
        # Twice in each test: by names alone, in half the time of paths.
        for thread in os.listdir(f"/proc/{pid}/task"):
            with suppress(OSError), open(f"/proc/{pid}/task/{thread}/children", "rb") as listed:
                yield from map(int, listed.read().split())


def descendants(pid: int) -> Iterator[int]:
    """Return the children of a process, theirs, and so on."""
    for child in children(pid):
        yield child
        yield from descendants(child)


def running_as(parent: int, words: str) -> list[int]:
    """Return the children of a process whose command line has these words."""
    return [pid for pid in children(parent) if words in command(pid)]


def command(pid: int) -> str:
    """Return the command line of a process; nothing if it has ended, reaped or not."""
    with suppress(OSError):
        return (_PROC / str(pid) / "cmdline").read_bytes().replace(b"\0", b" ").decode().strip()
    return ""
