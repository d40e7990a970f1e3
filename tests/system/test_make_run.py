"""``make run`` in a terminal: Ctrl-C is the program's, and make ends as the program does."""

import os
import pty
import signal

import pytest
from papers import ROOT

PROGRAM = """#!/bin/sh
trap 'echo parked; exit 0' INT
echo running
while :; do sleep 0.1; done
"""


@pytest.mark.pty
def test_ctrl_c_ends_make_without_an_error(tmp_path):
    folder = tmp_path / "env/bin"
    folder.mkdir(parents=True)
    for name, text in (("gazerig", PROGRAM), ("python", "#!/bin/sh\n")):
        (folder / name).write_text(text)
        (folder / name).chmod(0o755)
    (tmp_path / "env/.installed").touch()
    (tmp_path / "pyproject.toml").touch()
    os.utime(tmp_path / "pyproject.toml", (0, 0))
    pid, terminal = pty.fork()
    if pid == 0:
        signal.signal(signal.SIGINT, signal.SIG_DFL)  # a test in the background has it ignored
        os.chdir(tmp_path)
        os.execvp("make", ["make", "-f", str(ROOT / "Makefile"), "run", "VENV=env"])
    shown = b""
    try:
        while piece := os.read(terminal, 4096):
            shown += piece
            if b"running" in piece:
                os.write(terminal, b"\x03")
    except OSError:  # the terminal's other end is closed
        pass
    _, status = os.waitpid(pid, 0)
    os.close(terminal)
    assert os.waitstatus_to_exitcode(status) == 0
    assert b"parked" in shown
    assert b"make:" not in shown
