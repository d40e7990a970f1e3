"""Tests of a study's report: what its sentences, page and tables say."""

import csv
import json
import re
from dataclasses import replace
from html import unescape
from html.parser import HTMLParser
from io import StringIO
from math import nan

import pytest
from study_records import QUESTIONS, design, pairs, records

from gazerig.features.study.analysis import (
    StudyAnalysis,
    analyse_study,
    within_participant_half_widths,
)
from gazerig.features.study.design import Condition, Hypothesis, StudyDesign, Trials
from gazerig.features.study.participation import participation
from gazerig.features.study.records import STEP_DEG, ItemAnswered, Opened, TrialEnded
from gazerig.features.study.report import apa, figures
from gazerig.features.study.report.page import banners, study_page
from gazerig.features.study.report.r_script import r_script
from gazerig.features.study.report.tables import ANSWERS, answers_csv, results_json, trials_csv
from gazerig.features.study.simulation import Population
from gazerig.features.study.statistics.results import EffectSize, StatisticalTest

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
    assert unescape(re.sub("<[^>]*>", "", apa.chance(p))) == says


@pytest.mark.parametrize(
    ("value", "says"),
    [(0.618, ".62"), (-0.618, "\N{MINUS SIGN}.62"), (1.0, "1.00"), (-0.001, ".00")],
)
def test_what_cannot_exceed_one_has_no_zero_before_the_point(value: float, says: str) -> None:
    assert apa.bounded(value) == says


def test_effects_are_written_with_their_interval() -> None:
    dz = EffectSize("Cohen's d_z", "d_z", 0.62, -0.04, 1.2, "BCa bootstrap", bounded=False)
    assert apa.effect(dz) == ("<i>d</i><sub>z</sub> = 0.62, 95% CI [\N{MINUS SIGN}0.04, 1.20]")
    assert apa.effect(dz._replace(low95=nan)) == "<i>d</i><sub>z</sub> = 0.62"
    assert apa.effect(dz._replace(value=nan)) == ""


def test_a_chi_square_has_its_degrees_of_freedom_and_its_answers() -> None:
    nothing = EffectSize("V", "V", 0.3, nan, nan, "none")
    found = StatisticalTest("chi_square", "χ²", 9.2, 4.0, 0.05, nan, 0.001, 48, nothing)
    assert re.sub("<[^>]*>", "", apa.statistic(found)) == "χ²(4, N = 48) = 9.20"


def test_the_sentence_says_who_was_above_and_by_which_figures(ratings: StudyAnalysis) -> None:
    one = ratings.decisions[0]
    assert one.test is not None and one.verdict == "supported"
    said = unescape(re.sub("<[^>]*>", "", apa.sentence(one, ratings)))
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
    assert isinstance(first, Opened)
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
    assert page.count("<h2>") == 6  # the items stand with their scale


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
