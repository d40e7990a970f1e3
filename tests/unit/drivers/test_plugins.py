"""Parts of other packages are found by name, loaded when used, and refused in one line."""

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from features_there import skip_without_part
from outside_package import install, on_path

from gazerig.config.load import ConfigError
from gazerig.config.parameters import apply_changes, parameters
from gazerig.config.schema import load_rig
from gazerig.drivers import plugins
from gazerig.drivers.errors import PluginError
from gazerig.drivers.plugins import (
    ATTENTION,
    CAMERA,
    COMMAND,
    DETECTOR,
    DOOR,
    GROUPS,
    SHIPPED,
    SURROUNDINGS,
    Plugin,
)
from gazerig.robot.model.clock import RealClock
from gazerig.robot.run.cameras import place_camera, real_camera
from gazerig.robot.run.models import rig_kinematics
from gazerig.robot.run.options import RunOptions, parse_camera

DESK = Path(__file__).parents[3] / "config" / "rigs" / "desk.yaml"

RULE = """
    from dataclasses import dataclass
    from typing import Annotated
    from gazerig.drivers.plugins import AttentionPlugin
    from gazerig.params import Bounds

    @dataclass(frozen=True)
    class Params:
        height_m: Annotated[float, Bounds(0.0, 3.0), "height that is looked at"] = 1.0

    class Rule:
        def __init__(self, params):
            self.params = params

        def choose(self, percept, state, t_s):
            return (1.0, 0.0, self.params.height_m)

    PLUGIN = AttentionPlugin(Rule, Params)
"""


@pytest.fixture
def folder(tmp_path):
    with on_path(tmp_path / "site") as made:
        made.mkdir()
        yield made


def with_chooser(tmp_path, name, section=""):
    text = DESK.read_text(encoding="utf-8")
    head, gaze, rest = text.partition("\ngaze:")
    _, end, rest = rest.partition("\n")
    assert gaze and end
    file = tmp_path / "mine.yaml"
    file.write_text(f"{head}\ngaze:\n  chooser: {name}\n{section}{rest}", encoding="utf-8")
    return str(file)


def fault(path):
    with pytest.raises(ConfigError) as caught:
        load_rig(path)
    lines = str(caught.value).splitlines()
    assert len(lines) == 1, lines
    return lines[0]


# --- ours come through the same door


@pytest.mark.parametrize(("group", "name"), [(g, n) for g in GROUPS for n in SHIPPED[g]])
def test_ours_are_found_and_loaded_by_the_same_code(group, name):
    found = plugins.find(group, name)
    skip_without_part(found.value)
    assert found.is_ours
    assert found in plugins.registrations(group)
    part = found.load()
    if group not in (ATTENTION, COMMAND, SURROUNDINGS, DOOR):
        assert isinstance(part, Plugin)


# --- those of others


def test_a_name_nobody_brings_is_refused_with_those_there_are(folder):
    install(folder, "p", {CAMERA: {"fish": "fish_eye:Fish"}}, {"fish_eye": "class Fish: pass"})
    with pytest.raises(
        PluginError,
        match="^no camera 'fisch'; did you mean 'fish'. available: webcam, oak, fish$",
    ):
        plugins.find(CAMERA, "fisch")


def test_a_name_that_is_taken_is_named_with_both_packages(folder):
    install(folder, "one", {DETECTOR: {"eyes": "m:x", "auto": "m:x"}}, {"m": "x = 1"})
    install(folder, "two", {DETECTOR: {"eyes": "m:x"}}, {}, "3.0")
    with pytest.raises(
        PluginError, match="^detector 'eyes' comes with one 1.2 and two 3.0: uninstall one of them$"
    ):
        plugins.find(DETECTOR, "eyes")
    assert plugins.find(DETECTOR, "auto").is_ours


@pytest.mark.parametrize(
    ("source", "reported"),
    [
        (
            "import nowhere_to_be_found",
            "ModuleNotFoundError: No module named 'nowhere_to_be_found'",
        ),
        ("raise RuntimeError('no\\nlicence')", "RuntimeError: no licence"),
        ("raise SystemExit(3)", "SystemExit: 3"),
        ("other = 1", "AttributeError: module 'broken' has no attribute 'PLUGIN'"),
        ("def x(:", "SyntaxError: invalid syntax"),
    ],
)
def test_a_package_that_cannot_be_imported_is_one_line_at_its_key(
    folder, tmp_path, source, reported
):
    install(folder, "bad-rule", {ATTENTION: {"bad": "broken:PLUGIN"}}, {"broken": source})
    line = fault(with_chooser(tmp_path, "bad"))
    assert "mine.yaml:" in line and "gaze.chooser" in line
    assert f"attention 'bad' of bad-rule 1.2 cannot be loaded: {reported}" in line


