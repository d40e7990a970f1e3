"""Tests of a study's report: the content of its sentences, page and tables."""

import csv
import json
import random
import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from io import StringIO
from math import nan
from pathlib import Path

import pytest
from study_records import QUESTIONS, UTC, design, pairs, records

from gazerig.drivers.errors import SetupError
from gazerig.features.study.analysis import (
    StudyAnalysis,
    analyse_study,
    within_participant_half_widths,
)
from gazerig.features.study.cli.analyse import verdicts
from gazerig.features.study.data_folder import StudyData, participant_code
from gazerig.features.study.design import Condition, Exclusion, Hypothesis, StudyDesign, Trials
from gazerig.features.study.journal import (
    FILE,
    STEP_DEG,
    ItemAnswered,
    Journal,
    ParticipationOpened,
    Record,
    TrialBegan,
    TrialEnded,
)
from gazerig.features.study.participation import collect_study, participation
from gazerig.features.study.preregistration import canonical
from gazerig.features.study.report import apa, figures
from gazerig.features.study.report.page import banners, study_page
from gazerig.features.study.report.report import add_interim_looks, write_report
from gazerig.features.study.report.tables import (
    ANSWERS,
    answers_csv,
    r_script,
    results_json,
    trials_csv,
)
from gazerig.features.study.simulation import Population
from gazerig.features.study.statistics.effects import EffectSize, StatisticalTest

SHA = "ab" * 32


def study(
    of: StudyDesign | None = None, count: int = 12, population: Population | None = None
) -> StudyAnalysis:
    of = of or design(participants=12)
    people = [
        participation(records(of, k, population or Population(1.0)), of, QUESTIONS)
        for k in range(1, count + 1)
    ]
    return analyse_study("mine", of, QUESTIONS, SHA, people)


def text_of(page: str) -> str:
    """Return the words of a page without its tags."""
    spaced = re.sub(r"</(td|dd|p|h\d)>", " ", page)
    return " ".join(unescape(re.sub(r"<[^>]*>", "", spaced)).split())


def page_of(one: StudyAnalysis) -> str:
    return study_page(one, "gazerig 0.1.0", lambda _, __: None)


@pytest.fixture(scope="module")
def ratings() -> StudyAnalysis:
    return study()


@pytest.fixture(scope="module")
def page(ratings: StudyAnalysis) -> str:
    return page_of(ratings)


@pytest.mark.parametrize(
    ("p", "says"),
    [(0.0131, "p = .013"), (0.0004, "p < .001"), (1.0, "p = 1.000"), (0.9996, "p = 1.000"),
     (nan, "p not known")],
)  # fmt: skip
def test_chances_are_written_as_the_apa_wants(p: float, says: str) -> None:
    assert unescape(re.sub("<[^>]*>", "", apa.p_text(p))) == says


@pytest.mark.parametrize(
    ("value", "says"),
    [(0.618, ".62"), (-0.618, "\N{MINUS SIGN}.62"), (1.0, "1.00"), (-0.001, ".00")],
)
def test_what_cannot_exceed_one_has_no_zero_before_the_point(value: float, says: str) -> None:
    assert apa.bounded_text(value) == says


def test_effects_are_written_with_their_interval() -> None:
    dz = EffectSize("Cohen's d_z", "d_z", 0.62, -0.04, 1.2, "BCa bootstrap", bounded=False)
    assert apa.effect_text(dz) == ("<i>d</i><sub>z</sub> = 0.62, 95% CI [\N{MINUS SIGN}0.04, 1.20]")
    assert apa.effect_text(dz._replace(low95=nan)) == "<i>d</i><sub>z</sub> = 0.62"
    assert apa.effect_text(dz._replace(value=nan)) == ""


def test_a_chi_square_has_its_degrees_of_freedom_and_its_answers() -> None:
    nothing = EffectSize("V", "V", 0.3, nan, nan, "none")
    found = StatisticalTest("chi_square", "χ²", 9.2, 4.0, 0.05, nan, 0.001, 48, nothing)
    assert re.sub("<[^>]*>", "", apa.statistic_text(found)) == "χ²(4, N = 48) = 9.20"


