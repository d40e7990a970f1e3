"""Tests that compute have long turns; what waits, and what a test starts, has usual ones."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import running_order
import time_slices

pytestmark = pytest.mark.skipif(
    time_slices.granted_s() is None, reason="this system tells nobody the length of a turn"
)
ASK = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r}); import time_slices; "


def _python(code: str) -> list[str]:
    """Return the words that another Python prints."""
    words = [sys.executable, "-c", ASK + code]
    return subprocess.run(words, capture_output=True, text=True, check=True).stdout.split()


def test_long_turns_are_granted_and_given_back_and_no_child_has_them() -> None:
    usual = time_slices.granted_s()
    said = _python(
        "import os\n"
        "before = time_slices.granted_s()\n"
        "print(before, time_slices.ask_for(time_slices.LONG_S), time_slices.granted_s())\n"
        "sys.stdout.flush()\n"
        "if os.fork() == 0: print(time_slices.granted_s(), flush=True); os._exit(0)\n"
        "os.wait()\n"
        "print(time_slices.ask_for(None), time_slices.granted_s())\n"
    )
    before, asked, long, child, given_back, after = said
    assert asked == given_back == "True"
    assert before == child == after == str(usual)
    assert float(long) in (time_slices.LONG_S, usual)  # an older kernel ignores the wish


def test_niceness_and_other_scheduling_policies_stay() -> None:
    said = _python(
        "import os\n"
        "os.nice(5)\n"
        "print(time_slices.ask_for(time_slices.LONG_S), os.getpriority(os.PRIO_PROCESS, 0))\n"
        "os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0))\n"
        "print(time_slices.ask_for(time_slices.LONG_S), os.sched_getscheduler(0) & 15 == os.SCHED_IDLE)\n"
    )
    niceness = min(19, os.getpriority(os.PRIO_PROCESS, 0) + 5)
    assert said == ["True", str(niceness), "False", "True"]


def test_who_waits_is_known_by_marks_and_imports(request: pytest.FixtureRequest) -> None:
    assert running_order.waits(request.node)  # this file imports subprocess
    assert time_slices.granted_s() != time_slices.LONG_S
