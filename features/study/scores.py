"""Measures of a study by name, and their numbers per participant and condition."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import nan
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gazerig.features.study.design import StudyDesign
from gazerig.features.study.participation import AnswerRow, Participation
from gazerig.features.study.questionnaire import Questionnaire
from gazerig.features.study.trial_order import PAIR
from gazerig.gaze.types import Floats

GAZE_MEASURES: Mapping[str, str] = {
    "mutual_gaze_share": "share of the time in which participant and head look at each other",
    "participant_gaze_share": "share of the time in which the participant looks at the head",
    "first_look_s": "time from the trial's start to the participant's first look at the head",
}
"""Objective measures of the participant's gaze, if the camera sees it."""


@dataclass(frozen=True)
class Measure:
    """One dependent variable.

    Attributes:
        name: "questionnaire.item", "questionnaire.scale", or the name of an objective measure.
        kind: One rating, the mean of a scale's ratings, a choice between two, or objective.
        questionnaire: Key in the design, "" for an objective measure.
        items: Keys of the items, for a scale all of its items.
        points: Steps of a rating, 0 for other kinds.
        once: Whether it is asked once at the end instead of after each trial.
    """

    name: str
    kind: Literal["item", "scale", "choice", "objective"]
    questionnaire: str = ""
    items: tuple[str, ...] = ()
    points: int = 0
    once: bool = False


def design_measures(
    design: StudyDesign, questionnaires: Mapping[str, Questionnaire]
) -> dict[str, Measure]:
    """Return the measures of a study by name, without free text.

    Args:
        design: the design with questionnaires and objective measures.
        questionnaires: by the keys in the design; missing ones are skipped.
    """
    found: dict[str, Measure] = {}
    for key in (*design.questionnaires, *design.after):
        if key not in questionnaires:
            continue
        items, once = questionnaires[key].items, key not in design.questionnaires
        scales: dict[str, list[str]] = {}
        for name, item in items.items():
            at = f"{key}.{name}"
            if item.kind == "choice":
                found[at] = Measure(at, "choice", key, (name,), 0, once)
            if item.kind == "rating":
                found[at] = Measure(at, "item", key, (name,), item.points, once)
                if item.scale:
                    scales.setdefault(item.scale, []).append(name)
        for scale, names in scales.items():
            at, points = f"{key}.{scale}", items[names[0]].points
            found[at] = Measure(at, "scale", key, tuple(names), points, once)
    return found | {name: Measure(name, "objective") for name in design.objective}


@dataclass(frozen=True)
class Scores:
    """A measure of all participants who count.

    participants: codes, in the order of the rows; conditions: keys, in the order of the columns
    means: (participants, conditions) over items and repetitions, nan if unknown
    places: (participants, conditions) position at which each condition was first seen, from 0
    single: (answers, 3) row of the participant, column of the condition, and the answer
    """

    measure: Measure
    participants: tuple[str, ...]
    conditions: tuple[str, ...]
    means: Floats
    places: Floats
    single: Floats

    def condition_columns(self, conditions: Sequence[str]) -> list[int]:
        """Return the columns of conditions."""
        return [self.conditions.index(condition) for condition in conditions]

    def condition_means(self, *conditions: str) -> Floats:
        """Return the means over one or more conditions, (participants,); nan if incomplete."""
        found: Floats = self.means[:, self.condition_columns(conditions)].mean(axis=1)
        return found

    def answers(self, *conditions: str) -> Floats:
        """Return every single answer on these conditions."""
        found: Floats = self.single[
            np.isin(self.single[:, 1], self.condition_columns(conditions)), 2
        ]
        return found

    def first_seen(self, *conditions: str) -> Floats:
        """Return the position at which the first of these conditions was seen, (participants,)."""
        found: Floats = self.places[:, self.condition_columns(conditions)].min(axis=1)
        return found


