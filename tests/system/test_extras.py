"""Packages of extras: the program runs without them, and names the extra if it is needed."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path

import pytest
from command_line import figures
from fakes.films import write_film
from features_there import needs_all_features

import gazerig
from gazerig.drivers.errors import extra_hint

ROOT = Path(__file__).parents[2]

_WITHOUT = """
import sys
for name in ABSENT:
    assert name not in sys.modules
    sys.modules[name] = None  # as if it were not installed
from gazerig.robot.cli.main import main
for words in COMMANDS:
    sys.argv = ["gazerig", *words]
    try:
        main()
    except SystemExit as end:
        print("exit", end.code or 0)
"""


OF_EXTRAS = "matplotlib", "depthai", "scipy", "jinja2", "mujoco", "ai_edge_litert", "distributed"


def python(code: str, folder: Path, **variables: str) -> tuple[str, str]:
    """Run code in a process of its own; return what it wrote to its standard output and error."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True, text=True, cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT), **variables},
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return done.stdout, done.stderr


def _code(*commands: tuple[str, ...], absent: Sequence[str]) -> str:
    return _WITHOUT.replace("COMMANDS", repr(commands)).replace("ABSENT", repr(absent))


def without_extras(
    folder: Path, *commands: tuple[str, ...], absent: Sequence[str] = OF_EXTRAS
) -> tuple[list[str], list[str]]:
    """Run commands without some packages; return their exit codes and output."""
    out, err = python(_code(*commands, absent=absent), folder)
    return re.findall(r"^exit (\d+)$", out, re.MULTILINE), err.splitlines()


@needs_all_features
def test_a_command_that_needs_an_extra_names_it_in_one_line_before_anything_is_done(tmp_path):
    codes, said = without_extras(
        tmp_path,
        ("report", "--scene", "face-to-face"),
        ("report", "a.mcap", "b.mcap"),
        ("sweep", "--set", "gaze.head.eye_only_range_deg=16:56:7", "--scheduler", "tcp://a:1"),
        ("calibrate", "camera", "--oak", "--what", "lens", "--out", "copy.yaml"),
        ("calibrate", "camera", "desk", "--mock", "--yes"),
    )
    writes = f"jinja2 is not installed: pip install -e '{ROOT}[report]'"
    sees = f"depthai is not installed: pip install -e '{ROOT}[oak]'"
    places = f"scipy is not installed: pip install -e '{ROOT}[calibration]'"
    spreads = f"distributed is not installed: pip install -e '{ROOT}[cluster]'"
    assert (codes, said) == (["2"] * 5, [writes, writes, spreads, sees, places])
    assert not list(tmp_path.iterdir())
    broken = ModuleNotFoundError("No module named 'numpy'", name="numpy")
    assert "depthai cannot be loaded (No module" in extra_hint("depthai", "oak", broken)


# ---- Imports of processes: the control loop has NumPy, the serial port and rig files only.


ALLOWED = {
    *("gazerig", "numpy", "serial", "fastcrc", "msgspec", "smbus2"),
    # for the rig's file, which is read and written while running
    *("yaml", "pydantic", "pydantic_core", "annotated_types", "typing_inspection"),
    *("typing_extensions", "cython_runtime"),
    *("sitecustomize", "usercustomize"),  # the machine's own, with every Python: Debian has one
}
"""Packages that are imported: no other."""

LATER = ("asyncio", "ssl", "http.server")
"""Modules that are large though no packages: none of them."""

RUN = """
import sys
from pathlib import PosixPath
from gazerig.robot.run import session
from gazerig.robot.run.options import RunOptions
from gazerig.robot.run.run import Run
from gazerig.robot.run.run_rig import run_rig
options = RunOptions(mock=True, **{options!r}).check_and_complete()
made = Run(run_rig(options), options)
run = session.Session(made, lambda: None, lambda line: None)
with run.power_on() as loop:
    for _ in range(20):
        assert loop.step() is None
    names = set(sys.modules)
    run.stopped_by = "seconds"
made.close()
packages = {{name.partition(".")[0] for name in names}} - sys.stdlib_module_names
print("PACKAGES", *(name for name in packages if not name.startswith("_")))
print("LATER", *(name for name in {later!r} if name in names))
"""

