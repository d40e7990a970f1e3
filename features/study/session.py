"""One participant's session: its place in the study, the present page, and the events on it.

The place follows from the design and the records alone, so that an interrupted session resumes at
the same place; only a presentation that was in progress starts again.
"""

from collections.abc import Callable, Iterator
from dataclasses import asdict
from typing import Any, Literal, NamedTuple

import msgspec
import numpy as np

import gazerig
from gazerig.errors import Error, HeadEnded
from gazerig.features.study.design import (
    PAIR,
    SEED,
    Item,
    Study,
    participant_order,
    practice_trials,
    rig_changes,
)
from gazerig.features.study.journal import AnswerValue, Journal, JournalRecord
from gazerig.local_head import LocalHead
from gazerig.robot.loop.head_state import HeadState

WHOLE_SHARE = 0.9
"""Share of a film that must be played for a complete presentation."""
_HELD_S = 1.0
"""Time without motion after which a head has lost its condition, seconds."""
_ITEMS = 2  # random stream of the seed; orders use others


class WrongEvent(ValueError):
    """A browser sent data that do not fit the present page."""


class PageEvent(msgspec.Struct):
    """A participant's action on a page.

    page: name of the page; values, ms: answers and response times in the order of the questions
    """

    page: str
    do: str
    values: list[AnswerValue] = []
    ms: list[float] = []


class SessionPlace(NamedTuple):
    """A participant's place in a study.

    trial: practice trials below 0, None outside trials; side: 1 in the second half of a pair
    """

    step: Literal["consent", "ready", "presentation", "questions", "end"]
    trial: int | None = None
    side: int = 0
    questionnaire: str = ""


