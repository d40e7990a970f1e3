"""The page of a study's report: texts, tables and figures in its template."""

from collections import Counter
from collections.abc import Callable
from math import isfinite, nan
from pathlib import Path
from typing import NamedTuple

from markupsafe import Markup

from gazerig.features.lab.report.page import PageFigure, render
from gazerig.features.lab.report.statistics import format_number
from gazerig.features.study.analysis import ChoiceSummary, MeasureSummary, StudyAnalysis
from gazerig.features.study.decisions import Decision
from gazerig.features.study.journal import STEP_DEG
from gazerig.features.study.report import apa, figures

Progress = Callable[[str, float], None]
_CLASSES = {
    "supported": "pass", "not supported": "uncertain", "against": "outside", "too few": "few",
}  # fmt: skip


class HypothesisLine(NamedTuple):
    """Summary of one hypothesis."""

    expected: str
    sentence: Markup
    verdict: str
    css: str


class TestLine(NamedTuple):
    """A row of the table of tests; planned: it decides on its hypothesis."""

    expected: str
    test: str
    planned: bool
    statistic: Markup
    p: Markup
    exact: Markup
    corrected: Markup
    effect: Markup
    notes: tuple[str, ...]


class MeasureSection(NamedTuple):
    """Section of a measure; rows: condition, n, mean, interval, SD, median."""

    title: str
    asked: str
    facts: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    figures: tuple[PageFigure, ...]


class ChoiceSection(NamedTuple):
    """Section of choices; table: how often the row was chosen over the column."""

    title: str
    asked: str
    facts: tuple[str, ...]
    names: tuple[str, ...]
    table: tuple[tuple[str, ...], ...]


def study_page(study: StudyAnalysis, made_by: str, progress: Progress) -> str:
    """Return the report of a study as HTML that needs no other file."""
    sections = []
    for k, one in enumerate(study.measures):
        progress("drawing", k / max(1, len(study.measures)))
        measure = one.measure
        item = measure.items[0] if measure.kind == "item" else ""
        if not item or not study.questionnaires[measure.questionnaire].items[item].scale:
            sections.append(_measure_section(one, study))  # items of a scale are shown with it
    progress("drawing", 1.0)
    tests = [
        TestLine(
            _label(one, study), apa.TEST_NAMES[test.key], test is one.test, apa.statistic_text(test),
            apa.p_text(test.p),
            apa.p_text(test.exact_p) if isfinite(test.exact_p) else Markup(""),
            apa.p_text(one.corrected_p) if test is one.test else Markup(""),
            apa.effect_text(test.effect), test.notes,
        )
        for one in study.decisions
        for test in (one.test, *one.further_tests)
        if test is not None
    ]  # fmt: skip
    forest = PageFigure(
        "Effects", figures.forest_png(study, [_label(one, study) for one in study.decisions]),
        "Squares: the effect of each hypothesis; lines: its 95 % interval. Right of zero lies what "
        "was expected.",
    )  # fmt: skip
    # Single exclusions of participants who count.
    left_out_rows = Counter(
        row.left_out for one in study.counted for row in one.answers if row.left_out
    )
    return render(
        "study.html", Path(__file__).parent, study=study, made_by=made_by, banners=banners(study),
        facts=_facts(study), hypotheses=[_line(one, study) for one in study.decisions],
        tests=tests, forest=forest if study.decisions else None, sections=sections,
        choices=[_choice_section(one, study) for one in study.choices],
        checks=[(_label(one, study), one.checks) for one in study.decisions if one.checks],
        left_out=[one for one in study.people if one.left_out], rows=left_out_rows.most_common(),
        remarks=study.remarks, plan=study.design.plan, rules=_rules(study),
        css=lambda fine: "pass" if fine else "uncertain", p=apa.p_text, isfinite=isfinite,
    )  # fmt: skip


def banners(study: StudyAnalysis) -> tuple[str, ...]:
    """Return warnings that precede the report."""
    found = []
    simulated = sum(one.simulated for one in study.people)
    if simulated == len(study.people) and simulated:
        found.append("Simulated participants: nobody answered. This report shows the tool at work.")
    elif simulated:
        found.append(
            f"{simulated} of {len(study.people)} participants are simulated, and are left out."
        )
    came, counted = len(study.people), len(study.counted)
    planned = study.design.plan.participants
    if came < planned:
        found.append(
            f"Too few: {came} of the {planned} participants who were planned came, {counted} count. "
            "A study that is looked at before its end, and goes on until it pleases, finds effects "
            "that are not there: go on to the number that was planned."
        )
    elif counted < planned:
        found.append(
            f"{counted} of the {planned} participants who were planned count, as others are left "
            "out: effects are found more seldom than the plan says."
        )
    if study.looks:
        when = "; ".join(f"{look.utc[:10]}, n = {look.counted}" for look in study.looks)
        found.append(
            f"Interim looks: the data were analysed before the planned number came ({when}). Report "
            "them: each look is one more chance of a false positive if the study could stop there."
        )
    programs = {one.program for one in study.people}
    if len(programs) > 1:
        found.append(f"The data were taken by several versions: {', '.join(sorted(programs))}.")
    return tuple(found)


