"""The loop goes before the processes that a run starts, on Linux also across sessions."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

LOWER = (
    "import os; from pathlib import Path; "
    "from gazerig.drivers.process.priority import lower_priority; "
    "before = os.getsid(0); lower_priority(4, Path({group!r})); "
    "print(os.getpriority(os.PRIO_PROCESS, 0), os.getsid(0) == os.getpid())"
)


def _lowered(group: Path, leads: bool) -> list[str]:
    words = [sys.executable, "-c", LOWER.format(group=str(group))]
    done = subprocess.run(
        words, capture_output=True, text=True, check=True, start_new_session=leads
    )
    return done.stdout.split()


@pytest.mark.parametrize("leads", [True, False])
def test_a_process_is_lowered_within_its_session_and_with_it(tmp_path, leads):
    group = tmp_path / "autogroup"
    group.touch()
    nice = str(os.getpriority(os.PRIO_PROCESS, 0) + 4)
    assert _lowered(group, leads) == [nice, "True"]
    assert group.read_text() == "2"


def test_real_time_priority_stays():
    code = (
        "import os; from gazerig.drivers.process.priority import request_slice; "
        "os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0)); print(request_slice(1e-4))"
    )
    words = [sys.executable, "-c", code]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout == "False\n"
