"""Temporary folders: nothing is left of a process that was killed."""

import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from gazerig.config.schema import load_rig
from gazerig.drivers.process import own_folder
from gazerig.drivers.process.own_folder import PREFIX, OwnFolder, sweep
from gazerig.robot.app.voice import RunVoice

HOLDS = (
    "import sys, time; from pathlib import Path;"
    "from gazerig.drivers.process.own_folder import OwnFolder;"
    "folder = OwnFolder('test', Path(sys.argv[1])); (folder.path / 'state').touch();"
    "print(folder.path, flush=True); time.sleep(60)"
)


def names(parent: Path) -> set[str]:
    return {path.name for path in parent.iterdir()}


def test_what_a_killed_process_left_goes_with_the_next_start_and_no_sooner(tmp_path: Path) -> None:
    asked = [sys.executable, "-c", HOLDS, str(tmp_path)]
    with subprocess.Popen(asked, stdout=subprocess.PIPE, text=True) as owner:
        assert owner.stdout is not None
        left = Path(owner.stdout.readline().strip())
        sweep(tmp_path)
        assert (left / "state").exists()  # its owner lives
        owner.send_signal(signal.SIGKILL)
    mine = OwnFolder("test", tmp_path)
    assert names(tmp_path) == {mine.path.name}
    mine.remove()
    mine.remove()
    assert names(tmp_path) == set()


def test_a_voice_begins_with_removing_what_a_killed_run_has_said(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    left = tmp_path / f"{PREFIX}voice-left"
    left.mkdir()
    (left / "held").touch()
    given: Any = (None, lambda: load_rig("desk"), None, tmp_path, tuple, False, None)
    RunVoice(*given)
    assert not left.exists()


def test_what_is_not_ours_to_remove_stays(tmp_path: Path) -> None:
    made = tmp_path / f"{PREFIX}just-made"
    made.mkdir()
    (tmp_path / f"{PREFIX}file").touch()
    other = tmp_path / "other"
    other.mkdir()
    (other / "held").touch()
    os.symlink(other, tmp_path / f"{PREFIX}link")
    before = names(tmp_path)
    sweep(tmp_path)
    assert names(tmp_path) == before and (other / "held").exists()


def test_a_folder_that_is_swept_before_it_is_locked_is_made_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[Path] = []
    lock = own_folder.fcntl.flock

    def swept_first(held: int, how: int) -> None:
        if len(made) < 1:
            made.extend(tmp_path.iterdir())
            sweep(tmp_path)
        lock(held, how)

    monkeypatch.setattr(own_folder.fcntl, "flock", swept_first)
    mine = OwnFolder("test", tmp_path)
    assert not made[0].exists()
    assert names(tmp_path) == {mine.path.name}
    mine.remove()
