"""One participant's session: progress, the present screen, and its records.

Progress follows from the design and the records alone, so that an interrupted session resumes at
the same place; only a presentation that was in progress starts again. Methods propose records; they
take effect with ``add``, once they are on disk.
"""

import hashlib
import hmac
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Literal

import numpy as np

from gazerig.features.study.answers import WrongAnswer, check_answer
from gazerig.features.study.design import StudyDesign
from gazerig.features.study.journal import (
    AnswerValue,
    ConsentGiven,
    ItemAnswered,
    Outcome,
    ParticipationClosed,
    ParticipationOpened,
    Record,
    TrialBegan,
    TrialEnded,
)
from gazerig.features.study.questionnaire import Item, Questionnaire
from gazerig.features.study.screens import (
    ConsentScreen,
    Ending,
    EndScreen,
    InstructionsScreen,
    PausedScreen,
    PresentationScreen,
    Question,
    QuestionsScreen,
    ReadyScreen,
    RestScreen,
    Screen,
)
from gazerig.features.study.trial_order import PAIR, participant_order, practice_trials

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
        warm_up = practice_trials(design, participant)
        self.order = participant_order(design, participant)
        self.trials = dict(enumerate((*warm_up, *self.order), start=-len(warm_up)))
        self.began: TrialBegan | None = None
        self.consented: ConsentGiven | None = None
        self.closed: ParticipationClosed | None = None
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
                case ConsentGiven():
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
                case ParticipationClosed():
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


INTERRUPTED = "the program ended"
_ITEMS = 2
"""Random stream of the trials' seed; orders use others."""


@dataclass(frozen=True)
class ShownTrial:
    """The next or present presentation; for the experimenter and the head only."""

    trial: int
    attempt: int
    side: int
    condition: str


@dataclass(frozen=True)
class AskedItems:
    """A page of questions by its keys; see records.ItemAnswered.

    items: in the order in which they are shown
    """

    trial: int | None
    condition: str
    questionnaire: str
    items: tuple[str, ...]


