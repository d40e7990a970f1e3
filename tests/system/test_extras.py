"""Packages of extras: the program runs without them, and names the extra if it is needed."""

import json
import os
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Sequence
from importlib.util import find_spec
from pathlib import Path

import pytest
from fakes.films import write_film
from features_there import needs_all_features
from light_python import LightPython

import gazerig

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
EXTRAS: dict[str, list[str]] = PROJECT["optional-dependencies"]

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


OF_EXTRAS = (
    *("matplotlib", "depthai", "scipy", "jinja2", "mujoco", "ai_edge_litert", "distributed"),
)


@pytest.fixture(scope="module")
def python(tmp_path_factory: pytest.TempPathFactory) -> Iterator[LightPython]:
    light = LightPython(tmp_path_factory.mktemp("said"))
    yield light
    light.close()


def without_extras(
    python: LightPython, folder: Path, *commands: tuple[str, ...], absent: Sequence[str] = OF_EXTRAS
) -> tuple[list[str], list[str]]:
    """Run commands without some packages; return their exit codes and output."""
    code = _WITHOUT.replace("COMMANDS", repr(commands)).replace("ABSENT", repr(absent))
    out, err = python.run(code, folder)
    return re.findall(r"^exit (\d+)$", out, re.MULTILINE), err.splitlines()


@needs_all_features
def test_a_command_that_needs_an_extra_names_it_in_one_line_before_anything_is_done(
    python: LightPython, tmp_path: Path
):
    codes, said = without_extras(
        python,
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


@needs_all_features
def test_the_head_runs_without_extras(python: LightPython, tmp_path: Path):
    codes, said = without_extras(
        python,
        tmp_path,
        ("run", "--mock", "--fast", "--seconds", "1", "--summary", "run.json"),
        ("check", "desk"),
        ("run", "desk", "--mock", "--fast", "--no-page", "--seconds", "1"),
        ("report", "--help"),
        absent=(*OF_EXTRAS, "trimesh"),  # which also loads half a second
    )
    assert codes == ["0"] * 4, said
    assert (tmp_path / "run.json").is_file()


@needs_all_features
def test_every_extra_that_is_named_brings_its_package_and_the_tests_have_them_all():
    named = {
        (package, extra)
        for path in ROOT.glob("[dfgr]*/**/*.py")
        for package, extra in re.findall(
            r'(?:extra_hint|require_package)\("([\w-]+)", "(\w+)"', path.read_text("utf-8")
        )
        if "docs" not in path.relative_to(ROOT).parts
    }
    assert {("depthai", "oak"), ("matplotlib", "report")} <= named
    base = " ".join(PROJECT["dependencies"])
    tested = re.search(r"gazerig\[(.+)\]", " ".join(EXTRAS["dev"]))
    assert tested is not None
    for package, extra in named:
        assert any(wanted.startswith(package) for wanted in EXTRAS[extra]), extra
        assert package not in base
        assert extra in tested[1].split(",")


# ---- Imports of processes: the control loop has NumPy, the serial port and rig files only.


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
@pytest.mark.parametrize("eyes", ["scene", "film, page"])
def test_the_process_of_the_loop_imports_little(eyes: str, python: LightPython, tmp_path: Path):
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
def test_the_loop_of_an_ordinary_run_knows_no_world(python: LightPython, tmp_path: Path):
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
    assert python.run(code, tmp_path)[0].splitlines()[-1] == "ok"


# ---- Without the folders of features/ the rest runs as before, and names what is missing.


COMMAND = "run desk --mock --fast --no-page --scene visitor --seconds 0.5 --seed 0 --summary -"


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """A folder with the package by links, its features left out."""
    top = tmp_path / "gazerig"
    (top / "features").mkdir(parents=True)
    for entry in Path(gazerig.__path__[0]).iterdir():
        if entry.name not in ("features", "__pycache__"):
            (top / entry.name).symlink_to(entry.resolve())
    return tmp_path


def run_command(words: str, package: Path | None = None) -> subprocess.CompletedProcess[str]:
    path = {"PYTHONPATH": str(package)} if package else {}
    main = "from gazerig.robot.cli.entry_point import main; main()"
    return subprocess.run(
        [sys.executable, "-c", main, *words.split()],
        capture_output=True, text=True, cwd=package, env={**os.environ, **path},
    )  # fmt: skip


def test_without_features_a_run_has_the_same_bytes(package: Path):
    whole, core = (
        json.loads(run_command(COMMAND, place).stdout)["bus"] for place in (None, package)
    )
    assert core["tx_sha256"] == whole["tx_sha256"]


def test_without_features_their_commands_name_what_is_missing(package: Path):
    listed = run_command("--help", package).stdout
    assert " run " in listed and " study " not in listed
    for command in ("study", "report", "scan", "import"):
        done = run_command(f"{command} --help", package)
        assert done.returncode == 2 and "No module named 'gazerig.features." in done.stderr