def test_the_sentence_says_who_was_above_and_by_which_figures(ratings: StudyAnalysis) -> None:
    one = ratings.decisions[0]
    assert one.test is not None and one.verdict == "supported"
    said = unescape(re.sub("<[^>]*>", "", apa.result_sentence(one, ratings)))
    assert re.fullmatch(
        r"The walk \(Mdn = [\d.]+\) was above the centre \(Mdn = [\d.]+\) in naturalness "
        r"\(Wilcoxon signed-rank test\), T = [\d.]+, p [=<] \.\d{3} \(exact\), "
        r"(Holm-corrected p [=<] \.\d{3}, )?r = [.\d]+(, 95% CI \[.+?\])?, "
        r"dz = [\d.]+, 95% CI \[[\d.]+, [\d.]+\], n = 12\.",
        said,
    )


def test_names_of_conditions_cannot_write_html() -> None:
    evil = replace(
        design(), conditions={"walk": Condition("<script>1</script>"), "centre": Condition("b")}
    )
    found = page_of(study(evil, 6))
    assert "<script>1" not in found and "&lt;script&gt;1" in found


def test_the_page_needs_no_other_file_and_closes_what_it_opens(page: str) -> None:
    assert not re.search(r'(src|href)="(?!data:)', page) and "http" not in page
    opened: list[str] = []

    class Tags(HTMLParser):
        def handle_starttag(self, tag: str, attrs: object) -> None:
            if tag not in ("meta", "img", "br"):
                opened.append(tag)

        def handle_endtag(self, tag: str) -> None:
            assert opened.pop() == tag

    Tags().feed(page)
    assert not opened


def test_the_page_says_what_a_reviewer_asks(page: str, ratings: StudyAnalysis) -> None:
    said = text_of(page)
    for words in (
        "Simulated participants: nobody answered", f"{SHA}; all 12 participants carry it",
        "12 came, 12 count, 12 were planned", "chi-square test of the counts",
        "Wilcoxon rank-sum test", "expected counts are below 5: use the exact chance",
        "differences are symmetric", "No participant is left out",
        "pages answered in less than 300 ms", "corrected (holm)", "“Natural?”",
        "1 = not at all, 5 = very much", "the order of the conditions does not matter",
    ):  # fmt: skip
        assert words in said, words
    assert page.count("data:image/png") == 5  # effects; of each item counts and participants


@pytest.mark.usefixtures("unlaid_figures")
def test_too_few_are_said_first() -> None:
    small = study(design(), 4)
    assert any(
        words.startswith("Too few: 4 of the 24 participants who were planned came, 4 count")
        for words in banners(small)
    )
    said = text_of(page_of(small))
    assert "Too few: with n = 4 nothing can be said of whether the walk exceeds" in said


@pytest.mark.usefixtures("unlaid_figures")
def test_who_is_left_out_is_listed_with_the_reason() -> None:
    four = replace(design(participants=4), trials=Trials(repetitions=2))
    careless = study(four, 3, Population(1.0, careless=1.0))
    said = text_of(page_of(careless))
    assert "P002 gave one answer to every item of all trials" in said
    assert "3 came, 0 count" in said


@pytest.mark.usefixtures("unlaid_figures")
def test_exclusions_and_switches_are_told() -> None:
    whole = study()
    lost = replace(whole.people[0], left_out="did not finish")
    step = replace(whole.people[1].trials[0], measured={STEP_DEG: 0.125})
    moved = replace(whole.people[1], trials=(step, *whole.people[1].trials[1:]))
    one = replace(whole, people=(lost, moved, *whole.people[2:]), deleted=2)
    assert any(words.startswith("11 of the 12 participants who were") for words in banners(one))
    said = text_of(page_of(one))
    assert "largest step of a commanded joint 0.12 deg in a tick, 1 switches" in said
    assert "data of 2 more were deleted" in said