class StudySession:
    """A participant's session; each event is on disk before the next page is shown.

    Attributes:
        code: Code of the participant, such as P007.

    Args:
        number: number of the participant, which selects the order.
        now_s: returns the time of a steady clock.
        utc: returns date and time.
        head: the head in the room, with the study's rig; None: the browser shows films.
    """

    def __init__(
        self,
        study: Study,
        number: int,
        journal: Journal,
        now_s: Callable[[], float],
        utc: Callable[[], str],
        head: LocalHead | None = None,
        simulated: bool = False,
    ) -> None:
        self.code = f"P{number:03d}"
        self._study, self._design, self._number = study, study.design, number
        self._journal, self._now_s, self._utc, self._head = journal, now_s, utc, head
        practice = practice_trials(self._design, number)
        trials = (*practice, *participant_order(self._design, number))
        self._trials = dict(enumerate(trials, start=-len(practice)))
        self._began_s = float("inf")
        self._shown, self._moved_s = study.rig, now_s()
        self.place = self._find_place()
        if not self.closed:
            self._store(JournalRecord("opened", utc(), gazerig.__version__, simulated))

    @property
    def trial(self) -> str:
        """Return the condition, or the pair "a|b", of the present trial, "" outside trials."""
        return "" if self.place.trial is None else self._trials[self.place.trial]

    @property
    def condition(self) -> str:
        """Return the condition of the next or present presentation."""
        return self.trial.split(PAIR)[self.place.side]

    @property
    def closed(self) -> bool:
        """Return whether the session has ended permanently."""
        return self.place.step == "end"

    @property
    def page(self) -> str:
        """Return the name of the present page, which is the same after a crash."""
        return "-".join(str(part) for part in (self.code, *self.place))

    def page_json(self) -> dict[str, Any]:
        """Return the present page, which contains nothing that distinguishes conditions."""
        design, place, records = self._design, self.place, self._journal.records
        asked = self._study.questionnaires.get(place.questionnaire)
        finished = records[-1].kind == "closed" and not records[-1].note
        return {
            **place._asdict(), "page": self.page, "code": self.code, "film": self._head is None,
            "practice": design.trials.practice, "count": len(self._trials),
            "pairs": design.task == "pairwise", "seconds": design.trials.seconds,
            "contact": design.contact, "welcome": design.welcome,
            "finished": finished, "debriefing": design.debriefing if finished else (),
            "instruction": asked.instruction if asked else "",
            "items": [asdict(item) for _, item in self.items()],
        }  # fmt: skip

    def items(self) -> list[tuple[str, Item]]:
        """Return the items of the present questions by key, in this participant's order."""
        key, trial, design = self.place.questionnaire, self.place.trial, self._design
        if not key:
            return []
        items = list(self._study.questionnaires[key].items.items())
        if self._study.questionnaires[key].shuffled:
            at = (*design.questionnaires, *design.after).index(key)
            row = 0 if trial is None else trial + design.trials.practice + 1
            rng = np.random.default_rng((SEED, self._number, _ITEMS, at, row))
            items = [items[i] for i in rng.permutation(len(items))]
        return items

    def handle(self, event: PageEvent) -> bool:
        """Apply an event; on return it is on disk. Return False if its page is over.

        Raises:
            WrongEvent: it does not fit the page; nothing has changed.
            SetupError: it could not be written; nothing has changed.
            gazerig.Error: the head cannot show the next condition.
        """
        if event.page != self.page:
            return False
        match self.place.step, event.do:
            case "consent", "consent":
                self._store(JournalRecord("consented", self._utc()))
            case ("consent", "decline") | ("ready" | "presentation" | "questions", "leave"):
                self._store(JournalRecord("closed", self._utc(), "withdrew"))
            case "ready", "begin":
                self._begin()
            case "presentation", "seen" if self._head is None:
                shown_s = max(0.0, self._now_s() - self._began_s)
                whole = shown_s >= WHOLE_SHARE * self._design.trials.seconds
                self._record("ended", "" if whole else f"the film was shown for {shown_s:.1f} s")
            case "questions", "answer":
                self._store(*self._answers(event))
            case step, do:
                raise WrongEvent(f"{do} does not fit the page {step}")
        return True

    def poll(self) -> None:
        """End the head's presentation when its time is over; call it often.

        Raises:
            gazerig.Error: the head does not move any more; its presentation has ended.
        """
        if self._head is None or self.closed:
            return
        presenting = self.place.step == "presentation"
        try:
            self._check_head(self._head.state)
        except Error as lost:
            if presenting:
                self._record("ended", f"head lost: {lost}")
            raise
        if presenting and self._now_s() - self._began_s >= self._design.trials.seconds:
            self._record("ended")

    def film_fetched(self) -> None:
        """Note that the browser has the present film; its time begins now."""
        self._began_s = min(self._began_s, self._now_s())

    def _begin(self) -> None:
        place, rig = self.place, self._study.rigs[self.condition]
        if self._head is not None:
            if changes := rig_changes(self._shown, rig):
                self._head.set(changes)
            self._shown = rig
        self._record("began")
        self._began_s = float("inf") if self._head is None else self._now_s()
        self.place = place._replace(step="presentation")

    def _check_head(self, state: HeadState) -> None:
        """Raise an error if the head was stopped, or is held for longer than a moment."""
        now_s = self._now_s()
        if state.stopped:
            raise HeadEnded(f"stopped: {state.stopped}")
        if state.level not in ("hold", "torque_off"):
            self._moved_s = now_s
        if now_s - self._moved_s > _HELD_S:
            raise HeadEnded(f"the joints are held: {'; '.join(state.reasons[:3])}")

    def _record(self, kind: Literal["began", "ended"], note: str = "") -> None:
        """Record that a presentation began or ended."""
        trial, side = self.place.trial, self.place.side
        self._store(
            JournalRecord(kind, self._utc(), note, trial=trial, side=side, condition=self.condition)
        )

    def _answers(self, event: PageEvent) -> Iterator[JournalRecord]:
        items, place, utc = self.items(), self.place, self._utc()
        if not len(items) == len(event.values) == len(event.ms):
            raise WrongEvent(f"{len(items)} questions need as many answers and times")
        for (key, item), value, ms in zip(items, event.values, event.ms, strict=True):
            if not self._is_valid(item, value):
                raise WrongEvent(f"{value!r:.40} is no answer to the question {item.text}")
            yield JournalRecord(
                "answered", utc, trial=place.trial, condition=self.trial,
                questionnaire=place.questionnaire, item=key, value=value, ms=ms,
            )  # fmt: skip

    def _is_valid(self, item: Item, value: AnswerValue) -> bool:
        if item.kind == "text":
            return isinstance(value, str)
        if item.kind == "choice":
            return value in ("first", "second")
        return isinstance(value, int) and 1 <= value <= item.points

    def _store(self, *records: JournalRecord) -> None:
        """Write records to disk, then go to the next place; the last record closes the session."""
        self._journal.write(*records)
        self.place = self._find_place()
        if self.closed and records[-1].kind != "closed":
            self._journal.write(JournalRecord("closed", self._utc()))

    def _find_place(self) -> SessionPlace:
        done: set[object] = set()
        for one in self._journal.records:
            if one.kind == "ended" and not one.note:
                done.add((one.trial, one.side))
            elif one.kind == "answered":
                done.add((one.trial, one.questionnaire))
            else:
                done.add(one.kind)
        if "closed" in done:
            return SessionPlace("end")
        if "consented" not in done:
            return SessionPlace("consent")
        for trial, shown in self._trials.items():
            for side, _ in enumerate(shown.split(PAIR)):
                if (trial, side) not in done:
                    return SessionPlace("ready", trial, side)
            for key in self._design.questionnaires:
                if (trial, key) not in done:
                    return SessionPlace("questions", trial, questionnaire=key)
        for key in self._design.after:
            if (None, key) not in done:
                return SessionPlace("questions", questionnaire=key)
        return SessionPlace("end")
