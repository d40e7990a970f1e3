"""A study as tidy tables, one row per answer or presentation; its results as JSON; an R script.

The script has exploratory models that only R packages have.
"""

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from io import StringIO
from math import isfinite
from typing import Any

from gazerig.features.study.analysis import StudyAnalysis
from gazerig.features.study.participation import AnswerRow, Participation
from gazerig.features.study.report.apa import measure_name
from gazerig.features.study.statistics.effects import StatisticalTest
from gazerig.features.study.trial_order import PAIR

ANSWERS = (
    "participant", "simulated", "trial", "condition", "first", "second", "questionnaire", "item",
    "kind", "scale", "reverse", "points", "value", "ms", "utc", "left_out",
)  # fmt: skip
"""Columns of answers.csv; those of the design's factors follow."""

TRIALS = (
    "participant", "simulated", "trial", "side", "condition", "attempts", "outcome", "seconds",
    "utc", "recording", "from_s", "to_s", "reason",
)  # fmt: skip
"""Columns of trials.csv; those of the objective measures follow."""


_FORMULAS = ("=", "+", "-", "@", "\t", "\n")
"""First characters of a cell that spreadsheets execute as a formula, or skip before one."""


def factors(study: StudyAnalysis) -> tuple[str, ...]:
    """Return the names of a design's factors."""
    return tuple(
        dict.fromkeys(name for one in study.design.conditions.values() for name in one.factors)
    )


def answers_csv(study: StudyAnalysis) -> str:
    """Return every answer, with the reason if it is excluded."""
    names = factors(study)
    rows = (
        [*_answer(one, row, study), *_levels(row.condition, names, study)]
        for one in study.people
        for row in one.answers
    )
    return _csv((*ANSWERS, *names), rows)


def _answer(one: Participation, row: AnswerRow, study: StudyAnalysis) -> list[object]:
    item = study.questionnaires[row.questionnaire].items[row.item]
    first, _, second = row.condition.partition(PAIR)
    pair = (first, second) if second else ("", "")
    rating = item.kind == "rating"
    return [
        row.participant, _yes_or_no(one.simulated), row.trial, row.condition, *pair, row.questionnaire,
        row.item, item.kind, item.scale, _yes_or_no(item.reverse) if rating else "",
        item.points if rating else "", row.value, row.ms, row.utc, one.left_out or row.left_out,
    ]  # fmt: skip


def _levels(condition: str, names: Sequence[str], study: StudyAnalysis) -> list[str]:
    known = study.design.conditions.get(condition)
    return [known.factors.get(name, "") if known else "" for name in names]


def trials_csv(study: StudyAnalysis) -> str:
    """Return every presentation in its last attempt, with its objective measures."""
    measured = dict.fromkeys(
        name for one in study.people for trial in one.trials for name in trial.measured
    )
    rows = (
        [
            one.participant, _yes_or_no(one.simulated), t.trial, t.side, t.condition, t.attempts,
            t.outcome, t.seconds, t.utc, t.recording, t.from_s, t.to_s, t.reason,
            *(t.measured.get(name) for name in measured),
        ]
        for one in study.people
        for t in one.trials
    )  # fmt: skip
    return _csv((*TRIALS, *measured), rows)


def results_json(study: StudyAnalysis) -> str:
    """Return the decisions and all their values, for programs."""
    said = {
        "study": study.name,
        "title": study.design.title,
        "design_sha256": study.design_sha256,
        "participants": {
            "planned": study.design.plan.participants,
            "came": len(study.people),
            "counted": len(study.counted),
            "left_out": {one.participant: one.left_out for one in study.people if one.left_out},
        },
        "interim_looks": [look._asdict() for look in study.looks],
        "hypotheses": [
            {
                **asdict(one.hypothesis),
                "verdict": one.verdict,
                "n": one.n,
                "corrected_p": one.corrected_p,
                "too_few": one.too_few,
                "means": one.means,
                "medians": one.medians,
                "standardised": one.standardised._asdict() if one.standardised else None,
                "planned_test": _test(one.test) if one.test else None,
                "also": [_test(test) for test in one.further_tests],
                "assumptions": [check._asdict() for check in one.checks],
            }
            for one in study.decisions
        ],
    }
    return json.dumps(_json_value(said), indent=1, ensure_ascii=False) + "\n"


def _test(test: StatisticalTest) -> dict[str, object]:
    return {**asdict(test), "effect": test.effect._asdict(), "deciding_p": test.deciding_p}


def _json_value(value: Any) -> Any:
    """Return a value with null for NaN, which JSON does not have."""
    if isinstance(value, dict):
        return {key: _json_value(one) for key, one in value.items()}
    if isinstance(value, list | tuple):
        return [_json_value(one) for one in value]
    return None if isinstance(value, float) and not isfinite(value) else value


