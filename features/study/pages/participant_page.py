"""The participant's page as JSON that does not distinguish conditions, and its events."""

from collections.abc import Mapping

import msgspec

from gazerig.features.study.design import StudyDesign
from gazerig.features.study.journal import AnswerValue
from gazerig.features.study.questionnaire import Item, Texts
from gazerig.features.study.screens import (
    ConsentScreen,
    EndScreen,
    InstructionsScreen,
    PausedScreen,
    PresentationScreen,
    QuestionsScreen,
    ReadyScreen,
    RestScreen,
    Screen,
)
from gazerig.features.study.study_run import StudyRun

Json = dict[str, object]
CONDITIONS_ARE_TOLD = "finished"
"""Ending of a session after which the debriefing is sent."""


def page_json(screen: Screen, design: StudyDesign, code: str) -> Json:
    """Return a screen as JSON for the participant's page."""
    match screen:
        case ConsentScreen():
            uses = {"gaze": screen.gaze, "pictures": screen.pictures}
            return {
                "kind": "consent",
                "code": code,
                "welcome": design.texts.welcome,
                "uses": [use for use, asked in uses.items() if asked],
                "camera": design.presentation.on == "head",
                "days": design.privacy.deleted_after_days,
                "contact": design.privacy.contact,
            }
        case InstructionsScreen():
            return {
                "kind": "instructions",
                "on": design.presentation.on,
                "pairs": design.task == "pairwise",
                "count": screen.trials,
                "practice": screen.practice,
                "seconds": screen.seconds,
            }
        case ReadyScreen():
            return {
                "kind": "ready",
                **_place(screen),
                "on": design.presentation.on,
                "seconds": design.trials.seconds,
                "again": screen.again,
            }
        case PresentationScreen():
            film = f"/study/film/{screen.film}" if screen.film else None
            # A film that was cut short starts again at the participant's request.
            more: Json = {"on": design.presentation.on, "seconds": screen.seconds, "again": True}
            return {"kind": "presentation", **_place(screen), **more, "film": film}
        case QuestionsScreen():
            language = design.language
            return {
                "kind": "questions",
                **_place(screen),
                "after": screen.once,
                "may_skip": design.may_skip,
                "instruction": _in_language(screen.instruction, language),
                "instruction_language": language if language in screen.instruction else "en",
                "items": [_item(str(one.number), one.item, language) for one in screen.questions],
            }
        case RestScreen():
            return {"kind": "rest", "seconds": screen.seconds}
        case PausedScreen():
            return {"kind": "paused"}
        case EndScreen():
            told: Mapping[str, object] = {"text": design.texts.debriefing, "code": code}
            return {
                "kind": "end",
                "outcome": screen.outcome,
                "contact": design.privacy.contact,
                "code": "" if screen.outcome == "declined" else code,
                **(told if screen.outcome == CONDITIONS_ARE_TOLD else {"text": ()}),
            }


def _place(screen: ReadyScreen | PresentationScreen | QuestionsScreen) -> Json:
    step = {"n": screen.number, "of": screen.trial_count, "practice": screen.practice}
    side = None if isinstance(screen, QuestionsScreen) or not screen.pair else screen.side
    return {"step": step if screen.trial_count else None, "side": side}


def _item(number: str, item: Item, language: str) -> Json:
    """Return a question without its key in the design and its scale."""
    texts = [one for one in (item.text, item.low, item.high) if one]
    spoken = language if all(language in one for one in texts) else "en"
    return {
        "key": number,
        "kind": item.kind,
        "points": item.points,
        "language": spoken,
        "text": _in_language(item.text, spoken),
        "low": _in_language(item.low, spoken),
        "high": _in_language(item.high, spoken),
    }


def _in_language(texts: Texts, language: str) -> str:
    return texts.get(language, texts.get("en", ""))


_MOST_ITEMS = 500


class Malformed(ValueError):
    """A browser sent data that are not an event of a page."""


class ParticipantEvent(msgspec.Struct, tag_field="do"):
    """One action.

    page: name of its page; once: identifies this event and its repetitions
    """

    page: str
    once: str

    def tell(self, run: StudyRun) -> None:
        """Apply it to the session; on return it is on disk.

        Raises:
            WriteFailed: it could not be written.
            WrongAnswer: it does not fit the page.
        """
        raise NotImplementedError


class _Consent(ParticipantEvent, tag="consent"):
    given: bool
    uses: list[str]

    def tell(self, run: StudyRun) -> None:
        """Record the decision."""
        run.consent(self.page, self.given, "pictures" in self.uses, "gaze" in self.uses)


class _Next(ParticipantEvent, tag="next"):
    def tell(self, run: StudyRun) -> None:
        """Leave the page."""
        run.leave_page(self.page)


class _Begin(ParticipantEvent, tag="begin"):
    def tell(self, run: StudyRun) -> None:
        """Start the presentation."""
        run.begin(self.page)


class _FilmSeen(ParticipantEvent, tag="seen"):
    seconds: float

    def tell(self, run: StudyRun) -> None:
        """Record the time of the film that was seen."""
        run.film_ended(self.page, self.seconds)


class _GivenAnswer(msgspec.Struct):
    """An answer; key: number of the question on the page; ms: since the page appeared."""

    key: str
    value: int | str | None
    ms: float


class _Answers(ParticipantEvent, tag="answer"):
    answers: list[_GivenAnswer]

    def tell(self, run: StudyRun) -> None:
        """Record the answers."""
        values: Mapping[int, AnswerValue] = {_number(one): one.value for one in self.answers}
        run.answer(self.page, values, {_number(one): one.ms for one in self.answers})


class _Withdraw(ParticipantEvent, tag="withdraw"):
    def tell(self, run: StudyRun) -> None:
        """Leave the study."""
        run.withdraw()


_DECODER = msgspec.json.Decoder(_Consent | _Next | _Begin | _FilmSeen | _Answers | _Withdraw)


def parse_event(body: bytes) -> ParticipantEvent:
    """Return the event in a request of a browser.

    Raises:
        Malformed: it is not JSON, or not an event of a page.
    """
    try:
        event: ParticipantEvent = _DECODER.decode(body)
    except (msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
        raise Malformed(f"not an event of a page: {error}") from None
    if isinstance(event, _Answers):
        numbers = [_number(one) for one in event.answers]
        if len(numbers) > _MOST_ITEMS or len(set(numbers)) < len(numbers):
            raise Malformed("too many answers, or two of one question")
    return event


def _number(answer: _GivenAnswer) -> int:
    if not (answer.key.isascii() and answer.key.isdigit() and len(answer.key) <= 3):
        raise Malformed(f"{answer.key!r:.20} is no question")
    return int(answer.key)