with_mujoco = pytest.mark.skipif(
    find_spec("mujoco") is None, reason="worlds need MuJoCo: pip install 'gazerig[world]'"
)


@pytest.mark.pty
def test_the_process_of_the_loop_imports_little(tmp_path):
    film = write_film(tmp_path / "film.avi", 5, 25.0)
    options = {"video": film, "page": "127.0.0.1:8770"}
    text, _ = python(RUN.format(options=options, later=LATER), tmp_path)
    said = {line.split()[0]: set(line.split()[1:]) for line in text.splitlines() if line}
    assert said["PACKAGES"] >= {"numpy", "serial", "gazerig"}
    assert not said["PACKAGES"] - ALLOWED
    assert not said["LATER"]


@with_mujoco
def test_the_loop_of_an_ordinary_run_knows_no_world(tmp_path):
    """Nor does that of a world in real time know MuJoCo: it is in two other processes."""
    pytest.importorskip("gazerig.features.world")
    code = (
        "import sys; from gazerig.robot.run.run import Run; "
        "from gazerig.config.schema import load_rig; "
        "from gazerig.robot.run.options import RunOptions; "
        "Run(load_rig('desk'), RunOptions(mock=True, fast=True, scene='visitor')).close(); "
        "assert not [m for m in sys.modules if 'world.figure' in m or m.startswith('mujoco')]; "
        "made = Run(load_rig('desk'), RunOptions(mock=True, world='living-room')); "
        "made.scene.people(1.0); made.scene.events(); made.close(); "
        "heavy = ('mujoco', 'OpenGL', 'scipy', 'cv2'); "
        "assert not [m for m in sys.modules if m.split('.')[0] in heavy]; "
        "print('ok')"
    )
    assert python(code, tmp_path)[0].splitlines()[-1] == "ok"


# ---- Without the folders of features/ the rest runs as before, and names what is missing.


RUN_COMMAND = ("run", "desk", "--mock", "--fast", "--no-page", "--scene", "visitor",
               "--seconds", "0.5", "--seed", "0", "--summary", "run.json")  # fmt: skip


@needs_all_features
def test_without_extras_and_without_features_the_head_runs_with_the_same_bytes(tmp_path):
    codes, said = without_extras(
        tmp_path,
        RUN_COMMAND,
        ("check", "desk"),
        ("report", "--help"),
        absent=(*OF_EXTRAS, "trimesh"),  # which also loads half a second
    )
    assert codes == ["0"] * 3, said
    core = tmp_path / "core"
    (core / "gazerig" / "features").mkdir(parents=True)
    for entry in Path(gazerig.__path__[0]).iterdir():
        if entry.name not in ("features", "__pycache__"):
            (core / "gazerig" / entry.name).symlink_to(entry.resolve())
    helps = [(command, "--help") for command in ("study", "report", "scan", "import")]
    out, err = python(
        _code(RUN_COMMAND, ("--help",), *helps, absent=()), core, PYTHONPATH=str(core)
    )
    assert re.findall(r"^exit (\d+)$", out, re.MULTILINE) == ["0", "0", *["2"] * 4]
    assert " run " in out and " study " not in out
    assert err.count("No module named 'gazerig.features.") == len(helps)
    with_all = figures("desk", "--no-page", "--scene", "visitor", "--seconds", "0.5", "--seed", "0")
    for folder in (tmp_path, core):
        run = json.loads((folder / "run.json").read_text())
        assert run["bus"]["tx_sha256"] == with_all["bus"]["tx_sha256"]
