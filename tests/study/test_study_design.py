"""``gazerig study design``: a study checked, stated before it begins, and what to type next."""

import re
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from command_line import typed

from gazerig.config.parameters import changed
from gazerig.config.schema import Rig
from gazerig.config.shipped import shipped_names
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.simulated_run import simulate
from gazerig.features.study.cli.design import EXAMPLE, notes, state
from gazerig.features.study.data_folder import StudyData
from gazerig.features.study.run.study_check import checked_study
from gazerig.features.study.shipped import HOME
from gazerig.robot.app.assemble import with_options
from gazerig.robot.app.options import RunOptions

Terminal = pytest.CaptureFixture[str]


@pytest.fixture(autouse=True)
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_example_is_a_good_study_with_enough_participants(
    elsewhere: Path, capfd: Terminal
) -> None:
    assert typed("study", "design") == 2
    assert "there is no study.yaml here" in capfd.readouterr().err
    assert typed("study", "design", "--example", "study.yaml") == 0
    assert (elsewhere / "study.yaml").read_text(encoding="utf-8") == EXAMPLE
    assert typed("study", "design", "--example", "study.yaml") == 2
    assert "study.yaml" in capfd.readouterr().err
    assert typed("study", "design") == 0
    shown = capfd.readouterr()
    assert "study.yaml: good: 'Blinking against staring', 2 conditions" in shown.out
    assert "next: gazerig study run study.yaml --participant 1" in shown.out
    assert "too few" not in shown.out + shown.err
    assert "privacy.contact is empty" in shown.err
    assert (elsewhere / "study-data" / "preregistration.md").is_file()


def test_a_preregistration_is_kept_unless_it_is_forced(elsewhere: Path, capfd: Terminal) -> None:
    file = elsewhere / "study.yaml"
    file.write_text(EXAMPLE, encoding="utf-8")
    assert typed("study", "design", "study.yaml", "--data", "d") == 0
    stated = elsewhere / "d" / "preregistration.md"
    first = stated.read_text(encoding="utf-8")
    assert typed("study", "design", "study.yaml", "--data", "d") == 0
    assert "as it was" in capfd.readouterr().out
    file.write_text(EXAMPLE.replace("seconds: 20", "seconds: 25"), encoding="utf-8")
    assert typed("study", "design", "study.yaml", "--data", "d") == 2
    assert stated.read_text(encoding="utf-8") == first
    assert typed("study", "design", "study.yaml", "--data", "d", "--force") == 0
    again = stated.read_text(encoding="utf-8")
    hashes = [re.findall(r"`([0-9a-f]{64})`", text) for text in (first, again)]
    assert hashes[0] != hashes[1] and "25 s each" in again


def test_a_design_that_people_have_answered_is_not_stated_anew(
    elsewhere: Path, capfd: Terminal
) -> None:
    file = elsewhere / "study.yaml"
    file.write_text(EXAMPLE, encoding="utf-8")
    first = checked_study("study.yaml")
    StudyData(elsewhere / "study-data").claim("study", first.canonical)  # the first participant
    assert typed("study", "design") == 0
    capfd.readouterr()
    file.write_text(EXAMPLE.replace("seconds: 20", "seconds: 25"), encoding="utf-8")
    assert typed("study", "design", "--force") == 2
    said = capfd.readouterr().err
    other = checked_study("study.yaml").sha256
    assert first.sha256[:12] in said and other[:12] in said and "--data NEW_FOLDER" in said
    stated = (elsewhere / "study-data" / "preregistration.md").read_text(encoding="utf-8")
    assert first.sha256 in stated
    assert typed("study", "design", "--data", "second") == 0


def test_a_study_is_stated_before_somebody_takes_part(elsewhere: Path, capfd: Terminal) -> None:
    file, folder = elsewhere / "study.yaml", elsewhere / "d"
    file.write_text(EXAMPLE, encoding="utf-8")
    first = checked_study("study.yaml")
    state("study.yaml", first, folder)
    stated = (folder / "preregistration.md").read_text(encoding="utf-8")
    assert first.sha256 in stated
    state("study.yaml", first, folder)
    file.write_text(EXAMPLE.replace("seconds: 20", "seconds: 25"), encoding="utf-8")
    with pytest.raises(SetupError, match="gazerig study design study.yaml --force"):
        state("study.yaml", checked_study("study.yaml"), folder)
    StudyData(folder).claim("study", first.canonical)  # the first participant
    with pytest.raises(SetupError, match="begin a new study with --data"):
        state("study.yaml", checked_study("study.yaml"), folder)
    (folder / "preregistration.md").unlink()
    with pytest.raises(SetupError, match="data of another design"):
        state("study.yaml", checked_study("study.yaml"), folder)
    assert not (folder / "preregistration.md").exists()


