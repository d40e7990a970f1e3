"""Imports of processes: the control loop has NumPy, the serial port and rig files only."""

from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest
from fakes.films import write_film
from light_python import LightPython

ALLOWED = {
    *("gazerig", "numpy", "serial", "fastcrc", "msgspec", "smbus2"),
    # for the rig's file, which is read and written while running
    *("yaml", "pydantic", "pydantic_core", "annotated_types", "typing_inspection"),
    *("typing_extensions", "cython_runtime"),
    *("sitecustomize", "usercustomize"),  # the machine's own, with every Python: Debian has one
}
"""Packages that are imported: no other."""

LATER = ("asyncio", "ssl", "http.server", "gazerig.sim_mock.dynamixel.chain")
"""Modules that are large though no packages: none of them."""

RUN = """
import sys
from pathlib import PosixPath
from gazerig.robot.app import session
from gazerig.robot.app.options import RunOptions
composed = session.compose(RunOptions(mock=True, **{options!r}).check_and_complete())
run = session.Session(composed, lambda: None, lambda line: None)
with run.power_on() as loop:
    for _ in range(20):
        assert loop.step() is None
    names = set(sys.modules)
    run.stopped_by = "seconds"
composed.assembly.close()
packages = {{name.partition(".")[0] for name in names}} - sys.stdlib_module_names
print("PACKAGES", *(name for name in packages if not name.startswith("_")))
print("LATER", *(name for name in {later!r} if name in names))
"""

with_mujoco = pytest.mark.skipif(
    find_spec("mujoco") is None, reason="worlds need MuJoCo: pip install 'gazerig[world]'"
)


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LightPython]:
    light = LightPython(tmp_path_factory.mktemp("said"))
    yield light
    light.close()


@pytest.mark.pty
@pytest.mark.parametrize("eyes", ["scene", "film, page"])
def test_the_process_of_the_loop_imports_little(
    eyes: str, python: LightPython, tmp_path: Path
) -> None:
    options: dict[str, object] = {"scene": "visitor"}
    if eyes != "scene":
        film = write_film(tmp_path / "film.avi", 5, 25.0)
        options = {"video": film, "page": "127.0.0.1:8770"}
    text, _ = python.run(RUN.format(options=options, later=LATER), tmp_path)
    said = {line.split()[0]: set(line.split()[1:]) for line in text.splitlines() if line}
    assert said["PACKAGES"] >= {"numpy", "serial", "gazerig"}
    assert not said["PACKAGES"] - ALLOWED
    assert not said["LATER"]


@with_mujoco
def test_the_loop_of_an_ordinary_run_knows_no_world(python: LightPython, tmp_path: Path) -> None:
    """Nor does that of a world in real time know MuJoCo: it is in two other processes."""
    pytest.importorskip("gazerig.features.world")
    code = (
        "import sys; from gazerig.robot.app.assemble import assemble; "
        "from gazerig.config.schema import load_rig; "
        "from gazerig.robot.app.options import RunOptions; "
        "assemble(load_rig('desk'), RunOptions(mock=True, fast=True, scene='visitor')).close(); "
        "assert not [m for m in sys.modules if 'world.figure' in m or m.startswith('mujoco')]; "
        "made = assemble(load_rig('desk'), RunOptions(mock=True, world='living-room')); "
        "made.scene.people(1.0); made.scene.events(); made.close(); "
        "heavy = ('mujoco', 'OpenGL', 'scipy', 'cv2'); "
        "assert not [m for m in sys.modules if m.split('.')[0] in heavy]; "
        "print('ok')"
    )
    assert python.run(code, tmp_path)[0].splitlines()[-1] == "ok"