def _csv(columns: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    out = StringIO()
    table = csv.writer(out, lineterminator="\n")
    table.writerow(columns)
    table.writerows([_cell(one) for one in row] for row in rows)
    return out.getvalue()


def _cell(value: object) -> str:
    """Return a value in its shortest exact form; unknown values are empty."""
    if value is None or (isinstance(value, float) and not isfinite(value)):
        return ""
    if isinstance(value, str):
        return as_text(value.replace("\r\n", "\n").replace("\r", "\n"))  # csv does not quote CR
    return f"{value:.10g}" if isinstance(value, float) else str(value)


def as_text(value: str) -> str:
    """Return a text that no spreadsheet executes: a formula gets an apostrophe."""
    return f"'{value}" if value.startswith(_FORMULAS) else value


def _yes_or_no(value: bool) -> str:
    return "yes" if value else "no"


_BEGINNING = """\
# Exploratory models of a study, written by gazerig beside answers.csv. They decide nothing.
# Needs: install.packages(c("ordinal", "BradleyTerry2")). Run: Rscript exploratory.R
file <- sub("^--file=", "", grep("^--file=", commandArgs(FALSE), value = TRUE))
folder <- if (length(file)) dirname(file) else "."
answers <- read.csv(file.path(folder, "answers.csv"), na.strings = "", stringsAsFactors = FALSE)
answers <- answers[is.na(answers$left_out) & !is.na(answers$trial), ]
"""

_RATINGS = """
# Cumulative-link mixed model. Participants differ in their level and in their preference (random
# intercept and slope; Barr et al. 2013); one answer per condition does not tell a slope from noise.
ratings <- function(name, questionnaire, items, better, than) {
  cat("\\n==", name, "==\\n")
  one <- answers[answers$questionnaire == questionnaire & answers$item %in% items &
                   answers$condition %in% c(better, than), ]
  value <- as.integer(one$value)
  value <- ifelse(one$reverse == "yes", one$points + 1L - value, value)
  one$rating <- factor(value, levels = sort(unique(value)), ordered = TRUE)
  one$better <- as.numeric(one$condition %in% better)
  one$participant <- factor(one$participant)
  one$item <- factor(one$item)
  slopes <- nrow(one) > 2 * nlevels(one$participant)
  model <- paste("rating ~ better +",
                 if (slopes) "(1 + better | participant)" else "(1 | participant)",
                 if (length(items) > 1) "+ (1 | item)")
  print(summary(ordinal::clmm(as.formula(model), data = one)))
}
"""

_CHOICES = """
# Bradley-Terry scores of all conditions. Choices of one participant depend on each other, so the
# intervals are those of a bootstrap over participants.
choices <- function(name, questionnaire, item, conditions) {
  cat("\\n==", name, "==\\n")
  one <- answers[answers$questionnaire == questionnaire & answers$item == item, ]
  one$first <- factor(one$first, levels = conditions)
  one$second <- factor(one$second, levels = conditions)
  one$chosen <- as.numeric(one$value == "first")
  scores <- function(rows) coef(suppressWarnings(
    BradleyTerry2::BTm(chosen, first, second, data = rows)))
  set.seed(1)
  people <- split(seq_len(nrow(one)), one$participant)
  drawn <- replicate(999, scores(one[unlist(sample(people, replace = TRUE)), ]))
  drawn <- matrix(drawn, ncol = 999)
  ends <- apply(drawn, 1, quantile, c(0.025, 0.975), na.rm = TRUE)
  print(cbind(score = scores(one), low95 = ends[1, ], high95 = ends[2, ]))
}
"""


def r_script(study: StudyAnalysis) -> str:
    """Return an R script that reads answers.csv from its own folder.

    It has a mixed model for each hypothesis about ratings, and the Bradley-Terry model of choices.
    """
    design = study.design
    rated = [one for one in study.decisions if one.measure.kind in ("item", "scale")]
    calls = [
        f"ratings({json.dumps(f'{one.measure.name}: {one.hypothesis.better} > {one.hypothesis.than}')}, "
        f"{json.dumps(one.measure.questionnaire)}, {_vector(one.measure.items)}, "
        f"{_vector(design.side(one.hypothesis.better))}, {_vector(design.side(one.hypothesis.than))})"
        for one in rated
    ]
    calls += [
        f"choices({json.dumps(measure_name(one.measure))}, {json.dumps(one.measure.questionnaire)}, "
        f"{json.dumps(one.measure.items[0])}, {_vector(design.conditions)})"
        for one in study.choices
    ]
    parts = [_BEGINNING, _RATINGS * bool(rated), _CHOICES * bool(study.choices), "\n"]
    return "".join(parts) + "".join(f"{call}\n" for call in calls)


def _vector(names: Iterable[str]) -> str:
    return f"c({', '.join(json.dumps(name) for name in names)})"
