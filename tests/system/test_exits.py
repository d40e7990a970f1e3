"""Whatever ends a program that holds heads: no servo keeps its torque."""

import faulthandler
import subprocess
import sys
from typing import Any

from attack.exits import case
from attack.ways_out import side_by_side
from branch import Branch

RATE_HZ = 25.0
"""Of the loops: no exit depends on it, and an eighth of the work is enough."""
AT_ONCE = 4
"""Programs; each spends most of its time waiting."""

Names = tuple[str, str, str]
PARKS: dict[Names, int | None] = {
    ("desk", "python", "SIGTERM"): 128 + 15,
    ("desk", "python", "SIGHUP"): 128 + 1,
    ("desk", "python", "exception"): 1,
    ("maker", "daemon thread", "the main thread ends"): 0,
    ("desk", "to_thread", "SIGINT"): -2,
    ("maker", "thread pool", "SIGINT"): -2,
    ("maker", "thread pool, shut down", "SIGINT"): -2,
    ("desk", "event loop", "SIGINT"): -2,
    ("desk", "thread pool, left open", "SIGINT"): -2,
}
"""Exit code by kind of servos, interface and exit, where the head parks before."""
IS_LIMP: dict[Names, int | None] = {
    ("feetech", "python", "2x SIGINT, .3 s"): -2,  # the second may come when it has parked
    ("desk", "command", "SIGKILL"): -9,
    ("desk", "python", "SIGSEGV"): -11,
    ("desk", "python", "all descriptors closed"): None,
    ("feetech", "python", "guardian suspended, then SIGKILL"): -9,
    ("desk", "thread pool", "SIGTERM"): -15,
    ("maker", "two heads", "SIGUSR1"): -10,
}
"""The same for exits that leave no time to park."""


def begin(code: str, words: list[str], **options: Any) -> "subprocess.Popen[bytes]":
    """Start a program in a branch of this process."""

    def work() -> None:
        faulthandler.disable()  # pytest's, of which a program knows nothing
        sys.argv = ["-c", *words]
        exec(code, {"__name__": "__main__"})

    return Branch(work, **options)


def test_no_servo_keeps_its_torque():
    codes = PARKS | IS_LIMP
    cases = [case(*words, begin, RATE_HZ) for words in codes]
    rows = zip(codes, side_by_side(cases, AT_ONCE), strict=True)
    assert not [
        (words, row)
        for words, row in rows
        if row.void
        or row.powered
        or row.code != codes[words]
        or (words in PARKS and row.off_park_deg > 6.0)
    ]
