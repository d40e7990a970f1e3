"""Packages of extras: the program runs without them, and names the extra if it is needed."""

import re
import tomllib
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest
from features_there import needs_all_features
from light_python import LightPython

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
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


OF_EXTRAS = ("matplotlib", "depthai", "scipy", "jinja2", "mujoco", "ai_edge_litert")


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
) -> None:
    codes, said = without_extras(
        python,
        tmp_path,
        ("report", "--scene", "face-to-face"),
        ("report", "a.mcap", "b.mcap"),
        ("sweep", "--set", "gaze.head.eye_only_range_deg=16:56:7"),
        ("calibrate", "camera", "--oak", "--what", "lens", "--out", "copy.yaml"),
        ("calibrate", "camera", "desk", "--mock", "--yes"),
    )
    draws = f"matplotlib is not installed: pip install -e '{ROOT}[report]'"
    sees = f"depthai is not installed: pip install -e '{ROOT}[oak]'"
    places = f"scipy is not installed: pip install -e '{ROOT}[calibration]'"
    writes = f"jinja2 is not installed: pip install -e '{ROOT}[report]'"
    assert (codes, said) == (["2"] * 5, [writes, writes, draws, sees, places])
    assert not list(tmp_path.iterdir())


@needs_all_features
def test_the_head_runs_without_extras(python: LightPython, tmp_path: Path) -> None:
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
def test_every_extra_that_is_named_brings_its_package_and_the_tests_have_them_all() -> None:
    named = {
        (package, extra)
        for path in ROOT.glob("[dfgr]*/**/*.py")
        for package, extra in re.findall(
            r'(?:extra_hint|require_package)\("([\w-]+)", "(\w+)"', path.read_text("utf-8")
        )
        if "docs" not in path.parts
    }
    assert {("depthai", "oak"), ("matplotlib", "report")} <= named
    base = " ".join(PROJECT["dependencies"])
    tested = re.search(r"gazerig\[(.+)\]", " ".join(EXTRAS["dev"]))
    assert tested is not None
    for package, extra in named:
        assert any(wanted.startswith(package) for wanted in EXTRAS[extra]), extra
        assert package not in base
        assert extra in tested[1].split(",")
