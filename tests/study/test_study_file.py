"""Studies and questionnaires are read and checked as rigs are: file, line, key, rule and cure."""

import json
import re
from contextlib import suppress
from copy import deepcopy
from pathlib import Path
from textwrap import dedent, indent
from typing import Any

import pytest
from command_line import typed
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from outside_package import install, on_path
from recorded_run import record
from ruamel.yaml import YAML

from gazerig.config.faults import ConfigError
from gazerig.config.shipped_files import shipped_names
from gazerig.features.study.pages.study_files import FOLDER
from gazerig.features.study.run.study_file import load_checked_study, load_questionnaire, load_study
from gazerig.features.study.shipped import HOME
from gazerig.gaze.attention.top_down import PLANNED

HEAD = "title: t\nquestionnaires: [nakamoto_tsuruno]\n"
TWO = """\
conditions:
  a: {}
  b:
    profile: nakamoto
plan: {participants: 24}
"""


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """Return half a second of the rig desk."""
    path = tmp_path_factory.mktemp("recorded") / "run.mcap"
    record(path, 0.5)
    return path.read_bytes()


def faults(tmp_path: Path, text: str, name: str = "s.yaml") -> list[str]:
    file = tmp_path / name
    file.write_text(text, encoding="utf-8")
    with pytest.raises(ConfigError) as raised:
        load_checked_study(str(file))
    assert all(fault.file == str(file) for fault in raised.value.faults)
    return [str(fault).removeprefix(f"{file}:") for fault in raised.value.faults]


def conditions(text: str, more: str = "") -> str:
    return f"{HEAD}conditions:\n{indent(dedent(text).strip(), '  ')}\n{more}"


@pytest.mark.parametrize("name", shipped_names("studies", HOME))
def test_every_shipped_study_is_good_and_its_conditions_differ(name: str) -> None:
    study = load_checked_study(name)
    keys = list(study.design.conditions)
    assert study.name == name and set(study.rigs) == set(keys) and study.text
    for i, before in enumerate(keys):
        for after in keys[:i]:
            assert study.changes(before, after), f"{before} and {after} are the same"
    assert set(study.questionnaires) == {*study.design.questionnaires, *study.design.after}


@pytest.mark.parametrize("name", shipped_names("studies", HOME))
def test_what_participants_read_before_names_no_condition(name: str) -> None:
    design = load_checked_study(name).design
    assert design.welcome and design.debriefing and design.hypotheses
    assert set(design.translations) == {"de", "ja"}
    every = (design.welcome, *(texts.welcome for texts in design.translations.values()))
    said = " ".join(line for lines in every for line in lines).lower()
    for key, one in design.conditions.items():
        names = (key, one.profile, one.character, one.scanpath, one.label)
        for name in {*filter(None, names)} - {"robot"}:  # the usual name
            assert name.replace("_", " ") not in said, f"{name} is told before"


def test_the_shipped_studies_are_those_of_the_papers_and_of_the_program() -> None:
    assert shipped_names("studies", HOME) == (
        *("boxing", "default_against_papers", "nakamoto_1", "nakamoto_2"),
    )
    assert load_study("nakamoto_1").changes("simple", "face_tracking") == {
        "gaze.scanpath.model": "face_tracking"
    }
    assert load_study("nakamoto_2").changes(None, "random")["gaze.scanpath.model"] == "random"


@pytest.mark.parametrize(
    ("name", "items", "scales"), [("godspeed", 24, [5, 6, 5, 5, 3]), ("rosas", 18, [6, 6, 6])]
)
def test_published_questionnaires_have_their_items_and_scales(
    name: str, items: int, scales: list[int]
) -> None:
    asked = load_questionnaire(name)
    found = [item.scale for item in asked.items.values()]
    assert len(found) == items
    assert [found.count(scale) for scale in dict.fromkeys(found)] == scales
    assert {item.points for item in asked.items.values()} == {5 if name == "godspeed" else 9}
    assert [key for key, item in asked.items.items() if item.reverse] == (
        ["surprised"] if name == "godspeed" else []
    )