# --- their sections of the rig file


def test_a_section_is_checked_like_ours(folder, tmp_path):
    install(folder, "tall-rule", {ATTENTION: {"tallest": "tall_rule:PLUGIN"}}, {"tall_rule": RULE})
    rig: Any = load_rig(with_chooser(tmp_path, "tallest", "  tallest:\n    height_m: 1.8\n"))
    assert rig.gaze.plugins["tallest"].height_m == 1.8
    plain: Any = load_rig(with_chooser(tmp_path, "tallest"))
    assert plain.gaze.plugins["tallest"].height_m == 1.0
    for section, reported in (
        ("    height_m: 8.0\n", "gaze.tallest.height_m: is 8.0, wanted a number, 0 to 3 m"),
        ("    heigth_m: 1.0\n", "gaze.tallest.heigth_m: unknown key; did you mean 'height_m'?"),
        ("    height_m: tall\n", "is 'tall', wanted a number, 0 to 3 m"),
    ):
        line = fault(with_chooser(tmp_path, "tallest", f"  tallest:\n{section}"))
        assert reported in line, line
        assert "mine.yaml:" in line


def test_a_rig_with_a_section_is_changed_listed_and_sent_to_other_processes(folder, tmp_path):
    install(folder, "tall-rule", {ATTENTION: {"tallest": "tall_rule:PLUGIN"}}, {"tall_rule": RULE})
    rig: Any = load_rig(with_chooser(tmp_path, "tallest"))
    other: Any = apply_changes(rig, {"gaze.tallest.height_m": 2.5})
    assert other.gaze.plugins["tallest"].height_m == 2.5
    with pytest.raises(ConfigError, match="is 9.0, wanted"):
        apply_changes(rig, {"gaze.tallest.height_m": 9.0})
    (found,) = [one for one in parameters(other, rig) if one.key == "gaze.tallest.height_m"]
    assert (found.unit, found.low, found.high, found.default) == ("m", 0.0, 3.0, 1.0)
    assert pickle.loads(pickle.dumps(other)) == other != rig
    # From the plain rig to it and back, as a file that is edited does.
    chosen: Any = apply_changes(load_rig("desk"), {"gaze.chooser": "tallest"})
    assert chosen.gaze.plugins["tallest"].height_m == 1.0


# --- cameras


FISH = """
    import numpy as np
    from dataclasses import dataclass
    from typing import Annotated
    from gazerig.drivers.camera.source import Shot
    from gazerig.drivers.plugins import CameraPlugin
    from gazerig.drivers.types import Detections
    from gazerig.params import Bounds

    @dataclass(frozen=True)
    class Params:
        grey: Annotated[int, Bounds(0, 255), "of its frames"] = 7

    class Frames:
        def __init__(self, params):
            self.grey, self.number = params.grey, 0
        def open(self): pass
        def take(self, now_s, stop):
            stop.wait(0.01)
            self.number += 1
            return Shot(now_s(), self.number, np.full((24, 32, 3), self.grey, np.uint8))
        def events(self): return ()
        def close(self): pass

    class Finds(Frames):
        def latest(self, now_s):
            self.number += 1
            return Detections(now_s, self.number, 32, 24)
        take = property()

    FRAMES, FINDS = CameraPlugin(Frames, Params), CameraPlugin(Finds, Params)
"""


def fish_rig(tmp_path, section="frames:\n  grey: 9\n"):
    file = tmp_path / "mine.yaml"
    file.write_text(DESK.read_text(encoding="utf-8") + "\n" + section, encoding="utf-8")
    return load_rig(str(file))


@pytest.fixture
def fish(folder):
    parts = {CAMERA: {"frames": "fish_camera:FRAMES", "finds": "fish_camera:FINDS"}}
    install(folder, "fish", parts, {"fish_camera": FISH})


@pytest.mark.parametrize("name", ["frames", "finds"])
def test_a_camera_of_a_package_is_looked_through_by_its_name(fish, tmp_path, name):
    rig, clock = fish_rig(tmp_path), RealClock()
    options = RunOptions(mock=True, camera=parse_camera(name))
    view, _ = place_camera(rig, options, rig_kinematics(rig), in_process=True)
    camera = real_camera(rig, view, options, clock.now_s)
    camera.open()
    try:
        until_s = clock.now_s() + 60.0
        while (found := camera.latest(clock.now_s())) is None:
            assert clock.now_s() < until_s, camera.events()
        assert (found.width_px, found.height_px) == (32, 24)
        assert found.image is None if name == "finds" else np.all(found.image == 9)
    finally:
        camera.close()
    assert not any("lost" in line for line in camera.events())
