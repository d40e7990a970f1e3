"""What README and docs name is there: keys, files, links, functions, tests."""

import ast
import re
from collections.abc import Iterator
from dataclasses import fields
from functools import cache
from typing import Any, get_args

import pytest
from papers import COMMANDS, EMULATOR, PAPERS, ROOT, blocks, spans

import gazerig
from gazerig.config.entries import parse
from gazerig.config.load import ConfigError, shipped_names
from gazerig.config.parameters import apply_changes, value_of
from gazerig.config.rig import GazeConfig
from gazerig.config.schema import Rig, load_rig
from gazerig.drivers.bus.servo_models import SERVOS
from gazerig.drivers.dynamixel.family import DYNAMIXEL
from gazerig.drivers.feetech.family import FEETECH
from gazerig.drivers.plugins import BusPlugin
from gazerig.drivers.servo_bus.family import Family
from gazerig.gaze.track.track import LID_GROUPS, KeyFrame, Track
from gazerig.params import Declaration, declarations
from gazerig.robot.app.scene_files import scene_names
from gazerig.robot.cli.examples import all_examples
from gazerig.robot.model.joint import JointParams
from gazerig.robot.model.kinematics import LOWER_NECK
from gazerig.sim_mock.scenes import script

# The documents describe every feature: without one of them, they cannot be compared with it.
design = pytest.importorskip("gazerig.features.study.design")
HOME = pytest.importorskip("gazerig.features.study.design").HOME
WORLDS = pytest.importorskip("gazerig.features.world.room").HOME
pytest.importorskip("gazerig.features.bringup")
pytest.importorskip("gazerig.features.lab")

FOLDERS = ("config", "doors", "drivers", "features", "gaze", "gazerig", "robot", "sim_mock")
PARAMETERS = ROOT / "docs/parameters.md"


@cache
def rigs() -> tuple[Rig, ...]:
    return tuple(load_rig(name) for name in shipped_names("rigs"))


# ---- the YAML


@cache
def keys() -> set[str]:
    """Return every key of a rig file and every choice there is for one."""
    found = set(shipped_names("rigs"))

    def walk(shape: Declaration) -> None:
        found.update(str(choice) for choice in shape.choices)
        if shape.params is not None:
            for name, field in declarations(shape.params).items():
                found.add(name)
                walk(field)
        elif shape.inner is not None:
            walk(shape.inner)

    walk(Declaration("params", params=Rig))
    walk(Declaration("params", params=Track))
    for rig in rigs():
        found |= set(rig.joints)
    return found


def is_key(dotted: str) -> bool:
    """Return whether one of the shipped rigs has this key."""
    for rig in rigs():
        try:
            value_of(rig, dotted)
        except ConfigError:
            continue
        return True
    return False


def test_keys_named_are_keys() -> None:
    sections = set(declarations(Rig))
    for paper in PAPERS:
        if paper == PARAMETERS:
            continue  # generated
        for span in spans(paper):
            key = re.match(r"([a-z_]+(?:\.[a-z_0-9]+)+)(: \S+)?$", span)
            if key and key[1].split(".")[0] in sections and not key[1].endswith((".py", ".yaml")):
                assert is_key(key[1]), f"{paper.name}: {span}"


def test_values_set_in_the_papers_are_allowed(desk_rig: Rig) -> None:
    sets = [words.split()[2:] for words in COMMANDS if words.startswith("ctl set ")]
    pairs = [
        (key, float(value))
        for words in sets
        for key, value in zip(words[::2], words[1::2], strict=True)
    ]
    for block in blocks("python"):
        found = re.findall(r'rig\.set_many\(\{"([\w.]+)": ([\d.]+)\}', block.text)
        pairs += [(key, float(value)) for key, value in found]
    assert len(pairs) >= 4
    for key, value in pairs:
        assert apply_changes(desk_rig, {key: value}) != desk_rig, key
    for words in COMMANDS:
        if words.startswith("get ") and "--" not in words:
            assert is_key(words.split()[1]), words


def test_yaml_shown_has_keys_that_there_are() -> None:
    read = [parse("", block.text, []) for block in blocks("yaml")]
    shown = [document.data for document in read if document is not None]
    assert len(shown) == len(read) >= 2
    for data in shown:
        if set(data) <= set(declarations(Track)):
            _fits(Declaration("params", params=Track), data, "track")
            continue
        if "people" in data:
            _fits(Declaration("params", params=script.SceneScript), data, "world")
            continue
        if "conditions" in data or "items" in data:
            form = design.StudyDesign if "conditions" in data else design.Questionnaire
            _fits(Declaration("params", params=form), data, form.__name__)
            continue
        for key, value in data.items():
            if key in declarations(Rig):
                _fits(declarations(Rig)[key], value, key)
            else:
                assert key in keys(), key
                _fits(Declaration("params", params=JointParams), value, key)