@pytest.mark.parametrize("name", shipped_names("questionnaires", HOME))
def test_every_shipped_questionnaire_names_source_and_licence(name: str) -> None:
    asked = load_questionnaire(name)
    assert asked.source and asked.licence and asked.items
    if asked.licence.startswith("Apache-2.0"):  # ours: in all languages of the pages
        for item in asked.items.values():
            for texts in (item.text, item.low, item.high):
                assert not texts or set(texts) == {"en", "ja", "de"}


def test_a_design_that_is_right_has_the_rig_of_each_condition(tmp_path: Path) -> None:
    (tmp_path / "q").mkdir()
    (tmp_path / "q/mine.yaml").write_text(
        "title: m\nsource: s\nlicence: l\nitems:\n  x: {low: {en: a}, high: {en: b}}\n"
    )
    (tmp_path / "calm.yaml").write_text("gaze: {lids: {blinks_per_min: 3.0}}\n")
    file = tmp_path / "s.yaml"
    file.write_text(
        conditions(
            """
            a: {}
            b: {character: ./calm.yaml}
            c: {params: {gaze.lids.blinks_per_min: 4.0}, scanpath: simple}
            d: {params: {gaze: {lids: {blinks_per_min: 5.0}}}, behaviour: guard}
            """,
            "plan: {participants: 24}\nhypotheses: [{measure: mine.x, better: a, than: b}]\n",
        ).replace("[nakamoto_tsuruno]", "[./q/mine.yaml]")
    )
    study = load_study(str(file))
    assert study.design.questionnaires == ("mine",) and study.questionnaires["mine"].title == "m"
    assert study.changes(None, "a") == {} and study.changes("b", "a") != {}
    assert study.changes("a", "b") == {"gaze.lids.blinks_per_min": 3.0}
    assert study.changes("a", "c") == {
        "gaze.scanpath.model": "simple", "gaze.lids.blinks_per_min": 4.0
    }  # fmt: skip
    assert study.rigs["d"].gaze.top_down.behaviour == "guard"


def test_conditions_that_cannot_be_told_apart_are_refused_and_both_named(tmp_path: Path) -> None:
    own = "{params: {gaze.scanpath.model: markov}, profile: robot}"  # what every rig has
    plan = "plan: {participants: 24}\n"
    (said,) = faults(tmp_path, conditions(f"a: {{}}\nb: {own}\nc: {{profile: mitake}}", plan))
    assert said.startswith("5: conditions.b: cannot be told apart from 'a': both show the same")
    (said,) = faults(tmp_path, conditions("a: {behaviour: wait}\nb: {}", plan))
    assert "conditions.b: cannot be told apart from 'a'" in said


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("a: {}", ["3: conditions: 1 of them"]),
        ("a: {}\nb: {profile: nakamotto}", ["5: conditions.b.profile", "did you mean 'nakamoto'"]),
        ("a: {}\nb: {character: bolt}", ["5: conditions.b.character", "did you mean 'bold'"]),
        ("a: {}\nb: {rig: dusk}", ["5: conditions.b.rig", "did you mean 'desk'"]),
        ("a: {}\nb: {scanpath: marcov}", ["5: conditions.b.scanpath", "did you mean 'markov'"]),
        ("a: {}\nb: {behaviour: hide}", ["5: conditions.b.behaviour", "'hide' has no rule"]),
        ("a: {}\nb: {profil: mitake}", ["5: conditions.b.profil", "did you mean 'profile'"]),
        (
            "a: {}\nb:\n  params:\n    gaze.lids.blinks_per_mim: 3.0",
            ["7: conditions.b.params.gaze.lids.blinks_per_mim", "did you mean 'blinks_per_min'"],
        ),
        (
            "a: {}\nb:\n  params:\n    gaze.lids.blinks_per_min: 300.0",
            ["7: conditions.b.params.gaze.lids.blinks_per_min: 300.0 is above 60"],
        ),
        (
            "a: {}\nb:\n  profile: mitake\n  film: no.webm",
            ["6: conditions.b.profile: has no effect beside film", "7: conditions.b.film: there is"],
        ),
        (f"a: {{}}\nb: {{recording: {'a' * 300}.mcap}}", ["5: conditions.b.recording: there is no"]),
        ("a: {}\nb: {recording: run.mp4}", ["5: conditions.b.recording", "end in .mcap"]),
        ("a: {}\nB!: {profile: mitake}", ["5: conditions.B!: no name of a condition"]),
        (
            "a: {factors: {gaze: x}}\nb: {profile: mitake, factors: {gaze: x, lids: y}}",
            ["conditions.a.factors: has no level of 'lids'", "factors.gaze: has one level only"],
        ),
    ],
)  # fmt: skip
def test_faults_of_conditions_name_line_key_and_cure(
    tmp_path: Path, text: str, wanted: list[str]
) -> None:
    said = "\n".join(faults(tmp_path, conditions(text, "plan: {participants: 24}\n")))
    for words in wanted:
        assert words in said, said


