"""Measures of a study by name: answers to items, means of scales, and objective measures."""

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


def measures(
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