def _fits(shape: Declaration, value: Any, place: str) -> None:
    if shape.params is not None:
        for key, item in value.items():
            assert key in declarations(shape.params), f"{place}.{key}"
            _fits(declarations(shape.params)[key], item, f"{place}.{key}")
    elif isinstance(value, tuple) and shape.inner is not None:
        for item in value:
            _fits(shape.inner, item, place)
    elif isinstance(value, dict) and shape.inner is not None:
        for key, item in value.items():
            _fits(shape.inner, item, f"{place}.{key}")


# ---- files, links, names


READERS_OWN = ("study.yaml", "myrig.yaml", "my.yaml", "myhead.yaml", "agree.yaml", "greet.py")
"""Files that a reader writes."""


@cache
def file_names() -> set[str]:
    """Return the names of all files."""
    return {path.name for folder in (*FOLDERS, "tests") for path in (ROOT / folder).rglob("*.*")}


def test_files_named_exist() -> None:
    names = file_names()
    for paper in PAPERS:
        for span in spans(paper):
            if re.fullmatch(r"(?:[\w-]+/)+(?:[\w-]+\.(?:py|yaml|md))?", span):
                inside = (ROOT, ROOT / "robot")
                assert any((base / span).exists() for base in inside), f"{paper.name}: {span}"
            elif re.fullmatch(r"[\w-]+\.(?:py|yaml)", span) and span not in READERS_OWN:
                assert span in names, f"{paper.name}: {span}"


@cache
def defined() -> set[str]:
    """Return every name that the sources define, with and without its class, and every test."""
    names: set[str] = set()
    for path in (*ROOT.glob("tests/*.py"), *ROOT.glob("tests/*/test_*.py")):
        names.add(path.stem)
        names |= set(re.findall(r"^def (\w+)", path.read_text(encoding="utf-8"), re.MULTILINE))
    for folder in FOLDERS:
        for path in (ROOT / folder).rglob("*.py"):
            module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
            names |= {path.stem, f"gazerig.{module}"}
            for node in ast.parse(path.read_text(encoding="utf-8")).body:
                names |= set(_names(node))
    return names


def _names(node: ast.stmt, over: str = "") -> Iterator[str]:
    if isinstance(node, ast.ClassDef):
        yield node.name
        for part in node.body:
            yield from _names(part, f"{node.name}.")
    elif isinstance(node, ast.FunctionDef):
        yield over + node.name
        yield node.name
    elif isinstance(node, ast.AnnAssign | ast.Assign):
        for target in node.targets if isinstance(node, ast.Assign) else [node.target]:
            if isinstance(target, ast.Name):
                yield over + target.id


def test_tests_and_functions_named_exist() -> None:
    known = defined()
    for paper in [*PAPERS, ROOT / "CHANGELOG.md"]:
        text = paper.read_text(encoding="utf-8")
        for name in set(re.findall(r"\b(test_[a-z0-9_]+)\b", text)):
            if name != "test_e17_":
                assert name in known, f"{paper.name}: {name}"
        for name in set(re.findall(r"`([A-Z]\w+\.\w+)`", text)):
            assert name in known, f"{paper.name}: {name}"


OUTCOMES = get_args(gazerig.Outcome)

SAID = {
    ". .venv/bin/activate",
    *("v4l2-ctl", "not moving", "calibration"),
    # of a program's own
    *("import gazerig", "mypy --strict", "with", "for_s=2.0", "fast=True", *OUTCOMES),
    # keys, lines and answers of the program
    *(
        "ok",
        "signed_rank",
        "rank_sum",
        "chi_square",
        "chi_square",
        "cup: {held_by: anna, side: left}",
        "bus ok",
        "null",
        "None",
        "path",
        '"baud": null',
        '{"ok": ...}',
        '{"error": ...}',
    ),
    *("q", "n", "y", "+", "-", "@", "left 3", "enter", "skip", "back", "end", "turn 300"),
    # values, files and columns of a sweep
    *("LOW:HIGH:STEPS", "LOW:HIGH", "sweep-my-visitor", "report.KEY", "verdict.KEY"),
    *("table.csv", "table.parquet", "response.png", "runs.jsonl", "arguments.json", "results.json"),
    *("dcmotor", "filterexact"),  # of MuJoCo
    # formats, bytes, and what is typed elsewhere
    *("{all: 0.5}", "{jaw: 8, left_brow: 10}", "refuse", "slow", "joint", "time", "angle", "frame"),
    *("time,x,y", "start,duration,part", "N: [x0, y0, x1, y1]", "start + k * period"),
    *("84 00 70 2E", "2B", "83 01", "17", "FF FF 01 02 01 FB", "pytest -k e17"),
    *("sudo udevadm control --reload", "sudo usermod -aG dialout $USER", "ls /dev/serial/by-id"),
    *("sudo raspi-config", "sudo usermod -aG i2c $USER", "/dev/i2c-*"),
    *("sudo systemctl stop ModemManager", "robot", "./face", "myrig.yaml.bak-20260131-235958"),
    *('bus="ideal"', "with", "pre-commit install", "_deg", "_rad", "_ms", "_m", "p_world_m"),
    *(
        'page="127.0.0.1:8080"',
        "say=print",
        "fast=True",
        "mock=True",
        "gazerig.open",
        "gazerig.connect()",
    ),
    *(
        "[tool.importlinter]",
        "sleep_until",
        "retune",
        "faults",
        "_obey",
        "camera.latest",
    ),
}
"""Spans that name nothing which could be looked up."""