@pytest.mark.parametrize(
    ("more", "wanted"),
    [
        ("presentation: {scene: visitors}", "8: presentation.scene: no scene 'visitors'; did you"),
        ("presentation: {world: boxin}", "8: presentation.world: no world 'boxin'"),
        ("presentation: {rig: dusk}", "8: presentation.rig: nothing named 'dusk' is shipped; did"),
        (
            "presentation: {scene: visitor, world: boxing}",
            "8: presentation.world: there is a scene",
        ),
        ("after: [choice]", "8: after.0: 'choice' asks for a choice between two: task: pairwise"),
        ("after: [nakamoto_tsuruno]", "8: after.0: 'nakamoto_tsuruno' is asked already"),
        ("after: [godsped]", "8: after.0: nothing named 'godsped' is shipped; did you mean"),
        ("task: pairwise", "2: questionnaires: task pairwise needs one with a choice"),
        ("objective: [first_look_s]", "8: objective.0: is measured by the head in the room"),
        (
            "translations: {fr: {welcome: [Bonjour.]}}",
            "8: translations.fr: no language of the pages: en, ja, de",
        ),
        (
            "welcome: [Hello.]\ndebriefing: [Bye.]\ntranslations:\n  de: {welcome: [Hallo.]}",
            "11: translations.de.debriefing: is missing, and the study has one",
        ),
        ("language: fr", "8: language: 'fr' is not one of 'en', 'ja', 'de'"),
        (
            "presentation: {on: head}\nobjective: [mutual, mutal]",
            "9: objective.1: no measure 'mutal'; there is mutual_gaze_share",
        ),
        (
            "presentation: {on: head}\nprivacy: {gaze: false}\nobjective: [first_look_s]",
            "10: objective.0: needs privacy.gaze: true",
        ),
    ],
)
def test_faults_of_a_design_name_line_key_and_cure(tmp_path: Path, more: str, wanted: str) -> None:
    said = faults(tmp_path, f"{HEAD}{TWO}{more}\n")
    assert any(one.startswith(wanted) for one in said), said


def test_a_world_is_any_surroundings_that_there_are(tmp_path: Path) -> None:
    install(tmp_path, "hall", {"gazerig.surroundings": {"hall": "hall:Hall"}}, {})
    (tmp_path / "s.yaml").write_text(f"{HEAD}{TWO}presentation: {{world: hall}}\n")
    with on_path(tmp_path):
        assert load_checked_study(str(tmp_path / "s.yaml")).design.presentation.world == "hall"
        said = faults(tmp_path, f"{HEAD}{TWO}presentation: {{world: hal}}\n")
    assert any("no world 'hal'; did you mean 'hall'?" in one for one in said), said