@pytest.mark.usefixtures("unlaid_figures")
def test_simulated_ones_do_not_count_beside_people() -> None:
    of = design()
    found = [records(of, k) for k in range(1, 5)]
    first = found[0][0]
    assert isinstance(first, ParticipationOpened)
    found[0][0] = replace(first, simulated=False)
    one = analyse_study("m", of, QUESTIONS, SHA, [participation(r, of, QUESTIONS) for r in found])
    assert [p.left_out for p in one.people] == ["", "simulated", "simulated", "simulated"]
    assert any("3 of 4 participants are simulated" in words for words in banners(one))


def test_choices_have_a_table_and_a_sign_test() -> None:
    said = text_of(page_of(study(pairs(), 12, Population(0.8))))
    assert "the first of two was chosen" in said and "triples of conditions go in a circle" in said
    assert re.search(
        r"% of direct choices\) \(exact sign test of participants\), K = \d+, p ", said
    )


@pytest.mark.usefixtures("unlaid_figures")
def test_scales_have_their_reliability_and_the_counts_of_their_items() -> None:
    of = design(
        questionnaires=("calmness",), hypotheses=(Hypothesis("calmness.ease", "walk", "centre"),)
    )
    page = page_of(study(of, 12))
    said = text_of(page)
    assert "mean of 3 items, reversed ones turned round" in said
    assert re.search(r"reliability α = \.\d\d, 95% CI", said)
    assert page.count("<h2>") == 6  # the items are with their scale


def test_a_study_without_hypotheses_is_a_description() -> None:
    assert "states no hypothesis" in text_of(page_of(study(design(hypotheses=()), 6)))


@pytest.mark.usefixtures("unlaid_figures")
def test_remarks_are_shown_as_they_were_written() -> None:
    of = design()
    found = [
        replace(r, value="It <b>stared</b>")
        if isinstance(r, ItemAnswered) and r.trial is None
        else r
        for r in records(of, 1)
    ]
    one = analyse_study("m", of, QUESTIONS, SHA, [participation(found, of, QUESTIONS)])
    assert "It <b>stared</b>" in text_of(page_of(one))


def test_the_answers_are_a_tidy_table(ratings: StudyAnalysis) -> None:
    rows = list(csv.DictReader(answers_csv(ratings).splitlines()))
    assert tuple(rows[0]) == ANSWERS and len(rows) == 12 * 5
    one = rows[0]
    assert (one["participant"], one["simulated"], one["points"]) == ("P001", "yes", "5")
    assert {row["condition"] for row in rows} == {"walk", "centre", ""}
    assert all(1 <= int(row["value"]) <= 5 for row in rows if row["kind"] == "rating")


@pytest.mark.parametrize("text", ["=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1", "\n=1"])
def test_a_text_that_a_spreadsheet_would_run_is_written_as_text(text: str) -> None:
    of = design()
    found = [
        replace(r, value=text) if isinstance(r, ItemAnswered) and r.trial is None
        else replace(r, ms=-1.5) if isinstance(r, ItemAnswered) else r
        for r in records(of, 1)
    ]  # fmt: skip
    one = analyse_study("m", of, QUESTIONS, SHA, [participation(found, of, QUESTIONS)])
    table = answers_csv(one)
    rows = list(csv.DictReader(StringIO(table, newline="")))
    assert len(rows) == 5 and rows[-1]["value"] == "'" + text.replace("\r", "\n")
    assert rows[0]["ms"] == "-1.5" and not rows[0]["value"].startswith("'")


def test_what_was_not_answered_is_an_empty_cell() -> None:
    of = replace(design(), may_skip=True)
    found = [replace(r, value=None) if isinstance(r, ItemAnswered) else r for r in records(of, 1)]
    one = analyse_study("m", of, QUESTIONS, SHA, [participation(found, of, QUESTIONS)])
    rows = list(csv.DictReader(answers_csv(one).splitlines()))
    assert {(row["value"], row["left_out"]) for row in rows} == {("", "not answered")}


