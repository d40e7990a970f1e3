"""A study as tidy tables, one row per answer or presentation; and its results as JSON."""

import csv
import json
from collections.abc import Iterable, Sequence
from dataclasses import asdict
from io import StringIO
from math import isfinite
from typing import Any

from gazerig.features.study.analysis import StudyAnalysis
from gazerig.features.study.order import PAIR
from gazerig.features.study.participation import AnswerRow, Participation
from gazerig.features.study.statistics.results import StatisticalTest

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
                "also": [_test(test) for test in one.also],
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