@pytest.mark.parametrize(
    ("hypothesis", "wanted"),
    [
        ("{measure: nakamoto_tsuruno.warmth, better: a, than: b}", "measure: nothing asks or"),
        ("{measure: nakamoto_tsuruno.looked_at, better: a, than: c}", "than: no condition 'c'"),
        ("{measure: nakamoto_tsuruno.looked_at, better: a, than: a}", "than: is the condition"),
        (
            "{measure: nakamoto_tsuruno.looked_at, better: a, than: b, test: friedman}",
            "test: friedman tests whether any of all conditions differ, so it cannot decide on these "
            "two: write test: signed_rank, and also: [friedman]",
        ),
        (
            "{measure: nakamoto_tsuruno.looked_at, better: a, than: b, test: sign}",
            "test: sign cannot decide on a rating; for example signed_rank can",
        ),
        (
            "{measure: nakamoto_tsuruno.looked_at, better: a, than: b, also: [signed_rank]}",
            "also.0: signed_rank stands already",
        ),
        (
            "{measure: rosas.warmth, better: a, than: b, also: [chi_square]}",
            "also.0: chi_square counts the answers to one item; for the mean of a scale",
        ),
        ("{measure: godspeed.alive, better: a, than: b}", "measure: is asked once at the end"),
    ],
)
def test_hypotheses_that_cannot_be_tested_are_refused(
    tmp_path: Path, hypothesis: str, wanted: str
) -> None:
    text = f"{HEAD}{TWO}after: [godspeed]\nhypotheses:\n  - {hypothesis}\n"
    said = faults(tmp_path, text.replace("[nakamoto_tsuruno]", "[nakamoto_tsuruno, rosas]"))
    assert said[0].startswith(f"10: hypotheses.0.{wanted}"), said
    assert len(said) == 1


@pytest.mark.parametrize(
    ("count", "participants", "wanted"),
    [
        (2, 7, "7 is no multiple of the 2 orders of Williams' squares: take 6 or 8"),
        (3, 4, "4 is too few for the 6 orders of Williams' squares: take 6 or 12"),
        (4, 30, "30 is no multiple of the 4 orders of Williams' squares: take 28 or 32"),
        (5, 9, "9 is too few for the 10 orders"),
    ],
)
def test_participants_that_leave_the_squares_unbalanced_are_refused(
    tmp_path: Path, count: int, participants: int, wanted: str
) -> None:
    text = "\n".join(f"c{i}: {{params: {{gaze.lids.blinks_per_min: {i + 1}.0}}}}" for i in range(count))  # fmt: skip
    plan = f"plan: {{participants: {participants}}}\n"
    said = faults(tmp_path, conditions(text, plan))
    assert len(said) == 1 and f"plan.participants: {wanted}" in said[0]
    good = tmp_path / "good.yaml"
    good.write_text(conditions(text, plan + "trials: {order: random}\n"))
    assert load_study(str(good)).design.plan.participants == participants


def test_what_a_running_head_cannot_take_needs_a_rig_of_its_own_or_films(tmp_path: Path) -> None:
    start = "a: {}\nb: {params: {joints.neck_yaw.id: 40}}"
    head = "plan: {participants: 2}\npresentation: {on: head}\n"
    (said,) = faults(tmp_path, conditions(start, head))
    assert "5: conditions.b.params.joints.neck_yaw.id: " in said
    assert "cannot change while the head runs" in said and "presentation.on: film" in said
    film = tmp_path / "film.yaml"
    film.write_text(conditions(start, "plan: {participants: 2}\n"))
    assert load_study(str(film)).rigs["b"].joints["neck_yaw"].id == 40
    rig = tmp_path / "rig.yaml"
    rig.write_text(conditions("a: {}\nb: {rig: nine_xl330}", head))
    assert len(load_study(str(rig)).rigs["b"].joints) == 9


def test_the_planner_is_a_behaviour_where_it_is_on(tmp_path: Path) -> None:
    file = tmp_path / "s.yaml"
    on = "params: {gaze.top_down.planner.enabled: true}"
    file.write_text(
        conditions(
            f"a: {{behaviour: {PLANNED}, {on}}}\nb: {{behaviour: guard, {on}}}",
            "plan: {participants: 2}\n",
        )
    )
    assert load_study(str(file)).design.conditions["a"].behaviour == PLANNED