class StudySession:
    """A participant's session.

    Attributes:
        paused: The experimenter must act first: no presentation begins.

    Args:
        design: a checked design.
        questionnaires: by the keys in the design.
        participant: from 1; it selects the order.
        secret: key for unguessable names of pages and films.
        records: the participant's previous records.
    """

    def __init__(
        self,
        design: StudyDesign,
        questionnaires: Mapping[str, Questionnaire],
        participant: int,
        secret: bytes,
        records: Sequence[Record] = (),
    ) -> None:
        self.design, self.participant = design, participant
        self.paused = False
        self._questionnaires, self._secret = questionnaires, secret
        self._progress = StudyProgress(design, participant)
        self.add(records)

    @property
    def order(self) -> tuple[str, ...]:
        """Return the trials that count: condition keys, or pairs "a|b"."""
        return self._progress.order

    @property
    def screen(self) -> Screen:
        """Return the participant's present screen."""
        place, design = self._progress.place, self.design
        if self.paused and place.step == "ready":
            return PausedScreen()
        match place.step:
            case "consent":
                return self._consent_screen()
            case "instructions":
                trials = design.trials
                return InstructionsScreen(len(self.order), trials.practice, trials.seconds)
            case "rest":
                return RestScreen(design.trials.rest_s)
            case "ready":
                return ReadyScreen(*self._number(place), place.side, place.attempt > 0)
            case "presentation":
                film = self._token("film", place) if design.presentation.on == "film" else ""
                return PresentationScreen(
                    *self._number(place), place.side, design.trials.seconds, film
                )
            case "questions":
                return self._questions(place)
        return EndScreen(self._ending)

    @property
    def page(self) -> str:
        """Return the name of the present screen, which is the same after a crash."""
        return self._token(
            "paused" if self.screen == PausedScreen() else "page", self._progress.place
        )

    @property
    def shown(self) -> ShownTrial | None:
        """Return the next or present presentation, None between them."""
        place = self._progress.place
        if place.step not in ("ready", "presentation") or place.trial is None:
            return None
        condition = self._progress.trials[place.trial].split(PAIR)[place.side]
        return ShownTrial(place.trial, place.attempt, place.side, condition)

    @property
    def asked(self) -> "AskedItems | None":
        """Return the present questions, None without any; for the program only."""
        place = self._progress.place
        if place.step != "questions":
            return None
        keys = tuple(key for key, _ in self._items(place))
        condition = "" if place.trial is None else self._progress.trials[place.trial]
        return AskedItems(place.trial, condition, place.questionnaire, keys)

    @property
    def trial(self) -> int | None:
        """Return the participant's trial, practice trials below 0; None outside."""
        return self._progress.place.trial

    @property
    def closed(self) -> bool:
        """Return whether the session has ended permanently."""
        return self._progress.closed is not None

    def consent_given(self) -> tuple[bool, bool]:
        """Return whether the participant's gaze may be stored, and camera pictures."""
        said = self._progress.consented
        return (False, False) if said is None else (said.gaze, said.pictures)

    def film_of(self, token: str) -> str | None:
        """Return the condition of the film that is shown under this name, None for another name."""
        place, shown = self._progress.place, self.shown
        if shown is None or place.step != "presentation":
            return None
        known = hmac.compare_digest(token.encode(), self._token("film", place).encode())
        return shown.condition if known else None

    def open_session(
        self, code: str, design_sha256: str, program: str, utc: str, simulated: bool = False
    ) -> ParticipationOpened:
        """Return the record of the start or resumption of a session."""
        return ParticipationOpened(code, design_sha256, self.order, program, utc, simulated)

    def resume_session(self, utc: str) -> tuple[Record, ...]:
        """Return the records of a presentation that was interrupted by the end of the program."""
        if self._progress.began is None:
            return ()
        return self._end_presentation("interrupted", nan, utc, INTERRUPTED)

    def consent(self, given: bool, pictures: bool, gaze: bool, utc: str) -> tuple[Record, ...]:
        """Return the records of a decision on the consent page.

        Raises:
            WrongAnswer: another screen is shown.
        """
        self._require_step("consent")
        asked = self._consent_screen()
        uses = given and pictures and asked.pictures, given and gaze and asked.gaze
        said = ConsentGiven(given, *uses, utc)
        return (said,) if given else (said, ParticipationClosed("withdrawn", "no consent", utc))

    def _consent_screen(self) -> ConsentScreen:
        camera, kept = self.design.presentation.on == "head", self.design.privacy
        return ConsentScreen(camera and kept.pictures, camera and kept.gaze)

    def leave_page(self) -> None:
        """Leave the instructions or a rest, of which nothing is recorded.

        Raises:
            WrongAnswer: another screen is shown.
        """
        self._require_step("instructions", "rest")
        self._progress.leave_place(self._progress.place)

    def begin(self, utc: str) -> tuple[Record, ...]:
        """Return the record of the presentation that begins now.

        Raises:
            WrongAnswer: no presentation can begin.
        """
        self._require_step("ready")
        shown = self.shown
        if shown is None or self.paused:
            raise WrongAnswer("the experimenter has paused the study")
        return (TrialBegan(shown.trial, shown.attempt, shown.condition, utc, shown.side),)

    def end(
        self,
        outcome: Outcome,
        seconds: float,
        utc: str,
        reason: str = "",
        recording: str = "",
        span_s: tuple[float, float] = (nan, nan),
    ) -> tuple[Record, ...]:
        """Return the record of the presentation that ends now.

        Args:
            outcome: outcome of the presentation.
            seconds: its duration.
            utc: its end.
            reason: why it was not completed.
            recording: its file next to the journal.
            span_s: its start and end in the recording's time.

        Raises:
            WrongAnswer: no presentation is in progress.
        """
        self._require_step("presentation")
        return self._end_presentation(outcome, seconds, utc, reason, recording, span_s)

    def answer(
        self,
        values: Mapping[int, AnswerValue],
        ms: Mapping[int, float],
        utc: str,
        longest_ms: float,
    ) -> tuple[Record, ...]:
        """Return the records of a page of answers, by the questions' numbers.

        Args:
            values: answers.
            ms: response times as reported by the browser.
            utc: the time.
            longest_ms: how long the page was shown by the host's clock, nan: unknown.

        Raises:
            WrongAnswer: no questions are shown, or an answer is missing or invalid.
        """
        self._require_step("questions")
        asked, items = self.asked, self._items(self._progress.place)
        assert asked is not None  # a page of questions
        if unknown := set(values) - set(range(len(items))):
            raise WrongAnswer(f"there is no question {min(unknown)}")
        at = (asked.trial, asked.condition, asked.questionnaire)
        records = []
        for number, (key, item) in enumerate(items):
            value = check_answer(number, item, values.get(number), self.design.may_skip)
            late = ms.get(number, nan)
            known = isfinite(late) and late >= 0.0 and isfinite(longest_ms)
            late = min(late, longest_ms) if known else nan
            records.append(ItemAnswered(*at, key, value, late, utc))
        return tuple(records)

    def finish(self, utc: str) -> tuple[Record, ...]:
        """Return the record of the end, once nothing remains to show or ask."""
        if self.closed or self._progress.place.step != "end":
            return ()
        return (ParticipationClosed("finished", "", utc),)

    def withdraw(self, utc: str) -> tuple[Record, ...]:
        """Return the records of a participant's withdrawal."""
        if self.closed:
            return ()
        return (
            *self._end_presentation("withdrawn", nan, utc),
            ParticipationClosed("withdrawn", "", utc),
        )

    def exclude(self, reason: str, utc: str) -> tuple[Record, ...]:
        """Return the records of the experimenter's exclusion of the participant."""
        if self.closed:
            return ()
        return (
            *self._end_presentation("interrupted", nan, utc, reason),
            ParticipationClosed("excluded", reason, utc),
        )

    def add(self, records: Iterable[Record]) -> None:
        """Apply records that are on disk."""
        self._progress.add(records)

    def _end_presentation(
        self,
        outcome: Outcome,
        seconds: float,
        utc: str,
        reason: str = "",
        recording: str = "",
        span_s: tuple[float, float] = (nan, nan),
    ) -> tuple[Record, ...]:
        """Return the record of the end of the present presentation, none without one."""
        began = self._progress.began
        if began is None:
            return ()
        at = (began.trial, began.attempt)
        return (TrialEnded(*at, outcome, seconds, utc, began.side, recording, reason, *span_s),)

    @property
    def _ending(self) -> Ending:
        closed, consented = self._progress.closed, self._progress.consented
        if closed is None:
            return "finished"
        return "declined" if consented is not None and not consented.given else closed.outcome

    def _number(self, place: StudyPlace) -> tuple[int, int, bool, bool]:
        """Return the trial's number, the number of trials, whether it is practice, and of pairs."""
        pair = self.design.task == "pairwise"
        if place.trial is None:
            return 0, 0, False, pair
        if place.trial < 0:
            warm_up = self.design.trials.practice
            return place.trial + warm_up + 1, warm_up, True, pair
        return place.trial + 1, len(self.order), False, pair

    def _items(self, place: StudyPlace) -> list[tuple[str, Item]]:
        """Return the items of a page in this participant's order."""
        asked = self._questionnaires[place.questionnaire]
        items = list(asked.items.items())
        if not asked.shuffled:
            return items
        every = (*self.design.questionnaires, *self.design.after)
        trials = self.design.trials
        # Seeds are not negative, but the numbers of practice trials are.
        row = 0 if place.trial is None else place.trial + trials.practice + 1
        key = (trials.seed, self.participant, _ITEMS, every.index(place.questionnaire), row)
        return [items[i] for i in np.random.default_rng(key).permutation(len(items))]

    def _questions(self, place: StudyPlace) -> QuestionsScreen:
        instruction = self._questionnaires[place.questionnaire].instruction
        questions = tuple(Question(i, item) for i, (_, item) in enumerate(self._items(place)))
        return QuestionsScreen(*self._number(place), place.trial is None, instruction, questions)

    def _token(self, kind: str, place: StudyPlace) -> str:
        text = f"{kind} {self.participant} {place}"
        return hmac.new(self._secret, text.encode(), hashlib.sha256).hexdigest()[:20]

    def _require_step(self, *steps: Step) -> None:
        step = self._progress.place.step
        if step not in steps:
            raise WrongAnswer(f"this page is over; the participant is at: {step}")
