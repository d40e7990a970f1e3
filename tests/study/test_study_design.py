"""``gazerig study design``: a study checked, stated before it begins, and what to type next."""

import json
import re
from collections import Counter
from collections.abc import Mapping
from dataclasses import replace
from itertools import combinations, permutations
from pathlib import Path

import numpy as np
import pytest
from command_line import typed
from hypothesis import given, settings
from hypothesis import strategies as st

from gazerig.config.parameters import apply_changes
from gazerig.config.schema import Rig
from gazerig.config.shipped_files import SHIPPED, shipped_names
from gazerig.drivers.errors import SetupError
from gazerig.features.lab.simulated_run import simulate
from gazerig.features.study.cli.design import EXAMPLE, design_notes, design_state
from gazerig.features.study.data_folder import StudyData
from gazerig.features.study.design import Condition, StudyDesign, Trials
from gazerig.features.study.run.study_file import LoadedStudy, load_checked_study, load_study
from gazerig.features.study.shipped import HOME
from gazerig.features.study.trial_order import (
    PAIR,
    balanced_group_size,
    block_trials,
    participant_order,
    practice_trials,
    williams,
)
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
    first = load_checked_study("study.yaml")
    StudyData(elsewhere / "study-data").claim("study", first.canonical)  # the first participant
    assert typed("study", "design") == 0
    capfd.readouterr()
    file.write_text(EXAMPLE.replace("seconds: 20", "seconds: 25"), encoding="utf-8")
    assert typed("study", "design", "--force") == 2
    said = capfd.readouterr().err
    other = load_checked_study("study.yaml").sha256
    assert first.sha256[:12] in said and other[:12] in said and "--data NEW_FOLDER" in said
    stated = (elsewhere / "study-data" / "preregistration.md").read_text(encoding="utf-8")
    assert first.sha256 in stated
    assert typed("study", "design", "--data", "second") == 0


def test_a_study_is_stated_before_somebody_takes_part(elsewhere: Path, capfd: Terminal) -> None:
    file, folder = elsewhere / "study.yaml", elsewhere / "d"
    file.write_text(EXAMPLE, encoding="utf-8")
    first = load_checked_study("study.yaml")
    design_state("study.yaml", first, folder)
    stated = (folder / "preregistration.md").read_text(encoding="utf-8")
    assert first.sha256 in stated
    design_state("study.yaml", first, folder)
    file.write_text(EXAMPLE.replace("seconds: 20", "seconds: 25"), encoding="utf-8")
    with pytest.raises(SetupError, match="gazerig study design study.yaml --force"):
        design_state("study.yaml", load_checked_study("study.yaml"), folder)
    StudyData(folder).claim("study", first.canonical)  # the first participant
    with pytest.raises(SetupError, match="begin a new study with --data"):
        design_state("study.yaml", load_checked_study("study.yaml"), folder)
    (folder / "preregistration.md").unlink()
    with pytest.raises(SetupError, match="data of another design"):
        design_state("study.yaml", load_checked_study("study.yaml"), folder)
    assert not (folder / "preregistration.md").exists()


def test_a_preregistration_states_all_that_a_reviewer_asks_for(elsewhere: Path) -> None:
    assert typed("study", "design", "default_against_papers") == 0
    text = (elsewhere / "default_against_papers-data" / "preregistration.md").read_text("utf-8")
    study = load_checked_study("default_against_papers")
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
    said = " ".join(design_notes(load_checked_study("./s.yaml")))
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
    study = load_checked_study(name)
    shown = study.design.presentation
    asked = RunOptions(
        mock=True, fast=True, bus="ideal", scene=shown.scene, seconds=6.0, rig=shown.rig
    ).check_and_complete()  # fmt: skip
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
    slower = apply_changes(rig, {"loop.rate_hz": 100.0})
    simulate(slower, asked, watch=lambda tick: found.append(tick.desired_rad))
    return found


# --- Orders of trials: each condition in each place, after each other one, as often as all others