def test_a_recording_must_be_of_the_rig_and_as_long_as_a_trial(
    tmp_path: Path, recording: bytes
) -> None:
    (tmp_path / "run.mcap").write_bytes(recording)
    (tmp_path / "torn.mcap").write_bytes(recording[:200])
    (tmp_path / "none.mcap").write_bytes(b"nothing")
    text = conditions(
        "a: {recording: run.mcap}\nb: {recording: torn.mcap}\nc: {recording: none.mcap}",
        "plan: {participants: 6}\npresentation: {rig: desk}\n",
    )
    said = faults(tmp_path, text)
    assert len(said) == 3, said
    assert "4: conditions.a.recording: lasts 0." in said[0] and "a trial 30 s" in said[0]
    assert "5: conditions.b.recording: " in said[1] and "is empty: it contains nothing" in said[1]
    assert "6: conditions.c.recording: " in said[2]
    (one,) = faults(
        tmp_path,
        conditions(
            "a: {recording: run.mcap}\nb: {}",
            "plan: {participants: 6}\ntrials: {seconds: 2}\npresentation: {rig: expressive}\n",
        ),
    )[:1]
    assert (
        "with other joints (" in one and "jaw, left_brow" in one and "record with this one" in one
    )


def test_editors_get_a_schema_of_studies_and_questionnaires(
    capfd: pytest.CaptureFixture[str],
) -> None:
    schemas = {}
    for kind in ("study", "questionnaire"):
        assert typed("schema", "--of", kind) == 0
        schemas[kind] = json.loads(capfd.readouterr().out)
    design, asked = schemas["study"], schemas["questionnaire"]
    assert design["required"] == ["title", "conditions", "questionnaires"]
    assert design["properties"]["language"]["enum"] == ["en", "ja", "de"]
    condition = design["$defs"]["Condition"]["properties"]
    assert condition["params"]["additionalProperties"] in (True, {})  # any value of a rig's key
    assert asked["$defs"]["Item"]["properties"]["points"]["maximum"] == 11


QUESTIONNAIRE = "title: t\nsource: s\nlicence: l\nitems:\n  x: "


@pytest.mark.parametrize(
    ("item", "wanted"),
    [
        ("{}", "5: items.x.low: a rating needs the words at both ends"),
        ("{kind: choice}", "5: items.x.text: is missing"),
        ("{low: {en: a}, high: {en: b}, points: 1}", "5: items.x.points: 1 is below 2"),
        ("{low: {ja: a}, high: {en: b}}", "5: items.x.low: has no en"),
        ("{low: {en: a}, high: {fr: b, en: b}}", "5: items.x.high.fr: no language of the pages"),
        ("{kind: text, text: {en: t}, scale: y}", "5: items.x.scale: belongs to ratings"),
        ("{low: {en: a}, high: {en: b}, scale: x}", "5: items.x.scale: is an item's key as well"),
    ],
)
def test_faults_of_a_questionnaire_name_line_key_and_cure(
    tmp_path: Path, item: str, wanted: str
) -> None:
    file = tmp_path / "q.yaml"
    file.write_text(f"{QUESTIONNAIRE}{item}\n")
    with pytest.raises(ConfigError) as raised:
        load_questionnaire(str(file))
    said = [str(one).removeprefix(f"{file}:") for one in raised.value.faults]
    assert any(one.startswith(wanted) for one in said), said


def test_a_fault_in_a_questionnaire_is_told_where_the_study_names_it(tmp_path: Path) -> None:
    (tmp_path / "q.yaml").write_text(f"{QUESTIONNAIRE}{{}}\n")
    said = faults(tmp_path, (HEAD + TWO).replace("[nakamoto_tsuruno]", "[./q.yaml]"))
    assert said[0].startswith("2: questionnaires.0: ") and "q.yaml:5: items.x.low" in said[0]


@pytest.mark.parametrize("shown", ["film: a.webm", "recording: a.mcap"])
def test_what_takes_the_head_s_place_needs_films(shown: str, tmp_path: Path) -> None:
    text = conditions(f"a: {{}}\nb: {{{shown}}}", "presentation: {on: head}\n")
    said = faults(tmp_path, text)
    assert any("the head itself is shown; write presentation.on: film" in one for one in said)


# --- Every mistake in a study's file is reported with file and line


