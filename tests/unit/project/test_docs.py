"""What README and docs name is there: keys, files, links, functions, tests."""

import re
from functools import cache
from typing import Any

import pytest
from papers import PAPERS, ROOT, blocks, spans

from gazerig.config.entries import parse
from gazerig.config.load import ConfigError, shipped_names
from gazerig.config.parameters import value_of
from gazerig.config.schema import Rig, load_rig
from gazerig.gaze.track.track import Track
from gazerig.params import Declaration, declarations
from gazerig.robot.model.joint import JointParams
from gazerig.sim_mock.scenes import script

# The documents describe every feature: without one of them, they cannot be compared with it.
design = pytest.importorskip("gazerig.features.study.design")
pytest.importorskip("gazerig.features.bringup")
pytest.importorskip("gazerig.features.lab")

FOLDERS = ("config", "doors", "drivers", "features", "gaze", "gazerig", "robot", "sim_mock")


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


def test_keys_named_are_keys():
    sections = set(declarations(Rig))
    for paper in PAPERS:
        for span in spans(paper):
            key = re.match(r"([a-z_]+(?:\.[a-z_0-9]+)+)(: \S+)?$", span)
            if key and key[1].split(".")[0] in sections and not key[1].endswith((".py", ".yaml")):
                assert is_key(key[1]), f"{paper.name}: {span}"


def test_yaml_shown_has_keys_that_there_are():
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


READERS_OWN = (
    "study.yaml",
    "myrig.yaml",
    "my.yaml",
    "myhead.yaml",
    "tracks/agree.yaml",
    "greet.py",
)
"""Files that a reader writes."""


@cache
def file_names() -> set[str]:
    """Return the names of all files."""
    return {path.name for folder in (*FOLDERS, "tests") for path in (ROOT / folder).rglob("*.*")}


def test_files_named_exist():
    names = file_names()
    for paper in PAPERS:
        for span in spans(paper):
            if span in READERS_OWN:
                continue
            if re.fullmatch(r"(?:[\w-]+/)+(?:[\w-]+\.(?:py|yaml|md))?", span):
                inside = (ROOT, ROOT / "robot")
                assert any((base / span).exists() for base in inside), f"{paper.name}: {span}"
            elif re.fullmatch(r"[\w-]+\.(?:py|yaml)", span):
                assert span in names, f"{paper.name}: {span}"
