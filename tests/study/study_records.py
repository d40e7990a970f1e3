"""Studies in memory: small designs, and the records of participants who answer as simulated."""

from collections.abc import Mapping
from dataclasses import replace

from gazerig.features.study.design import Condition, Hypothesis, StatisticalPlan, StudyDesign, Test
from gazerig.features.study.journal import (
    ConsentGiven,
    ItemAnswered,
    ParticipationClosed,
    ParticipationOpened,
    Record,
    TrialBegan,
    TrialEnded,
)
from gazerig.features.study.questionnaire import Item, Questionnaire
from gazerig.features.study.simulation import Population, SimulatedParticipant
from gazerig.features.study.trial_order import participant_order

UTC = "2026-11-23T10:00:00Z"
NO, YES = {"en": "not at all"}, {"en": "very much"}
PAPER = Questionnaire(
    "Naturalness and being looked at", "N", "own",
    {
        "naturalness": Item({"en": "Natural?"}, low=NO, high=YES),
        "looked_at": Item({"en": "Seen?"}, low=NO, high=YES),
    },
)  # fmt: skip
SCALE = Questionnaire(
    "Three items of one scale", "own", "own",
    {
        "calm": Item({"en": "Calm"}, low=NO, high=YES, scale="ease"),
        "tense": Item({"en": "Tense"}, low=NO, high=YES, scale="ease", reverse=True),
        "easy": Item({"en": "Easy"}, low=NO, high=YES, scale="ease"),
    },
)  # fmt: skip
CHOICE = Questionnaire(
    "Choice", "own", "own",
    {"alive": Item({"en": "Which?"}, "choice"), "sure": Item({"en": "Sure?"}, low=NO, high=YES)},
)  # fmt: skip
TEXT = Questionnaire("Remarks", "own", "own", {"remarks": Item({"en": "Remarks?"}, "text")})
QUESTIONS = {"paper": PAPER, "calmness": SCALE, "choice": CHOICE, "remarks": TEXT}


def design(
    conditions: tuple[str, ...] = ("walk", "centre"),
    questionnaires: tuple[str, ...] = ("paper",),
    hypotheses: tuple[Hypothesis, ...] | None = None,
    participants: int = 24,
    test: Test = "signed_rank",
) -> StudyDesign:
    """Return a study of ratings; its hypotheses expect the first condition above the second."""
    first, second = conditions[:2]
    if hypotheses is None:
        hypotheses = tuple(
            Hypothesis(f"paper.{item}", first, second, test, ("chi_square", "rank_sum"))
            for item in PAPER.items
        )
    return StudyDesign(
        title="Walk against centre", hypotheses=hypotheses, questionnaires=questionnaires,
        conditions={key: Condition(label=f"the {key}") for key in conditions}, after=("remarks",),
        plan=StatisticalPlan(participants=participants),
    )  # fmt: skip


def pairs(conditions: tuple[str, ...] = ("walk", "centre", "random")) -> StudyDesign:
    """Return a study of choices between pairs."""
    first, second = conditions[:2]
    chosen = Hypothesis("choice.alive", first, second, "sign")
    return replace(design(conditions, ("choice",), (chosen,)), task="pairwise")


def records(
    study: StudyDesign,
    number: int,
    population: Population | None = None,
    questions: Mapping[str, Questionnaire] = QUESTIONS,
    sha256: str = "a" * 64,
) -> list[Record]:
    """Return all that a simulated participant did, from consent to the last page."""
    person = SimulatedParticipant(study, questions, number, population or Population())
    order = participant_order(study, number)
    found: list[Record] = [
        ParticipationOpened(f"P{number:03d}", sha256, order, "0.1.0", UTC, simulated=True),
        ConsentGiven(True, False, True, UTC),
    ]
    for trial, condition in enumerate(order):
        for side, shown in enumerate(condition.split("|")):
            found.append(TrialBegan(trial, 0, shown, UTC, side))
            found.append(TrialEnded(trial, 0, "complete", 30.0, UTC, side))
        found += asked(person, study.questionnaires, trial, condition, questions)
    found += asked(person, study.after, None, "", questions)
    return [*found, ParticipationClosed("finished", "", UTC)]


def asked(
    person: SimulatedParticipant,
    keys: tuple[str, ...],
    trial: int | None,
    condition: str,
    questions: Mapping[str, Questionnaire],
) -> list[Record]:
    """Return the answers to the questionnaires that follow a presentation."""
    return [
        ItemAnswered(trial, condition, key, item, *person.answer(trial, condition, key, item), UTC)
        for key in keys
        for item in questions[key].items
    ]
