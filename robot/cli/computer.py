"""Measurement of this computer in a second, and choice of the load level that it can run.

``python -m gazerig.robot.cli.computer`` prints the option of ``gazerig run``.
"""

import os
import sys
import time
from typing import NamedTuple

from gazerig.robot.model.clock import RealClock

_WAITS, _WAIT_S, _LATE_S = 80, 0.005, 0.002
_BUSY_S = 0.3


class ComputerFigures(NamedTuple):
    """Measured figures of a computer.

    Attributes:
        cores: processors that this process may use.
        late_share: share of short waits that ended 2 ms or more late.
        core_share: processor time of a busy thread, as a share of the time that passed.
        software: whether the processor draws the pictures; None: nothing can draw a world.
    """

    cores: int
    late_share: float
    core_share: float
    software: bool | None


def load_level(figures: ComputerFigures) -> str:
    """Return the name of the level that a computer can run.

    A software renderer and a browser with another one take one and a half cores. Two processors
    have that only next to a slower loop.
    """
    cores, late, share, software = figures
    weak = cores == 1 or (cores == 2 and software is not False)
    if share < 0.5 or late >= 0.4 or (cores == 1 and software is not False):
        return "least"
    if share < 0.75 or late >= 0.15:
        return "least" if weak else "busy" if late >= 0.25 else "small"
    return "small" if weak or late >= 0.05 else "full"


def measure(software: bool | None) -> ComputerFigures:
    """Measure this computer, in less than a second.

    Args:
        software: see ``ComputerFigures``.
    """
    from gazerig.drivers.process.priority import SHORT_S, request_slice  # a run has measured it

    request_slice(SHORT_S)
    clock, late = RealClock(), 0
    for _ in range(_WAITS):
        due_s = clock.now_s() + _WAIT_S
        clock.sleep_until(due_s)
        late += clock.now_s() - due_s >= _LATE_S
    request_slice(0.0)
    began_s, cpu_s = clock.now_s(), time.thread_time()
    while (passed_s := clock.now_s() - began_s) < _BUSY_S:
        pass
    share = (time.thread_time() - cpu_s) / passed_s
    return ComputerFigures(len(os.sched_getaffinity(0)), late / _WAITS, share, software)


if __name__ == "__main__":
    sys.stdout.write(f"--computer {load_level(measure(None))}\n")