def design_of(n: int, **trials: object) -> StudyDesign:
    conditions: Mapping[str, Condition] = {f"c{i}": Condition() for i in range(n)}
    return StudyDesign("t", conditions, ("q",), trials=Trials(**trials))  # type: ignore[arg-type]


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_williams_balances_places_and_what_comes_before(n: int) -> None:
    table = williams(n)
    assert len(table) == (n if n % 2 == 0 else 2 * n)
    places = Counter((i, one) for row in table for i, one in enumerate(row))
    assert set(places.values()) == {len(table) // n} and len(places) == n * n
    follows = Counter(pair for row in table for pair in zip(row, row[1:], strict=False))
    assert set(follows) == set(permutations(range(n), 2))
    assert set(follows.values()) == {1 if n % 2 == 0 else 2}


def test_the_squares_of_four_are_those_of_williams_construction() -> None:
    assert williams(4) == ((0, 1, 3, 2), (1, 2, 0, 3), (2, 3, 1, 0), (3, 0, 2, 1))
    assert williams(1) == ((0,),)
    with pytest.raises(ValueError, match="at least one"):
        williams(0)


@given(st.integers(2, 6), st.integers(1, 4), st.integers(0, 2**31 - 1), st.sampled_from([1, 2, 3]))
@settings(deadline=None, max_examples=60)
def test_multiples_of_the_rows_are_balanced_to_the_last_cell(
    n: int, repetitions: int, seed: int, times: int
) -> None:
    design = design_of(n, repetitions=repetitions, seed=seed)
    every = [
        participant_order(design, p) for p in range(1, times * balanced_group_size(design) + 1)
    ]
    for k in range(repetitions):
        blocks = [order[k * n : (k + 1) * n] for order in every]
        assert all(sorted(block) == sorted(design.conditions) for block in blocks)
        places = Counter((i, one) for block in blocks for i, one in enumerate(block))
        follows = Counter(p for block in blocks for p in zip(block, block[1:], strict=False))
        assert len(set(places.values())) == 1 and len(places) == n * n
        assert len(set(follows.values())) == 1 and len(follows) == n * (n - 1)


@pytest.mark.parametrize("n", [3, 4, 5, 6])
def test_no_condition_is_shown_twice_in_a_row_across_blocks(n: int) -> None:
    for order in ("williams", "random"):
        design = design_of(n, repetitions=4, order=order)
        for participant in range(1, 30):
            trials = participant_order(design, participant)
            assert all(a != b for a, b in zip(trials, trials[1:], strict=False))


@pytest.mark.parametrize("n", [2, 3, 4, 5, 6])
def test_pairs_are_seen_both_ways_round_equally_often_in_every_place(n: int) -> None:
    design = replace(design_of(n), task="pairwise")
    assert balanced_group_size(design) == n * (n - 1)
    every = [participant_order(design, p) for p in range(1, balanced_group_size(design) + 1)]
    cells = Counter((i, one) for order in every for i, one in enumerate(order))
    pairs = len(block_trials(design))
    assert len(cells) == pairs * pairs * 2 and set(cells.values()) == {1}
    for order in every:
        unordered = [frozenset(one.split(PAIR)) for one in order]
        assert len(set(unordered)) == pairs
    if n > 2:  # no participant could learn that the first is always the same
        assert all(len({one in block_trials(design) for one in order}) == 2 for order in every)


@pytest.mark.parametrize("n", [2, 3, 4])
def test_repeated_pairs_stay_balanced_and_one_pair_is_turned(n: int) -> None:
    design = replace(design_of(n, repetitions=3), task="pairwise")
    every = [participant_order(design, p) for p in range(1, balanced_group_size(design) + 1)]
    pairs = len(block_trials(design))
    for k in range(3):
        cells = Counter((i, o[k * pairs + i]) for o in every for i in range(pairs))
        assert set(cells.values()) == {1} and len(cells) == 2 * pairs * pairs
    for order in every:
        for one, two in zip(order, order[1:], strict=False):
            assert one != two and (n == 2 or set(one.split(PAIR)) != set(two.split(PAIR)))


def test_the_participant_and_the_seed_decide_and_nothing_else() -> None:
    design = design_of(5, order="random", seed=4)
    assert participant_order(design, 3) == participant_order(design, 3)
    assert len({participant_order(design, p) for p in range(1, 40)}) > 20
    assert participant_order(design_of(5, order="random", seed=5), 3) != participant_order(
        design, 3
    )
    assert balanced_group_size(design) == 1
    squares = {participant_order(design_of(4, seed=seed), 1) for seed in range(30)}
    assert len(squares) > 5, "which condition has which letter is drawn by the seed"
    with pytest.raises(ValueError, match="counted from 1"):
        participant_order(design, 0)


def test_practice_shows_what_counts_later_and_is_not_the_first_trial_for_all() -> None:
    design = design_of(3, practice=5)
    drawn = practice_trials(design, 1)
    assert len(drawn) == 5 and set(drawn) == set(design.conditions)
    assert drawn == practice_trials(design, 1)
    assert len({practice_trials(design, p)[0] for p in range(1, 20)}) == 3
    assert practice_trials(design_of(3, practice=0), 1) == ()


# --- A study's hash depends on its content only


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
    apply_changes = study_of(tmp_path, TEXT.replace(old, new))
    assert apply_changes.sha256 != load_study("nakamoto_1").sha256


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
