"""Allowed imports: the contracts of pyproject.toml, and the owners of vendor packages."""

import ast
import os
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = ("config", "doors", "drivers", "features", "gaze", "robot", "sim_mock")

# Vendor packages, and the only modules that may see each.
OWNERS = {
    "serial": ("drivers.serial.", "sim_mock.in_process_port"),
    "dynamixel_sdk": (),
    "depthai": ("drivers.camera.oak.discovery",),
    "mcap": ("drivers.camera.playback", "drivers.camera.recorder", "robot.recording."),
    "smbus2": ("drivers.i2c.port",),
    "zstandard": ("robot.recording.",),
    "miniaudio": ("drivers.sound.",),
    "matplotlib": ("features.lab.report.plotting", "features.study.report"),
    "pyarrow": ("features.lab.sweep.run_outcome",),
    "jinja2": ("features.lab.report.", "features.study.report"),
    "aiohttp": ("robot.dashboard.", "features.study.server", "doors."),
    "yaml": ("config.entries", "config.save"),
    "pydantic": ("config.",),
    "pydantic_core": ("config.",),
    "typer": (
        "robot.cli.",
        "features.bringup.cli.",
        "features.study.cli",
        "features.lab.cli.",
        "features.animation.cli.",
    ),
    "viser": ("robot.dashboard.",),
    "PIL": (
        "features.bringup.calibration.charuco_views",
        "robot.dashboard.view.glb",
        "robot.description.gltf",
    ),
    "cv2": (
        "drivers.",
        "features.lab.analysis.drawn_face",
        "features.bringup.calibration.camera_calibration",
        "features.bringup.calibration.charuco_",
        "robot.model.charuco_board",
        "features.bringup.calibration.hand_eye",
        "robot.description.mesh_files",
        "robot.model.intrinsics",
        "robot.dashboard.",
        "features.world.",
        "sim_mock.",
    ),
}


def modules() -> list[tuple[str, Path]]:
    return [
        (".".join(path.relative_to(ROOT).with_suffix("").parts), path)
        for room in ROOMS
        for path in sorted((ROOT / room).rglob("*.py"))
    ]


@cache
def parsed(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


def imports(path: Path) -> Iterator[str]:
    for node in ast.walk(parsed(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name.removeprefix("gazerig.") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            assert node.module is not None
            wanted = node.module.removeprefix("gazerig.")
            yield wanted
            yield from (f"{wanted}.{alias.name}" for alias in node.names)


def test_vendor_packages_have_owners() -> None:
    for module, path in modules():
        for package in {wanted.split(".")[0] for wanted in imports(path)} & OWNERS.keys():
            assert module.startswith(OWNERS[package]), f"{module} must not import {package}"


def linted(folder: Path) -> subprocess.CompletedProcess[str]:
    """Check the contracts on the package ``gazerig`` in a folder."""
    command = [sys.executable, "-c", "from importlinter.cli import lint_imports_command as c; c()"]
    return subprocess.run(
        [*command, "--no-cache", "--config", str(ROOT / "pyproject.toml")],
        cwd=folder, env={**os.environ, "PYTHONPATH": str(folder)}, capture_output=True, text=True,
        check=False,
    )  # fmt: skip


def test_storeys() -> None:
    found = linted(ROOT)
    assert found.returncode == 0, found.stdout + found.stderr


def test_every_room_of_the_robot_has_its_storey() -> None:
    text = (ROOT / "pyproject.toml").read_text(encoding="utf-8")
    contracts = tomllib.loads(text)["tool"]["importlinter"]["contracts"]
    (storeys,) = (c["layers"] for c in contracts if c["id"] == "storeys")
    named = {room.strip() for layer in storeys for room in layer.split("|")}
    rooms = {f"gazerig.robot.{path.parent.name}" for path in ROOT.glob("robot/*/__init__.py")}
    assert rooms <= named


def test_emulated_servos_share_no_codec_with_the_drivers() -> None:
    data_sheets = {
        *("drivers.dynamixel.control_table", "drivers.feetech.memory_table"),
        "drivers.servo_bus.family",
    }
    for module, path in modules():
        if module.startswith(("sim_mock.smart_servo.", "sim_mock.dynamixel.", "sim_mock.feetech.")):
            shared = {w for w in imports(path) if w.startswith("drivers.")}
            allowed = {w for w in shared if w.startswith(tuple(data_sheets))}
            assert shared == allowed, f"{module} must not import {shared - allowed}"
            assert not (shared and "smart_servo" in module), f"{module} must not know a make"


def test_gaze_stands_on_numpy_and_msgspec_alone() -> None:
    standard = set(sys.stdlib_module_names) | {"numpy", "msgspec", "gaze", "params"}
    for module, path in modules():
        if module.startswith("gaze."):
            packages = {wanted.split(".")[0] for wanted in imports(path)}
            assert packages <= standard, f"{module}: {packages - standard}"


def test_the_declaration_of_parameters_stands_on_the_standard_library_alone() -> None:
    packages = {wanted.split(".")[0] for wanted in imports(ROOT / "gazerig" / "params.py")}
    assert packages <= set(sys.stdlib_module_names)


def test_package_files_hold_a_docstring_and_nothing_else() -> None:
    for module, path in modules():
        if path.stem == "__init__":
            body = parsed(path).body
            assert len(body) == 1 and isinstance(body[0], ast.Expr), module


def test_no_class_name_is_defined_twice() -> None:
    """Nor one that begins with an underscore in two modules."""
    found: dict[str, list[Path]] = {}
    for path in [*(path for _, path in modules()), *sorted((ROOT / "gazerig").rglob("*.py"))]:
        for node in ast.walk(parsed(path)):
            if isinstance(node, ast.ClassDef):
                found.setdefault(node.name, []).append(path.relative_to(ROOT))
    assert {name: where for name, where in found.items() if len(where) > 1} == {}