def test_pairs_and_factors_have_columns_of_their_own() -> None:
    rows = list(csv.DictReader(answers_csv(study(pairs(), 2)).splitlines()))
    chosen = [row for row in rows if row["kind"] == "choice"]
    assert all(row["condition"] == f"{row['first']}|{row['second']}" for row in chosen)
    of = design(hypotheses=())
    levels = {
        "walk": Condition(factors={"part": "many"}),
        "centre": Condition(factors={"part": "1"}),
    }
    rows = list(csv.DictReader(answers_csv(study(replace(of, conditions=levels), 2)).splitlines()))
    assert {(r["condition"], r["part"]) for r in rows} == {
        ("walk", "many"),
        ("centre", "1"),
        ("", ""),
    }


def test_an_r_script_has_a_model_for_each_hypothesis_and_reads_columns_of_the_table() -> None:
    rated, chosen = r_script(study(count=2)), r_script(study(pairs(), 2))
    call = (
        'ratings("paper.looked_at: walk > centre", "paper", c("looked_at"), c("walk"), c("centre"))'
    )
    assert call in rated and "(1 + better | participant)" in rated and "BTm" not in rated
    assert 'choices("alive", "choice", "alive", c("walk", "centre", "random"))' in chosen
    assert "BTm" in chosen and "clmm" not in chosen
    for script in (rated, chosen):
        assigned = set(re.findall(r"one\$(\w+) <-", script))
        assert set(re.findall(r"(?:answers|one)\$(\w+)", script)) <= {*ANSWERS, *assigned}


def test_presentations_are_a_table_too(ratings: StudyAnalysis) -> None:
    rows = list(csv.DictReader(trials_csv(ratings).splitlines()))
    assert len(rows) == 24 and {row["outcome"] for row in rows} == {"complete"}


def test_a_presentation_is_found_in_its_recording() -> None:
    of = design()
    found = [
        replace(r, recording="run-01.mcap", from_s=6828.507365, to_s=6831.517)
        if isinstance(r, TrialEnded) else r
        for r in records(of, 1)
    ]  # fmt: skip
    one = analyse_study("m", of, QUESTIONS, SHA, [participation(found, of, QUESTIONS)])
    (row, *_) = csv.DictReader(trials_csv(one).splitlines())
    assert (row["recording"], row["from_s"], row["to_s"]) == (
        "run-01.mcap", "6828.507365", "6831.517",
    )  # fmt: skip


def test_programs_read_the_results_as_json(ratings: StudyAnalysis) -> None:
    found = json.loads(results_json(ratings))
    assert found["design_sha256"] == SHA and found["participants"]["counted"] == 12
    first = found["hypotheses"][0]
    assert first["planned_test"]["key"] == "signed_rank" and first["verdict"] == "supported"
    assert [test["key"] for test in first["also"]] == ["chi_square", "rank_sum"]
    assert json.loads(results_json(study(count=1)))["hypotheses"][0]["planned_test"] is None


