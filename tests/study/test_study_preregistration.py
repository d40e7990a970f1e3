"""A study's hash is of what it says, and of nothing else."""

import json
import re
from pathlib import Path

import pytest

from gazerig.config.shipped import SHIPPED, shipped_names
from gazerig.features.study.run.study_file import LoadedStudy, load_study
from gazerig.features.study.shipped import HOME

PORT = re.compile(r"port: \S+")
TEXT = (HOME / "studies" / "nakamoto_1.yaml").read_text(encoding="utf-8")


def study_of(folder: Path, text: str) -> LoadedStudy:
    folder.mkdir(exist_ok=True)
    (folder / "s.yaml").write_text(text, encoding="utf-8")
    return load_study(str(folder / "s.yaml"))


def test_comments_format_defaults_and_folders_change_no_hash(tmp_path: Path) -> None:
    original = load_study("nakamoto_1")
    lines = [line for line in TEXT.splitlines() if not line.startswith("#")]
    rewritten = (
        "\n".join(lines).replace("  on: film\n", "").replace("seconds: 30 ", "seconds: 30.0 ")
    )
    assert "language" not in rewritten
    again = study_of(tmp_path / "a", "# mine\n" + rewritten + "\nlanguage: en\n")
    assert again.canonical == original.canonical and again.sha256 == original.sha256
    assert len(again.sha256) == 64


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("scanpath: simple", "scanpath: markov"),
        ("seconds: 30", "seconds: 31"),
        ("participants: 9", "participants: 10"),
        ("order: random", "order: random\n  seed: 1"),
        ("also: [chi_square, rank_sum]", "also: [chi_square]"),
        ("what counts is your impression", "what counts is your impression of it"),
        ("label: face centre", "label: the face centre"),
    ],
)
def test_every_value_changes_the_hash(tmp_path: Path, old: str, new: str) -> None:
    assert old in TEXT
    changed = study_of(tmp_path, TEXT.replace(old, new))
    assert changed.sha256 != load_study("nakamoto_1").sha256


def test_a_value_of_the_rig_that_is_seen_changes_the_hash_and_a_port_does_not(
    tmp_path: Path,
) -> None:
    rig = (SHIPPED / "rigs" / "expressive.yaml").read_text(encoding="utf-8")
    text = TEXT.replace("rig: expressive", "rig: ./r.yaml")

    def sha256(params_text: str) -> str:
        (tmp_path / "r.yaml").write_text(params_text, encoding="utf-8")
        return study_of(tmp_path, text).sha256

    assert sha256(rig) == load_study("nakamoto_1").sha256
    assert sha256(PORT.sub("port: /dev/ttyUSB7", rig, 1)) == sha256(rig)
    assert sha256(rig.replace("blend_s: 0.6", "blend_s: 0.7")) != sha256(rig)


def test_films_and_the_order_of_items_are_part_of_it(tmp_path: Path) -> None:
    film = TEXT.replace("profile: nakamoto\n    scanpath: simple", "film: a.webm")
    (tmp_path / "a.webm").write_bytes(b"one")
    one = study_of(tmp_path, film).sha256
    (tmp_path / "a.webm").write_bytes(b"two")
    assert study_of(tmp_path, film).sha256 != one
    items = ["x: {low: {en: a}, high: {en: b}}", "y: {low: {en: a}, high: {en: b}}"]
    found = set()
    for order in (items, items[::-1]):
        asked = "title: t\nsource: s\nlicence: l\nitems:\n  " + "\n  ".join(order)
        (tmp_path / "q.yaml").write_text(asked)
        found.add(study_of(tmp_path, TEXT.replace("[free_text]", "[./q.yaml]")).sha256)
    assert len(found) == 2


@pytest.mark.parametrize("name", shipped_names("studies", HOME))
def test_the_canonical_text_is_json_with_everything_written_out(name: str) -> None:
    study = load_study(name)
    stated = json.loads(study.canonical)
    assert stated["design"]["order"] == list(study.design.conditions)
    assert stated["design"]["exclusion"]["repeats"] == 2
    for key in study.design.conditions:
        assert "gaze.scanpath.model" in stated["design"]["conditions"][key]["values"]
    assert set(stated["questionnaires"]) == set(study.questionnaires)
