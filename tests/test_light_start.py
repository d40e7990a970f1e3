"""The process of the control loop imports little: NumPy, the serial port, what reads a rig file.

OpenCV, detectors, the page's server and what writes recordings belong to processes of their own.
"""

import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest

ALLOWED = {
    *("gazerig", "numpy", "serial", "fastcrc", "msgspec", "smbus2", "dynamixel_sdk"),
    # for the rig's file, which is read and written while running
    *("ruamel", "pydantic", "pydantic_core", "annotated_types", "typing_inspection"),
    *("typing_extensions", "cython_runtime"),
}
"""Packages that are imported: no other."""

LATER = ("asyncio", "ssl", "http.server", "gazerig.sim_mock.dynamixel.chain")
"""Modules that are large though no packages: none of them."""

RUN = """
import sys
from gazerig.robot.app import session
from gazerig.robot.app.options import RunOptions
composed = session.compose(RunOptions(mock=True, **{options!r}).checked())
run = session.Session(composed, lambda: None, lambda line: None)
with run.powered() as loop:
    for _ in range(20):
        assert loop.step() is None
    names = set(sys.modules)
    run.stopped_by = "seconds"
composed.made.close()
packages = {{name.partition(".")[0] for name in names}} - sys.stdlib_module_names
print("PACKAGES", *(name for name in packages if not name.startswith("_")))
print("LATER", *(name for name in {later!r} if name in names))
"""


@pytest.mark.pty
@pytest.mark.parametrize("eyes", ["scene", "film, page"])
def test_the_process_of_the_loop_imports_little(eyes: str, tmp_path: Path) -> None:
    options: dict[str, object] = {"scene": "visitor"}
    if eyes != "scene":
        film = tmp_path / "film.avi"
        writer = cv2.VideoWriter(str(film), cv2.VideoWriter.fourcc(*"MJPG"), 25.0, (64, 48))
        for _ in range(5):
            writer.write(np.zeros((48, 64, 3), np.uint8))
        writer.release()
        options = {"video": film, "page": "127.0.0.1:8770"}
    code = "from pathlib import PosixPath\n" + RUN.format(options=options, later=LATER)
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, cwd=tmp_path
    )
    assert done.returncode == 0, done.stderr
    said = {line.split()[0]: set(line.split()[1:]) for line in done.stdout.splitlines() if line}
    assert said["PACKAGES"] >= {"numpy", "serial", "gazerig"}
    assert not said["PACKAGES"] - ALLOWED
    assert not said["LATER"]