WRONG: tuple[object, ...] = (
    *(
        None,
        0,
        -1,
        1e30,
        float("nan"),
        True,
        "",
        "a|b",
        "../x.yaml",
        "x.webm",
        ".mcap",
        "~",
        "wait",
    ),
    *("film", "head", "pairwise", "choice", "friedman", [], {}, [[]], {"a": {}}, ["rosas"]),
    *(
        {"gaze": 3},
        {"gaze.top_down.rules": {}},
        {"joints.neck_yaw": None},
        {"": 1},
        "x" * 300,
        "=",
        "gaze=x",
    ),
)
"""What may stand anywhere in a file by mistake."""
DESIGN = YAML(typ="safe").load((HOME / "studies" / "nakamoto_2.yaml").read_text("utf-8"))
PLACES = (
    *(("title",), ("task",), ("welcome",), ("conditions",), ("conditions", "simple"), ("plan",)),
    *(("translations",), ("translations", "de"), ("translations", "ja", "welcome")),
    *(("conditions", "random", key) for key in ("params", "recording", "film", "factors", "rig")),
    *(("conditions", "random", key) for key in ("profile", "scanpath", "behaviour", "label")),
    *(("presentation", key) for key in ("on", "rig", "scene", "world")),
    *(("trials", key) for key in ("seconds", "order", "repetitions")),
    *(("questionnaires",), ("after",), ("objective",), ("plan", "participants")),
    *(("hypotheses",), ("hypotheses", 0, "measure"), ("hypotheses", 1, "than")),
    ("hypotheses", 0, "better"),
    *(("hypotheses", 0, "test"), ("hypotheses", 0, "also"), ("privacy",), ("nonsense",)),
)


@given(st.lists(st.tuples(st.sampled_from(PLACES), st.sampled_from(WRONG)), min_size=1, max_size=3))
@settings(
    deadline=None, max_examples=30, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
def test_whatever_stands_in_a_study_is_right_or_told_with_file_and_line(
    tmp_path: Path, changes: list[tuple[tuple[str | int, ...], object]]
) -> None:
    design = deepcopy(DESIGN)
    for (*over, last), value in changes:
        # Where an earlier change has taken the place away, there is nothing to spoil.
        with suppress(LookupError, TypeError):
            held: Any = design
            for step in over:
                held = held[step]
            held[last] = deepcopy(value)
    file = tmp_path / "s.yaml"
    with file.open("w", encoding="utf-8") as out:
        YAML(typ="safe").dump(design, out)
    try:
        assert len(load_checked_study(str(file)).sha256) == 64
    except ConfigError as error:
        assert all(fault.file == str(file) and fault.line for fault in error.faults)


# --- The texts of a study's pages: in every language, and each of them used


def test_every_text_is_there_in_every_language_with_the_same_places() -> None:
    texts = json.loads((FOLDER / "texts.json").read_text(encoding="utf-8"))
    assert set(texts) == {"en", "ja", "de"}
    places = {
        language: {key: sorted(re.findall(r"\{\w+\}", text)) for key, text in said.items()}
        for language, said in texts.items()
    }
    assert places["ja"] == places["en"] == places["de"]
    assert all(text.strip() for said in texts.values() for text in said.values())


def test_the_scripts_say_texts_that_are_there_and_no_text_is_left_over() -> None:
    texts = json.loads((FOLDER / "texts.json").read_text(encoding="utf-8"))["en"]
    scripts = "".join(path.read_text(encoding="utf-8") for path in FOLDER.glob("*.js"))
    asked = set(re.findall(r'(?:say|button|tell)\("([\w.]+)"', scripts))
    assert asked <= set(texts)
    patterns = [re.escape(one) for one in re.findall(r'"([\w.]+)"', scripts)]
    patterns += [
        re.sub(r"\\\$\\\{.*?\\\}", r"\\w*", re.escape(one))
        for one in re.findall(r"`([\w.]+\$\{[^`]*)`", scripts)
    ]
    left = {key for key in texts if not any(re.fullmatch(one, key) for one in patterns)}
    assert not left
