"""Rig files read and written in another process are as if read and written here."""

import os
import shutil
import signal
import sys
from pathlib import Path

import pytest

from gazerig.config.load import ConfigError, shipped_path
from gazerig.config.schema import load_rig
from gazerig.robot.run.subprocess_call import in_subprocess


def test_a_rig_comes_over_whole(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    shutil.copy(shipped_path("rigs", "desk"), tmp_path / "my.yaml")
    monkeypatch.chdir(tmp_path)  # a relative path means the same there
    assert in_subprocess(load_rig, "my.yaml", "shy", profile="robot") == load_rig(
        "my.yaml", "shy", profile="robot"
    )


def test_all_faults_come_over_with_their_lines(tmp_path: Path) -> None:
    file = Path(shutil.copy(shipped_path("rigs", "desk"), tmp_path / "my.yaml"))
    text = file.read_text()
    file.write_text(f"nonsense: 1\n{text}\nmore: 2\n")
    with pytest.raises(ConfigError) as here:
        load_rig(str(file))
    with pytest.raises(ConfigError) as there:
        in_subprocess(load_rig, str(file))
    assert there.value.faults == here.value.faults and len(here.value.faults) == 2
    assert str(there.value) == str(here.value)


def fails() -> None:
    raise KeyError("a mistake")


def ends() -> None:
    os.kill(os.getpid(), signal.SIGKILL)


def sleeps() -> None:
    signal.pause()


def here() -> tuple[int, int]:
    return os.getpid(), os.getsid(0)


@pytest.fixture
def importable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the other process find the functions of this file."""
    path = [str(Path(__file__).parent), *sys.path]
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path))
    monkeypatch.setitem(sys.modules, "test_config_apart", sys.modules[__name__])
    for work in (fails, ends, sleeps, here):
        monkeypatch.setattr(work, "__module__", "test_config_apart")


def test_a_process_that_fails_is_an_error_in_one_line(
    importable: None, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(ConfigError, match="process for fails: ended unexpectedly: KeyError"):
        in_subprocess(fails)
    with pytest.raises(ConfigError, match="process for ends: ended unexpectedly: -9"):
        in_subprocess(ends)
    monkeypatch.setattr("gazerig.robot.run.subprocess_call._LONGEST_S", 0.5)
    with pytest.raises(ConfigError, match="took more than 0.5 s"):
        in_subprocess(sleeps)