@pytest.mark.parametrize("points", range(2, 12))
def test_every_point_has_a_shade_of_its_own_side(points: int) -> None:
    found = figures.shades(points)
    assert len(set(found)) == points
    assert not set(found[: points // 2]) & set(found[(points + 1) // 2 :])


def test_intervals_within_participants_are_those_of_morey() -> None:
    """By hand: two conditions, differences 1, 2, 3: half is t(2) sd(d) / sqrt(2) / sqrt(n)."""
    import numpy as np

    rows = np.array([[1.0, 2.0], [5.0, 7.0], [2.0, 5.0]])
    half = 4.302653 * 1.0 / np.sqrt(2) / np.sqrt(3)
    assert within_participant_half_widths(rows) == pytest.approx([half, half], rel=1e-5)


# --- Tests of gazerig study analyse: folders of data, good and bad, and what is written of them


TWO = ("walk", "centre")
SHOWN = {"walk": {"gaze.scanpath.model": "markov"}, "centre": {"gaze.scanpath.model": "simple"}}


def bytes_of(study: StudyDesign) -> bytes:
    keys = {*study.questionnaires, *study.after}
    return canonical(study, {key: QUESTIONS[key] for key in QUESTIONS if key in keys}, SHOWN)


def kept(folder: Path, study: StudyDesign, count: int, cut: int | None = None) -> StudyData:
    """Write the data of simulated participants; the last one's records end at ``cut``."""
    data = StudyData(folder)
    sha256 = data.claim("mine", bytes_of(study))
    for number in range(1, count + 1):
        found: list[Record] = records(study, number, Population(1.2), sha256=sha256)
        with Journal(data.participant(number)) as journal:
            journal.write(found[: cut if number == count else None])
    return data


def analyse(folder: Path) -> None:
    write_report(folder, folder / "report", "gazerig 0.1.0", UTC, nothing)


def nothing(what: str, share: float) -> None:
    pass


@pytest.fixture(scope="module")
def data(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("mine-data")
    kept(folder, design(participants=12), 12)
    analyse(folder)
    return folder


def test_a_folder_gives_back_the_design_and_all_answers(data: Path) -> None:
    found = collect_study(data)
    wanted = design(participants=12)
    # Names of rigs and films are replaced by their values, which the analysis does not need.
    assert found.design == wanted and found.name == "mine"
    assert list(found.questionnaires["paper"].items) == ["naturalness", "looked_at"]
    assert [one.participant for one in found.people] == [participant_code(k) for k in range(1, 13)]
    assert len(found.folders) == 12 and found.deleted == ()


def test_the_order_of_conditions_and_items_is_kept(tmp_path: Path) -> None:
    turned = replace(design(), conditions={"walk": Condition(), "centre": Condition()})
    swapped = dict(reversed(list(turned.conditions.items())))
    kept(tmp_path / "one", replace(turned, conditions=swapped), 1)
    assert list(collect_study(tmp_path / "one").design.conditions) == ["centre", "walk"]


def test_the_report_has_its_page_tables_and_results(data: Path) -> None:
    report = data / "report"
    assert "<title>Walk against centre</title>" in (report / "index.html").read_text()
    rows = list(csv.DictReader((report / "answers.csv").open()))
    assert len(rows) == 12 * 5
    assert json.loads((report / "results.json").read_text())["participants"]["came"] == 12


def test_the_bids_data_set_has_a_table_for_each_participant(data: Path) -> None:
    root = data / "report" / "bids"
    people = list(csv.DictReader((root / "participants.tsv").open(), delimiter="\t"))
    assert len(people) == 12 and people[0]["participant_id"] == "sub-P001"
    table = root / "sub-P001" / "beh" / "sub-P001_task-mine_beh.tsv"
    rows = list(csv.DictReader(table.open(), delimiter="\t"))
    assert {row["condition"] for row in rows} == {"walk", "centre", "n/a"}
    sidecar = json.loads(table.with_suffix(".json").read_text())
    assert set(rows[0]) <= set(sidecar) and sidecar["TaskName"] == "mine"
    assert set(sidecar["condition"]["Levels"]) == {"walk", "centre"}


def test_it_can_be_run_again_and_the_same_data_give_the_same_bytes(data: Path) -> None:
    report = data / "report"
    before = {p: p.read_bytes() for p in report.rglob("*") if p.is_file()}
    analyse(data)
    assert before == {p: p.read_bytes() for p in report.rglob("*") if p.is_file()}


def test_who_was_deleted_is_gone_from_what_is_made_again(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 4)
    analyse(tmp_path)
    data.delete(2)
    analyse(tmp_path)
    written = b"".join(p.read_bytes() for p in (tmp_path / "report").rglob("*") if p.is_file())
    assert b"P001" in written and b"P002" not in written
    assert collect_study(tmp_path).deleted == ("P002",)


def test_an_unfinished_participant_is_left_out_or_kept_by_the_rule(tmp_path: Path) -> None:
    kept(tmp_path / "a", design(), 3, cut=-2)
    assert [p.left_out for p in collect_study(tmp_path / "a").people] == ["", "", "did not finish"]
    kept(tmp_path / "b", replace(design(), exclusion=Exclusion(incomplete="keep")), 3, cut=-2)
    assert not any(p.left_out for p in collect_study(tmp_path / "b").people)


def test_a_torn_line_is_no_record_and_hinders_nothing(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 2)
    journal = data.participant(1) / FILE
    whole = collect_study(tmp_path)
    with journal.open("ab") as file:
        file.write(b'[{"kind": "ParticipationClosed", "outcome": "wit')
    assert collect_study(tmp_path) == whole


def test_a_damaged_line_is_named_with_its_number(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 1)
    journal = data.participant(1) / FILE
    journal.write_bytes(journal.read_bytes() + b"nonsense\n")
    with pytest.raises(SetupError, match=r"P001/journal\.jsonl:2: .*damaged"):
        analyse(tmp_path)


JUNK: tuple[object, ...] = (None, -1, 99, "x", "a|b", [], {})


def test_whatever_a_damaged_journal_holds_is_one_message_and_nothing_is_lost(
    tmp_path: Path,
) -> None:
    """Every field of every record, taken out or replaced by what is not expected."""
    of = pairs(TWO)
    data = kept(tmp_path, of, 1)
    path = data.participant(1) / FILE
    whole = json.loads(path.read_bytes())
    each = {one["kind"]: at for at, one in enumerate(whole)}
    whole.insert(0, whole.pop(each["ParticipationOpened"]))
    refused = 0
    for at in {*each.values(), len(whole) - 2}:
        for field in whole[at]:
            for value in (*JUNK, "taken out"):
                changed = {**whole[at], field: value}
                if value == "taken out":
                    del changed[field]
                line = json.dumps([*whole[:at], changed, *whole[at + 1 :]]).encode() + b"\n"
                path.write_bytes(line)
                try:
                    found = collect_study(tmp_path)
                    analyse_study("m", found.design, found.questionnaires, "ab", found.people)
                except SetupError as error:
                    assert "P001" in str(error) and "\n" not in str(error)
                    refused += 1
                assert path.read_bytes() == line
    assert refused > 100


def test_a_journal_that_lost_a_line_is_refused(tmp_path: Path) -> None:
    """Else the recording of a presentation that did not begin would be measured."""
    data = StudyData(tmp_path)
    of = design()
    sha256 = data.claim("mine", bytes_of(of))
    without = [r for r in records(of, 1, sha256=sha256) if not isinstance(r, TrialBegan)]
    with Journal(data.participant(1)) as journal:
        journal.write(without)
    with pytest.raises(SetupError, match="record 3, TrialEnded: the presentation did not begin"):
        collect_study(tmp_path)


def test_bytes_of_a_journal_that_are_wrong_are_one_message_and_nothing_is_lost(
    tmp_path: Path,
) -> None:
    data = kept(tmp_path, design(), 1)
    path = data.participant(1) / FILE
    whole, rng = path.read_bytes(), random.Random(0)
    refused = 0
    for _ in range(150):
        at, length = rng.randrange(len(whole)), rng.choice((0, 1, 1, 40))
        junk = rng.choice((b"", b"\x00", b"\xff", b"\n", b"[" * 2000, b'"', b"}", b"1e999"))
        damaged = whole[:at] + junk + whole[at + length :]
        path.write_bytes(damaged)
        try:
            collect_study(tmp_path)
        except SetupError as error:
            refused += "\n" not in str(error)
        assert path.read_bytes() == damaged
        try:
            with Journal(path.parent) as journal:
                torn = b"" if journal.torn is None else journal.torn.read_bytes()
                assert path.read_bytes() + torn == damaged
        except SetupError:
            assert path.read_bytes() == damaged
    assert refused > 100


def real(folder: Path, count: int) -> StudyData:
    """Write the data of people of a study of 12."""
    of = design(participants=12)
    data = StudyData(folder)
    sha256 = data.claim("mine", bytes_of(of))
    for number in range(len(data.numbers()) + 1, count + 1):
        first, *rest = records(of, number, Population(1.2), sha256=sha256)
        assert isinstance(first, ParticipationOpened)
        with Journal(data.participant(number)) as journal:
            journal.write([replace(first, simulated=False), *rest])
    return data


def test_a_look_before_the_planned_sample_is_kept_in_the_data_and_reported(tmp_path: Path) -> None:
    # The same people once more are no other look, and the whole sample is none.
    for day, count in ((1, 3), (2, 3), (3, 5), (9, 12)):
        data, found = real(tmp_path, count), collect_study(tmp_path)
        study = analyse_study("m", found.design, found.questionnaires, "ab", found.people)
        study = add_interim_looks(study, data, f"2026-11-0{day}T10:00:00Z")
    looks = [("2026-11-01T10:00:00Z", 3, 3, 12), ("2026-11-03T10:00:00Z", 5, 5, 12)]
    assert list(data.looks()) == looks
    (said,) = banners(study)
    assert "2026-11-01, n = 3; 2026-11-03, n = 5" in said
    results = json.loads(results_json(study))
    assert [tuple(look.values()) for look in results["interim_looks"]] == looks
    (tmp_path / "interim-looks.jsonl").write_text("{}\n")
    with pytest.raises(SetupError, match=r"interim-looks.jsonl cannot be read"):
        add_interim_looks(study, data, UTC)


@pytest.mark.usefixtures("unlaid_figures")
def test_the_command_records_a_look_once(tmp_path: Path) -> None:
    data = real(tmp_path, 2)
    analyse(tmp_path)
    assert [look[1:] for look in data.looks()] == [(2, 2, 12)]


def test_a_look_at_simulated_participants_is_none(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 2)
    found = collect_study(tmp_path)
    study = analyse_study("m", found.design, found.questionnaires, "ab", found.people)
    assert not add_interim_looks(study, data, UTC).looks and not data.looks()


def test_data_of_two_designs_are_refused_with_both_hashes(tmp_path: Path) -> None:
    data = kept(tmp_path, design(), 2)
    with Journal(data.participant(3)) as journal:
        journal.write(records(design(), 3, sha256="f" * 64))
    with pytest.raises(SetupError, match=r"P003 was recorded with another design \(ffffffffffff\)"):
        analyse(tmp_path)


def test_an_edited_design_is_refused(tmp_path: Path) -> None:
    kept(tmp_path, design(), 1)
    path = tmp_path / "design.json"
    path.write_text(path.read_text().replace('"alpha": 0.05', '"alpha": 0.2'))
    with pytest.raises(SetupError, match="changed"):
        analyse(tmp_path)


def test_a_folder_without_a_study_or_participants_says_what_to_do(tmp_path: Path) -> None:
    with pytest.raises(SetupError, match=r"no data of a study"):
        analyse(tmp_path)
    kept(tmp_path, design(), 0)
    with pytest.raises(SetupError, match=r"no participant yet: gazerig study run"):
        analyse(tmp_path)


def test_a_folder_of_somebody_else_is_not_written_to(tmp_path: Path) -> None:
    kept(tmp_path, design(), 1)
    there = tmp_path / "report"
    there.mkdir()
    (there / "thesis.txt").write_text("mine")
    with pytest.raises(SetupError, match="no report of a study"):
        analyse(tmp_path)
    assert [p.name for p in there.iterdir()] == ["thesis.txt"]


def test_the_terminal_says_what_became_of_each_hypothesis(data: Path) -> None:
    report = write_report(data, data / "report", "gazerig 0.1.0", UTC, lambda _, __: None)
    lines = verdicts(report.study)
    assert lines[0] == "12 of 12 participants count"
    assert lines[1].startswith("naturalness: walk > centre: supported (corrected p = ")