def measure_scores(
    measure: Measure,
    people: Sequence[Participation],
    conditions: Sequence[str],
    questionnaires: Mapping[str, Questionnaire],
) -> Scores:
    """Return a measure of all participants with data."""
    conditions = tuple(conditions)
    columns = {key: k for k, key in enumerate(conditions)}
    kept: list[Participation] = []
    means, places, single = [], [], []
    for one in people:
        values = [
            (columns[condition], value)
            for condition, value in _values(measure, one, questionnaires)
            if condition in columns
        ]
        if not values:
            continue
        single += [(len(kept), column, value) for column, value in values]
        kept.append(one)
        means.append([_mean([v for at, v in values if at == k]) for k in range(len(conditions))])
        places.append([one.order.index(key) if key in one.order else nan for key in conditions])
    shape = (len(kept), len(conditions))
    return Scores(
        measure, tuple(one.participant for one in kept), conditions,
        np.array(means, float).reshape(shape), np.array(places, float).reshape(shape),
        np.array(single, float).reshape(-1, 3),
    )  # fmt: skip


def _values(
    measure: Measure, one: Participation, questionnaires: Mapping[str, Questionnaire]
) -> list[tuple[str, float]]:
    """Return (condition, value) of each trial; for a scale the mean of its items after reversal.

    A scale with answers to fewer than half of its items has no value.
    """
    if measure.kind == "objective":
        return [
            (t.condition, t.measured[measure.name])
            for t in one.counted_trials
            if np.isfinite(t.measured.get(measure.name, nan))
        ]
    by_trial: dict[tuple[int | None, str], list[float]] = {}
    for row in one.counted:
        if row.questionnaire == measure.questionnaire and row.item in measure.items:
            value = reverse_rating(row, questionnaires)
            by_trial.setdefault((row.trial, row.condition), []).append(value)
    return [
        (condition, _mean(values))
        for (_, condition), values in by_trial.items()
        if 2 * len(values) >= len(measure.items)
    ]


def reverse_rating(row: AnswerRow, questionnaires: Mapping[str, Questionnaire]) -> float:
    """Return a rating, with reversed items inverted, so that higher means more of the scale."""
    item = questionnaires[row.questionnaire].items[row.item]
    assert row.value is not None  # rows without an answer are excluded
    return item.points + 1.0 - float(row.value) if item.reverse else float(row.value)


def item_answers(
    measure: Measure, people: Sequence[Participation], questionnaires: Mapping[str, Questionnaire]
) -> Floats:
    """Return the answers to a scale's items, (presentations, items), of complete pages only."""
    pages: dict[tuple[str, int | None], dict[str, float]] = {}
    for one in people:
        for row in one.counted:
            if row.questionnaire == measure.questionnaire and row.item in measure.items:
                page = pages.setdefault((one.participant, row.trial), {})
                page[row.item] = reverse_rating(row, questionnaires)
    whole = [[page[i] for i in measure.items] for page in pages.values()
             if len(page) == len(measure.items)]  # fmt: skip
    return np.array(whole, float).reshape(-1, len(measure.items))


def choice_wins(
    measure: Measure, people: Sequence[Participation], conditions: Sequence[str]
) -> NDArray[np.int64]:
    """Return the number of choices of the row over the column, (conditions, conditions)."""
    columns = {key: k for k, key in enumerate(conditions)}
    out = np.zeros((len(columns), len(columns)), np.int64)
    for one in people:
        for row in one.counted:
            if row.questionnaire == measure.questionnaire and row.item in measure.items:
                first, second = row.condition.split(PAIR)
                chosen, other = (first, second) if row.value == "first" else (second, first)
                if chosen in columns and other in columns:
                    out[columns[chosen], columns[other]] += 1
    return out


def choice_differences(
    measure: Measure, people: Sequence[Participation], better: str, than: str
) -> Floats:
    """Return each participant's choices of one condition minus those of the other, (n,).

    Participants who did not choose between these two are omitted.
    """
    each = (choice_wins(measure, [one], (better, than)) for one in people)
    found = [int(table[0, 1]) - int(table[1, 0]) for table in each if table.any()]
    return np.array(found, float)


def _mean(values: Sequence[float]) -> float:
    return float(np.mean(values)) if values else nan
