"""What a study measures, by name: answers to items, means of scales, and objective measures."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from gazerig.features.study.design import StudyDesign
from gazerig.features.study.questionnaire import Questionnaire

GAZE_MEASURES: Mapping[str, str] = {
    "mutual_gaze_share": "share of the time in which participant and head look at each other",
    "participant_gaze_share": "share of the time in which the participant looks at the head",
    "first_look_s": "time from the trial's start to the participant's first look at the head",
}
"""Objective measures of the participant's own gaze, where the camera sees it."""


@dataclass(frozen=True)
class Measure:
    """One dependent variable.

    Attributes:
        name: "questionnaire.item", "questionnaire.scale", or that of an objective measure.
        kind: One rating, the mean of a scale's ratings, a choice between two, or objective.
        questionnaire: Key in the design, "" for an objective measure.
        items: Keys of the items; of a scale all that belong to it.
        points: Steps of a rating, 0 where there are none.
        once: It is asked once at the end and not after each trial.
    """

    name: str
    kind: Literal["item", "scale", "choice", "objective"]
    questionnaire: str = ""
    items: tuple[str, ...] = ()
    points: int = 0
    once: bool = False


def measures(
    design: StudyDesign, questionnaires: Mapping[str, Questionnaire]
) -> dict[str, Measure]:
    """Return what a study measures, by name; free text is none.

    Args:
        design: whose questionnaires and objective measures they are.
        questionnaires: by the keys in the design; one that is not there is left out.
    """
    found: dict[str, Measure] = {}
    for key in (*design.questionnaires, *design.after):
        if key in questionnaires:
            once = key not in design.questionnaires
            found |= _of_questionnaire(key, questionnaires[key], once)
    return found | {name: Measure(name, "objective") for name in design.objective}


def _of_questionnaire(key: str, asked: Questionnaire, once: bool) -> dict[str, Measure]:
    """Return items and scales of one questionnaire."""
    found: dict[str, Measure] = {}
    scales: dict[str, list[str]] = {}
    for name, item in asked.items.items():
        if item.kind == "choice":
            found[f"{key}.{name}"] = Measure(f"{key}.{name}", "choice", key, (name,), 0, once)
        if item.kind == "rating":
            at = f"{key}.{name}"
            found[at] = Measure(at, "item", key, (name,), item.points, once)
            if item.scale:
                scales.setdefault(item.scale, []).append(name)
    for scale, items in scales.items():
        at, points = f"{key}.{scale}", asked.items[items[0]].points
        found[at] = Measure(at, "scale", key, tuple(items), points, once)
    return found
