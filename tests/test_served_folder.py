"""Folders of emulated terminals: nothing is left of a process that was killed."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

if sys.platform != "linux":
    pytest.skip("terminals are emulated on Linux alone", allow_module_level=True)

from gazerig.sim_mock.pty.served_folder import PREFIX, ServedFolder, sweep

HOLDS = (
    "import sys, time; from pathlib import Path;"
    "from gazerig.sim_mock.pty.served_folder import ServedFolder;"
    "folder = ServedFolder(Path(sys.argv[1])); (folder.path / 'state').touch();"
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
    mine = ServedFolder(tmp_path)
    assert names(tmp_path) == {mine.path.name}
    mine.remove()
    mine.remove()
    assert names(tmp_path) == set()


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
