"""Progress of a participant, which follows from the design and the records alone.

A session that was interrupted resumes at the same place; only a presentation that was in progress
starts again.
"""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from gazerig.features.study.design import StudyDesign
from gazerig.features.study.order import orders, practice
from gazerig.features.study.records import (
    Closed,
    Consented,
    ItemAnswered,
    Record,
    TrialBegan,
    TrialEnded,
)

Step = Literal["consent", "instructions", "rest", "ready", "presentation", "questions", "end"]


@dataclass(frozen=True)
class StudyPlace:
    """A participant's place in a study.

    trial: practice trials below 0, None outside trials; side: 1 in the second half of a pair
    questionnaire: key of the present questionnaire, "" without one
    """

    step: Step
    trial: int | None = None
    side: int = 0
    attempt: int = 0
    questionnaire: str = ""


class StudyProgress:
    """The completed steps of a participant, and the next one.

    Attributes:
        order: Condition keys, or pairs "a|b", of the trials that count.
        trials: The same by number, practice trials below 0.
        began: The presentation in progress.
        consented, closed: The decision and the end, None before.

    Args:
        design: a checked design.
        participant: from 1; it selects the order.
    """

    def __init__(self, design: StudyDesign, participant: int) -> None:
        self._design = design
        warm_up = practice(design, participant)
        self.order = orders(design, participant)
        self.trials = dict(enumerate((*warm_up, *self.order), start=-len(warm_up)))
        self.began: TrialBegan | None = None
        self.consented: Consented | None = None
        self.closed: Closed | None = None
        self._sides = 2 if design.task == "pairwise" else 1
        self._attempts: dict[tuple[int, int], int] = {}
        self._lost: Counter[int] = Counter()
        self._seen: set[tuple[int, int]] = set()
        self._answered: set[tuple[int | None, str]] = set()
        self._passed: set[StudyPlace] = set()

    def add(self, records: Iterable[Record]) -> None:
        """Apply records that are on disk."""
        for one in records:
            match one:
                case Consented():
                    self.consented = one
                case TrialBegan():
                    self.began = one
                    self._attempts[one.trial, one.side] = one.attempt
                case TrialEnded(outcome="complete"):
                    self.began = None
                    self._seen.add((one.trial, one.side))
                case TrialEnded():
                    self.began = None
                    self._attempts[one.trial, one.side] = one.attempt + 1
                    self._lost[one.trial] += one.outcome == "head_lost"
                case ItemAnswered():
                    self._answered.add((one.trial, one.questionnaire))
                case Closed():
                    self.closed = one

    def leave_place(self, place: StudyPlace) -> None:
        """Leave a place without a record: the instructions, a rest."""
        self._passed.add(place)

    @property
    def place(self) -> StudyPlace:
        """Return the participant's place."""
        if self.closed is not None:
            return StudyPlace("end")
        if self.consented is None:
            return StudyPlace("consent")
        if (start := StudyPlace("instructions")) not in self._passed and not self._attempts:
            return start
        for trial in self.trials:
            if place := self._place_in_trial(trial):
                return place
        for key in self._design.after:
            if (None, key) not in self._answered:
                return StudyPlace("questions", questionnaire=key)
        return StudyPlace("end")

    def _place_in_trial(self, trial: int) -> StudyPlace | None:
        """Return the participant's place in a trial, None after its end."""
        rule = self._design.exclusion
        if self._lost[trial] > (rule.repeats if rule.lost_head == "repeat" else 0):
            return None
        every = self._design.trials.rest_every
        untouched = all((trial, side) not in self._attempts for side in range(self._sides))
        if every and trial > 0 and trial % every == 0 and untouched:
            rest = StudyPlace("rest", trial)
            if rest not in self._passed:
                return rest
        for side in range(self._sides):
            if (trial, side) not in self._seen:
                attempt = self._attempts.get((trial, side), 0)
                return StudyPlace("presentation" if self.began else "ready", trial, side, attempt)
        for key in self._design.questionnaires:
            if (trial, key) not in self._answered:
                return StudyPlace("questions", trial, questionnaire=key)
        return None