def test_a_preregistration_states_all_that_a_reviewer_asks_for(elsewhere: Path) -> None:
    assert typed("study", "design", "default_against_papers") == 0
    text = (elsewhere / "default_against_papers-data" / "preregistration.md").read_text("utf-8")
    study = checked_study("default_against_papers")
    assert study.sha256 in text
    for heading in (
        *("Hypotheses", "Conditions", "Design", "Measures", "Analysis", "Sample size"),
        *("Exclusions", "Data protection", "What participants read"),
    ):
        assert f"\n## {heading}\n" in text
    assert text.count("| participant | order |") == 1 and "| 6 | " in text and "| 7 | " not in text
    for asked in study.questionnaires.values():
        assert asked.source.rstrip(".") in text and asked.licence.rstrip(".") in text
        assert all(f"| `{key}` |" in text for key in asked.items)
    for one in study.design.hypotheses:
        assert f"`{one.measure}` is higher for `{one.better}` than for `{one.than}`" in text
    assert "alpha = 0.05, over the 4 hypotheses by Holm's procedure" in text
    assert re.search(r"power 0\.8 takes \d+ participants", text)
    tables = [line for line in text.splitlines() if line.startswith("|")]
    assert all(line.endswith("|") for line in tables)
    assert "{{" not in text and "\n\n\n" not in text


@pytest.mark.parametrize("name", shipped_names("studies", HOME))
def test_every_shipped_study_can_be_stated(name: str, elsewhere: Path, capfd: Terminal) -> None:
    assert typed("study", "design", name) == 0
    shown = capfd.readouterr()
    few = "participants are too few" in shown.err
    assert few == (name in ("nakamoto_1", "nakamoto_2")), "the papers' numbers alone are too few"
    assert (elsewhere / f"{name}-data" / "preregistration.md").stat().st_size > 3000


def test_faults_are_all_said_at_once_and_nothing_is_written(
    elsewhere: Path, capfd: Terminal
) -> None:
    text = EXAMPLE.replace("better: blinks", "better: blink").replace("26", "25")
    (elsewhere / "study.yaml").write_text(text, encoding="utf-8")
    assert typed("study", "design") == 2
    said = capfd.readouterr().err.strip().splitlines()
    assert len(said) == 2 and all(one.startswith("study.yaml:") for one in said)
    assert "hypotheses.0.better: no condition 'blink'" in "".join(said)
    assert [one.name for one in elsewhere.iterdir()] == ["study.yaml"]
    assert typed("study", "design", "nakamoto_3") == 2
    assert "did you mean 'nakamoto_" in capfd.readouterr().err


def test_what_is_allowed_and_should_be_known_is_said(elsewhere: Path) -> None:
    text = EXAMPLE.replace("[nakamoto_tsuruno]", "[nakamoto_tsuruno, godspeed]")
    text = text[: text.index("hypotheses")] + "privacy: {pictures: true}\nlanguage: ja\n"
    (elsewhere / "s.yaml").write_text(text + "plan: {participants: 2}\n", encoding="utf-8")
    said = " ".join(notes(checked_study("./s.yaml")))
    assert "exploratory" in said and "pictures of participants are kept" in said
    assert "godspeed is not all in 'ja'" in said and "nakamoto_tsuruno is not" not in said
    assert "privacy.contact is empty" in said


def test_pairs_are_stated_as_pairs(elsewhere: Path, capfd: Terminal) -> None:
    text = EXAMPLE.replace("[nakamoto_tsuruno]", "[choice]")
    text = text.replace("nakamoto_tsuruno.naturalness", "choice.alive")
    text = text.replace("    than: stares", "    than: stares\n    test: sign")
    text = text.replace("title:", "task: pairwise\ntitle:").replace("26", "40")
    (elsewhere / "s.yaml").write_text(text, encoding="utf-8")
    assert typed("study", "design", "s.yaml") == 0
    assert "too few" not in capfd.readouterr().err
    stated = (elsewhere / "s-data" / "preregistration.md").read_text(encoding="utf-8")
    assert "each of the 1 pairs" not in stated
    assert "blinks then stares" in stated and "stares then blinks" in stated
    assert "the first or the second" in stated and "by the normal approximation" in stated


@pytest.mark.parametrize("name", shipped_names("studies", HOME))
def test_the_conditions_of_shipped_studies_move_the_head_differently(name: str) -> None:
    study = checked_study(name)
    shown = study.design.presentation
    asked = RunOptions(
        mock=True, fast=True, bus="ideal", scene=shown.scene, seconds=6.0, rig=shown.rig
    ).checked()  # fmt: skip
    moved = {
        key: np.degrees(_desired(with_options(rig, asked), asked))
        for key, rig in study.rigs.items()
    }
    for one, two in combinations(moved, 2):
        apart = np.sqrt(np.mean((moved[one] - moved[two]) ** 2, axis=0)).max()
        assert apart > 1.0, f"{one} and {two}: {apart:.2f} deg at the joint that differs most"


def _desired(rig: Rig, asked: RunOptions) -> list[tuple[float, ...]]:
    """Return the joint angles that every tick of a run wanted."""
    found: list[tuple[float, ...]] = []
    slower = changed(rig, {"loop.rate_hz": 100.0})
    simulate(slower, asked, watch=lambda tick: found.append(tick.desired_rad))
    return found
