"""Events of a participant's browser: one action on one page."""

from collections.abc import Mapping

import msgspec

from gazerig.features.study.records import AnswerValue
from gazerig.features.study.study_run import StudyRun

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
        run.go_on(self.page)


class _Begin(ParticipantEvent, tag="begin"):
    def tell(self, run: StudyRun) -> None:
        """Start the presentation."""
        run.begin(self.page)


class _FilmSeen(ParticipantEvent, tag="seen"):
    seconds: float

    def tell(self, run: StudyRun) -> None:
        """Record how much of the film was seen."""
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