def _facts(study: StudyAnalysis) -> tuple[tuple[str, str], ...]:
    design, people = study.design, study.people
    dates = sorted(one.opened_utc for one in people)
    plan = design.plan
    deleted = f"; data of {study.deleted} more were deleted as they wished" if study.deleted else ""
    many = design.trials.repetitions
    times = "once" if many == 1 else f"{many} times"
    steps = [t.measured.get(STEP_DEG, nan) for one in study.people for t in one.trials]
    known = [step for step in steps if isfinite(step)]
    switches = [
        ("switches", f"largest step of a commanded joint {max(known):.2f} deg in a tick, "
                     f"{len(known)} switches")
    ] if known else []  # fmt: skip
    return (
        ("study", study.name),
        ("design (SHA-256)", f"{study.design_sha256}; all {len(people)} participants carry it"),
        ("participants", f"{len(people)} came, {len(study.counted)} count, {plan.participants} "
                         f"were planned{deleted}"),
        ("from, to", f"{dates[0]}, {dates[-1]}" if dates else ""),
        ("conditions", "; ".join(f"{k}: {study.label(k)}" for k in design.conditions)),
        ("task", "each was rated" if design.task == "rating" else "one of two was chosen"),
        ("shown", f"{design.trials.seconds:g} s {_SHOWN[design.presentation.on]}, "
                  f"each {times}"),
        *switches,
        ("plan", f"alpha {plan.alpha:g} over all hypotheses ({plan.correction}), power "
                 f"{plan.power:g} for d_z = {plan.effect:g}"),
    )  # fmt: skip


_SHOWN = {"head": "of the head in the room", "film": "of film"}


def _rules(study: StudyAnalysis) -> tuple[str, ...]:
    rules = study.design.exclusion
    found = [
        f"pages answered in less than {rules.fastest_answer_ms:g} ms",
        f"trials in which the head was lost ({rules.lost_head})",
    ]
    if rules.same_answers:
        found.append("participants who gave one answer to every item of all trials")
    if rules.incomplete == "exclude":
        found.append("participants who did not finish")
    return tuple(found)


def _label(one: Decision, study: StudyAnalysis) -> str:
    """Return a hypothesis as a label: "looked at: walk > centre"."""
    said = one.hypothesis
    return f"{apa.measure_name(one.measure)}: {said.better} > {said.than}"


def _line(one: Decision, study: StudyAnalysis) -> HypothesisLine:
    said = one.hypothesis
    better = study.label(said.better)
    expected = (
        f"{better[:1].upper()}{better[1:]} exceeds {study.label(said.than)} in "
        f"{apa.measure_name(one.measure)}"
    )
    if not said.two_sided:
        expected += " (one-sided)"
    return HypothesisLine(
        expected, apa.result_sentence(one, study), one.verdict, _CLASSES[one.verdict]
    )


def _measure_section(one: MeasureSummary, study: StudyAnalysis) -> MeasureSection:
    measure, drawn, facts = one.measure, [], []
    if measure.kind == "scale":
        items = [m for m in study.measures if m.measure.kind == "item"
                 and m.measure.questionnaire == measure.questionnaire
                 and m.measure.items[0] in measure.items]  # fmt: skip
        facts.append(f"mean of {len(items)} items, reversed ones turned round")
        if one.alpha is not None and isfinite(one.alpha.value):
            facts.append(Markup("reliability {}").format(apa.effect_text(one.alpha)))
        counted = figures.counts_png(items, study)
        drawn.append(PageFigure("Answers to each item", counted, _COUNTS))
    elif measure.kind == "item":
        drawn.append(PageFigure("Answers", figures.counts_png([one], study), _COUNTS))
    drawn.append(PageFigure("Participants and means", figures.paired_png(one, study), _PAIRED))
    rows = tuple(
        (study.label(c.condition), str(c.n), _number_text(c.mean),
         f"{format_number(c.low95)} to {format_number(c.high95)}" if isfinite(c.low95) else "",
         _number_text(c.sd), _number_text(c.median))
        for c in one.conditions
    )  # fmt: skip
    title = apa.measure_name(measure)
    return MeasureSection(title, _question_text(one, study), tuple(facts), rows, tuple(drawn))


_COUNTS = "How often each point was answered. The middle of the scale stands on the line."
_PAIRED = (
    "Thin lines: participants (equal answers lie a little apart); diamonds: means; bars: 95 % "
    "intervals within participants (Cousineau 2005, Morey 2008)."
)


def _number_text(value: float) -> str:
    return f"{value:.2f}" if isfinite(value) else "unknown"


def _question_text(one: MeasureSummary | ChoiceSummary, study: StudyAnalysis) -> str:
    """Return the question in the study's language, or the source of the measure."""
    measure = one.measure
    if measure.kind == "objective":
        return "measured by the head, of each trial"
    asked = study.questionnaires[measure.questionnaire]
    if measure.kind == "scale":
        return f"{asked.title}, scale {measure.name.partition('.')[2]}"
    item, language = asked.items[measure.items[0]], study.design.language
    text, low, high = (t.get(language, t.get("en", "")) for t in (item.text, item.low, item.high))
    ends = f"1 = {low}, {item.points} = {high}" if low or high else ""
    return " ".join(part for part in (f"“{text}”" if text else "", ends and f"({ends})") if part)


def _choice_section(one: ChoiceSummary, study: StudyAnalysis) -> ChoiceSection:
    keys = tuple(study.design.conditions)
    table = tuple(
        (study.label(key), *("" if i == j else str(one.wins[i, j]) for j in range(len(keys))))
        for i, key in enumerate(keys)
    )
    facts = [f"the first of two was chosen {one.first[0]} of {one.first[1]} times"]
    if one.circles[1]:
        facts.append(f"{one.circles[0]} of {one.circles[1]} triples of conditions go in a circle")
    names = tuple(study.label(key) for key in keys)
    return ChoiceSection(
        apa.measure_name(one.measure), _question_text(one, study), tuple(facts), names, table
    )
