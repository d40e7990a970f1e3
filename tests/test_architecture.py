"""Which room may import which: walks the imports and fails on a wrong arrow."""

import ast
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("config", "drivers", "gaze", "robot", "sim_mock")

# The pure parts of the machine that a second world may also stand on.
PURE = {
    "robot.calibration.charuco_board",
    "robot.model.clock",
    "robot.perception.face_pose",
    "robot.model.frames",
    "robot.perception.intrinsics",
    "robot.model.kinematics",
}
# Where config, the machine and the second world meet.
TOP = {
    "robot.app.assemble",
    "robot.app.camera_factory",
    "robot.cli.record",
    "robot.cli.main",
    "robot.cli.calibrate_camera",
    "robot.cli.neck_motion",
    "robot.cli.emulate",
    "robot.cli.calibrate_face",
    "robot.cli.calibrate",
    "robot.cli.motion",
    "robot.cli.ports",
    "robot.app.emulation",
    "robot.app.rig_limits",
    "robot.app.bus_wiring",
    "robot.cli.monitor",
    "robot.cli.bringup_commands",
    "robot.cli.jog_prompt",
    "robot.cli.setup_maestro",
    "robot.cli.messages",
    "robot.cli.calibrate_joint",
    "robot.cli.open_port",
    "robot.cli.reboot",
    "robot.cli.setup",
    "robot.cli.scan",
    "robot.cli.doctor",
    "robot.cli.terminal",
    "robot.cli.examples",
    "robot.cli.run",
    "robot.cli.tune",
    "robot.cli.replay",
    "robot.cli.report",
    "robot.app.live_params",
    "robot.app.param_store",
    "robot.app.resimulate",
}

# Vendor packages, and the only modules that may see each.
OWNERS = {
    "serial": ("drivers.serial.", "sim_mock.in_process_port"),
    "dynamixel_sdk": (
        "drivers.dynamixel.",
        "drivers.serial.port",
        "sim_mock.in_process_port",
    ),
    "depthai": ("drivers.camera.oak_sdk",),
    "mcap": ("drivers.camera.recording_", "robot.recording."),
    "smbus2": ("drivers.i2c.port",),
    "zstandard": ("robot.recording.",),
    "orjson": ("robot.recording.",),
    "matplotlib": ("robot.report.",),
    "jinja2": ("robot.report.",),
    "aiohttp": ("robot.dashboard.",),
    "ruamel": ("config.entries", "config.save"),
    "pydantic": ("config.",),
    "pydantic_core": ("config.",),
    "typer": ("robot.cli.",),
    "viser": ("robot.dashboard.",),
    "PIL": ("robot.calibration.charuco_page",),
    "cv2": (
        "drivers.",
        "robot.calibration.camera_calibration",
        "robot.calibration.charuco_",
        "robot.perception.face_pose",
        "robot.calibration.hand_eye",
        "robot.analysis.heatmap",
        "robot.perception.intrinsics",
        "robot.dashboard.",
        "robot.perception.kalman",
        "sim_mock.",
    ),
}


def modules() -> list[tuple[str, Path]]:
    return [
        (".".join(path.relative_to(ROOT).with_suffix("").parts), path)
        for room in ROOMS
        for path in sorted((ROOT / room).rglob("*.py"))
    ]


def imports(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name.removeprefix("gazerig.") for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: relative import"
            assert node.module is not None
            wanted = node.module.removeprefix("gazerig.")
            yield wanted
            yield from (f"{wanted}.{alias.name}" for alias in node.names)


def room_allowed(module: str, wanted: str) -> bool:
    room, other = module.split(".")[0], wanted.split(".")[0]
    if other not in ROOMS or other == room:
        return True
    if room in ("gaze", "drivers"):
        return False
    if room == "robot":
        return other in ("gaze", "drivers") or module in TOP
    if room == "config":
        return other in ("gaze", "drivers", "robot")
    pure = any(wanted == name or wanted.startswith(f"{name}.") for name in PURE)
    return other in ("gaze", "drivers") or pure or wanted == "robot"


@pytest.mark.parametrize(("module", "path"), modules(), ids=[name for name, _ in modules()])
def test_arrows(module: str, path: Path) -> None:
    for wanted in imports(path):
        if wanted == "robot" and module.startswith("sim_mock"):
            pytest.fail(f"{module} imports robot as a whole")
        assert room_allowed(module, wanted), f"{module} must not import {wanted}"
        package = wanted.split(".")[0]
        owners = OWNERS.get(package)
        if owners is not None:
            assert module.startswith(owners), f"{module} must not import {package}"


MAKES = tuple(
    f"drivers.{m}." for m in ("dynamixel", "feetech", "maestro", "pca9685", "hobby_board")
)


def test_the_servo_engine_knows_no_make_of_servo() -> None:
    shared = ("drivers.servo_bus.", "drivers.serial.", "drivers.event_log")
    for module, path in modules():
        if module.startswith(shared):
            makes = {
                w for w in imports(path) if w.startswith("drivers.") and w.split(".")[1] in MAKES
            }
            assert not makes, f"{module} must not import {makes}"


def test_gaze_stands_on_numpy_alone() -> None:
    standard = set(sys.stdlib_module_names) | {"numpy", "gaze"}
    for module, path in modules():
        if module.startswith("gaze."):
            packages = {wanted.split(".")[0] for wanted in imports(path)}
            assert packages <= standard, f"{module}: {packages - standard}"


def test_package_files_hold_a_docstring_and_nothing_else() -> None:
    for module, path in modules():
        if path.stem == "__init__":
            body = ast.parse(path.read_text(encoding="utf-8")).body
            assert len(body) == 1 and isinstance(body[0], ast.Expr), module


def test_it_would_catch_a_wrong_arrow() -> None:
    assert not room_allowed("gaze.head", "robot.control.loop")
    assert not room_allowed("drivers.camera.webcam", "gaze.types")
    assert not room_allowed("robot.control.loop", "sim_mock.scenes.registry.visitor")
    assert not room_allowed("robot.control.loop", "config.schema")
    assert not room_allowed("sim_mock.scenes.registry.visitor", "robot.control.loop")
    assert room_allowed("sim_mock.cameras.detections", "robot.model.frames")
