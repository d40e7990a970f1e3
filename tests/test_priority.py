"""The loop goes before the processes that a run starts, on Linux also across sessions."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from gazerig.drivers.process.priority import share_priority

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
def test_a_process_is_lowered_within_its_session_and_with_it(tmp_path: Path, leads: bool) -> None:
    group = tmp_path / "autogroup"
    group.touch()
    nice = str(os.getpriority(os.PRIO_PROCESS, 0) + 4)
    assert _lowered(group, leads) == [nice, "True"]
    assert group.read_text() == "2"


def test_a_system_without_groups_of_sessions_is_no_fault(tmp_path: Path) -> None:
    nice = str(os.getpriority(os.PRIO_PROCESS, 0) + 4)
    assert _lowered(tmp_path / "missing" / "autogroup", True) == [nice, "True"]


def test_real_time_priority_stays() -> None:
    code = (
        "import os; from gazerig.drivers.process.priority import request_slice; "
        "os.sched_setscheduler(0, os.SCHED_IDLE, os.sched_param(0)); print(request_slice(1e-4))"
    )
    words = [sys.executable, "-c", code]
    assert subprocess.run(words, capture_output=True, text=True, check=True).stdout == "False\n"


RAISE = (
    "from pathlib import Path; from gazerig.drivers.process.priority import raise_priority; "
    "raise_priority(Path({group!r}))"
)


@pytest.mark.parametrize(("leads", "text"), [(True, "-10"), (False, "")])
def test_only_the_leader_of_a_session_raises_its_priority(
    tmp_path: Path, leads: bool, text: str
) -> None:
    group = tmp_path / "autogroup"
    group.touch()
    words = [sys.executable, "-c", RAISE.format(group=str(group))]
    subprocess.run(words, check=True, start_new_session=leads)
    assert group.read_text() == text


@pytest.mark.parametrize(("nice", "shared"), [(-10, "-10"), (0, ""), (3, "")])
def test_a_raised_priority_is_shared_with_a_process(tmp_path: Path, nice: int, shared: str) -> None:
    for name, text in (("self", f"/autogroup-7 nice {nice}\n"), ("12", "")):
        (tmp_path / name).mkdir()
        (tmp_path / name / "autogroup").write_text(text)
    share_priority(12, tmp_path)
    assert (tmp_path / "12/autogroup").read_text() == shared


def test_a_system_without_groups_shares_nothing(tmp_path: Path) -> None:
    share_priority(12, tmp_path)