def test_every_span_names_something_that_is_there() -> None:
    words = {*keys(), *defined(), *SERVOS, *scene_names(), *all_examples(), *_modes(), *LOWER_NECK}
    words |= {field.name for field in fields(script.WorldCameraParams)}
    words |= {field.name for field in (*fields(Family), *fields(BusPlugin))} | {
        *DYNAMIXEL.registers,
        *FEETECH.registers,
    }
    words |= {field.name for field in (*fields(KeyFrame), *fields(Track))} | {*LID_GROUPS}
    scripts = (
        *(script.SceneScript, script.PersonScript, script.PlaceScript),
        *(script.ThingScript, script.Act, script.ExpectedLook),
        *(script.SwayScript, script.WaveScript),
    )
    words |= {field.name for one in scripts for field in fields(one)}
    words |= {*get_args(script.Do), *shipped_names("worlds", WORLDS), script.HEAD, script.BASE}
    forms = (
        *(design.StudyDesign, design.Presentation, design.Trials),
        *(design.Questionnaire, design.Item, design.Condition, design.Hypothesis),
    )
    words |= {field.name for form in forms for field in fields(form)}
    words |= {*shipped_names("studies", HOME), *shipped_names("questionnaires", HOME)}
    for paper in PAPERS:
        if paper in (EMULATOR, PARAMETERS):
            continue  # their tables are compared with the emulator and the declarations
        for span in spans(paper):
            if span.startswith(
                ("gazerig ", "--", "make ", "pip install ", "/dev/", "/etc/", "test_")
            ):
                continue
            messages = r"/api/v1/|\?|\{|\"stay|\$XDG|/tmp/|Auth"
            if paper.name == "connect-your-program.md" and re.match(messages, span):
                continue  # read by test_programs
            if named := re.match(r"(?:PYTHONPATH=\S+ )?python (\S+\.py)", span):
                assert (ROOT / named[1]).exists(), f"{paper.name}: {span}"
                continue
            if call := re.match(r"(gazerig|head)\.([a-z]\w*)(?=[(]|$)", span):
                place: object = gazerig if call[1] == "gazerig" else gazerig.SimulatedHead
                if hasattr(place, call[2]):
                    continue
            first = re.split(r"[ (:]", span)[0]
            within = re.sub(r"^[a-z_.]+\.(?=[A-Z])", "", span)  # a module's
            looked_up = {span, first, span.rpartition(".")[0], within}
            assert span in SAID or looked_up & words or is_key(first) or _is_file(span), (
                f"{paper.name}: `{span}`: mend the paper, or add it to SAID"
            )


def _modes() -> Iterator[str]:
    for kind in ("characters", "profiles", "rules", "rigs"):
        yield from shipped_names(kind)


def _is_file(span: str) -> bool:
    return any((ROOT / base / span).exists() for base in ("", "robot")) or span.endswith(
        (".py", ".yaml")
    )


def test_the_glossary_has_a_line_for_every_section_of_gaze() -> None:
    text = (ROOT / "docs/glossary.md").read_text("utf-8")
    rows = [line.split(" | ") for line in text.splitlines() if line.startswith("| ")][1:]
    assert len(rows) >= 60 and all(len(row) == 4 and all(row) for row in rows)
    terms = [row[0].removeprefix("| ") for row in rows]
    assert terms == sorted(terms, key=str.lower) and len(set(terms)) == len(terms)
    # The sections whose names are terms of the field; the others are plain words.
    sections = declarations(GazeConfig).keys() - {
        "chooser", "attention", "idle", "lids", "mouth", "oculomotor",
    }  # fmt: skip
    named = set(re.findall(r"`gaze\.(\w+)", text)) | {"tracks" for term in terms if term == "track"}
    assert sections <= named


def test_every_numbered_check_listed_is_a_test() -> None:
    text = (ROOT / "docs/checks.md").read_text("utf-8")
    listed = [int(number) for number in re.findall(r"^\| E(\d+) \|", text, re.M)]
    tested = {int(name[6:].split("_")[0]) for name in defined() if re.match(r"test_e\d+_", name)}
    assert listed == sorted(tested) and len(listed) >= 19


def test_the_project_speaks_of_itself_alone() -> None:
    for paper in [*PAPERS, ROOT / "CHANGELOG.md"]:
        assert "/shared" not in paper.read_text(encoding="utf-8")
