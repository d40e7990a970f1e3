"""Execution of one participant's session: shows screens and stores answers on disk first.

Conditions are presented by the head in the room, or by films in the browser. All methods may be
called from any thread. A browser's request names its page; a repeated request, or one for a page
that is over, has no effect.
"""

import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, nan
from typing import Protocol

from gazerig.features.study.answers import WrongAnswer
from gazerig.features.study.journal import AnswerValue, Journal, Outcome, Record
from gazerig.features.study.screens import PresentationScreen, ReadyScreen, Screen
from gazerig.features.study.study_session import ShownTrial, StudySession


class HeadLost(Exception):
    """The head cannot show conditions any more; the message gives the reason."""


@dataclass(frozen=True)
class PresentationData:
    """Data of a presentation that has ended; see records.TrialEnded."""

    recording: str = ""
    span_s: tuple[float, float] = (nan, nan)


class Presenter(Protocol):
    """Shows conditions; it is called from one thread at a time."""

    def begin(self, shown: ShownTrial) -> None:
        """Start to show a condition.

        Raises:
            HeadLost: it cannot be shown.
        """

    def end(self) -> PresentationData:
        """End the presentation; return its data."""

    def fault(self) -> str:
        """Return why conditions cannot be shown, "" without a fault."""

    def restart(self) -> None:
        """Try to restart the head after a fault; ``fault`` reports the result."""


class FilmPresenter:
    """Presenter for films that does nothing, because the browser shows them."""

    def begin(self, shown: ShownTrial) -> None:
        """Do nothing."""

    def end(self) -> PresentationData:
        """Report that nothing was recorded."""
        return PresentationData()

    def fault(self) -> str:
        """Report no fault."""
        return ""

    def restart(self) -> None:
        """Do nothing."""


WHOLE_SHARE = 0.9
"""Share of a film that must be played for a complete presentation."""


@dataclass(frozen=True)
class StudyRunState:
    """The session's state for the experimenter.

    Attributes:
        participant: Code.
        screen: The participant's screen.
        trial: Number of the trial, from 0; below 0 in practice, None outside trials.
        trials: Number of trials that count.
        shown: The next or present presentation.
        presenting: Whether it is in progress.
        elapsed_s: Time since its start, 0 without one.
        answers: Number of answers on disk.
        fault: Why conditions cannot be shown, "" without a fault.
        paused: Whether the experimenter has paused the session.
        closed: Whether the session has ended permanently.
    """

    participant: str
    screen: Screen
    trial: int | None
    trials: int
    shown: ShownTrial | None
    presenting: bool
    elapsed_s: float
    answers: int
    fault: str
    paused: bool
    closed: bool


class StudyRun:
    """Runs one participant's session."""

    def __init__(
        self,
        code: str,
        session: StudySession,
        journal: Journal,
        presenter: Presenter,
        now_s: Callable[[], float],
        utc: Callable[[], str],
    ) -> None:
        self._code, self._session, self._journal = code, session, journal
        self._presenter, self._now_s, self._utc = presenter, now_s, utc
        self._lock = threading.RLock()
        self._began_s = 0.0
        self._fetched_s = nan
        self._fault = ""
        self._store_records(session.resume_session(utc()))
        # The page's time in an earlier run of the program is unknown.
        self._asked_s = nan

    def now(self) -> tuple[str, Screen]:
        """Return the name of the participant's page, and its screen."""
        with self._lock:
            return self._session.page, self._session.screen

    def state(self) -> StudyRunState:
        """Return the state for the experimenter."""
        with self._lock:
            session, screen = self._session, self._session.screen
            presenting = isinstance(screen, PresentationScreen)
            return StudyRunState(
                self._code, screen, session.trial, len(session.order), session.shown, presenting,
                self._now_s() - self._began_s if presenting else 0.0,
                sum(type(one).__name__ == "ItemAnswered" for one in self._journal.records),
                self._fault, session.paused, session.closed,
            )  # fmt: skip

    def consent(self, page: str, given: bool, pictures: bool, gaze: bool) -> None:
        """Record the decision on the consent page.

        Raises:
            WriteFailed: it could not be written.
        """
        with self._lock:
            if page == self._session.page:
                self._store_records(self._session.consent(given, pictures, gaze, self._utc()))

    def leave_page(self, page: str) -> None:
        """Leave the instructions or a rest.

        Raises:
            WrongAnswer: the page is neither of them.
        """
        with self._lock:
            if page == self._session.page:
                self._session.leave_page()

    def begin(self, page: str) -> None:
        """Start the presentation.

        A head that cannot show it pauses the session, until the experimenter continues.

        Raises:
            WriteFailed: its start could not be written; it does not start.
            WrongAnswer: the page is not before a presentation.
        """
        with self._lock:
            if page != self._session.page or not isinstance(self._session.screen, ReadyScreen):
                return
            shown = self._session.shown
            assert shown is not None  # a screen before a presentation
            try:
                self._presenter.begin(shown)
            except HeadLost as lost:
                self._fault, self._session.paused = str(lost), True
                return
            self._store_records(self._session.begin(self._utc()))
            self._began_s, self._fetched_s = self._now_s(), nan

    def film_fetched(self, token: str) -> None:
        """Note that the participant's browser has fetched the whole film of this name."""
        with self._lock:
            if not isfinite(self._fetched_s) and self._session.film_of(token) is not None:
                self._fetched_s = self._now_s()

    def film_ended(self, page: str, seconds: float) -> None:
        """Record the end of a film; a film that was cut short starts again.

        Args:
            page: page of the film.
            seconds: played time, as reported by the browser. It is limited to the time since the
                browser has the film; a film that was not fetched was not played.

        Raises:
            WriteFailed: it could not be written.
        """
        with self._lock:
            screen = self._session.screen
            if page != self._session.page or not isinstance(screen, PresentationScreen):
                return
            if not screen.film:
                return  # the host's clock decides for a head
            fetched = isfinite(self._fetched_s)
            longest_s = self._now_s() - self._fetched_s if fetched else 0.0
            seconds = min(max(seconds, 0.0), longest_s) if isfinite(seconds) else 0.0
            whole = seconds >= WHOLE_SHARE * screen.seconds
            reason = "the film was not shown whole" if fetched else "the film was not fetched"
            self._end("complete" if whole else "interrupted", "" if whole else reason, seconds)

    def poll(self) -> None:
        """End the presentation when its time is over or the head is lost; call it often.

        Raises:
            WriteFailed: the end could not be written; the next call tries again.
        """
        with self._lock:
            fault = self._presenter.fault()
            self._fault = fault or ("" if not self._session.paused else self._fault)
            screen = self._session.screen
            if not isinstance(screen, PresentationScreen) or self._session.closed:
                return
            if fault:
                self._end("head_lost", fault)
                self._session.paused = True
            elif not screen.film and self._now_s() - self._began_s >= screen.seconds:
                self._end("complete", "")

    def answer(self, page: str, values: Mapping[int, AnswerValue], ms: Mapping[int, float]) -> None:
        """Record a page of answers; on return they are on disk.

        Args:
            page: page of the questions.
            values: answers by the questions' numbers.
            ms: response times as reported by the browser, limited to the time the page was shown.

        Raises:
            WriteFailed: they could not be written, and the page still needs answers.
            WrongAnswer: an answer is missing or invalid.
        """
        with self._lock:
            if page == self._session.page:
                longest_ms = 1000.0 * (self._now_s() - self._asked_s)
                self._store_records(self._session.answer(values, ms, self._utc(), longest_ms))

    def withdraw(self) -> None:
        """Record the participant's withdrawal.

        Raises:
            WriteFailed: it could not be written.
        """
        with self._lock:
            self._end_with_records(self._session.withdraw(self._utc()))

    def film_of(self, token: str) -> str | None:
        """Return the condition of the film that is shown now, None for another name."""
        with self._lock:
            return self._session.film_of(token)

    def pause(self, paused: bool) -> None:
        """Prevent further presentations, or allow them again and restart a lost head."""
        with self._lock:
            if not paused and self._presenter.fault():
                self._presenter.restart()
                self._fault = self._presenter.fault()
                if self._fault:
                    return
            self._session.paused = paused
            if not paused:
                self._fault = ""

    def repeat(self) -> None:
        """Repeat the present presentation.

        Raises:
            WriteFailed: it could not be written.
            WrongAnswer: no presentation is in progress.
        """
        with self._lock:
            if not isinstance(self._session.screen, PresentationScreen):
                raise WrongAnswer("no presentation is in progress")
            self._end("interrupted", "the experimenter had it repeated")

    def exclude(self, reason: str) -> None:
        """Exclude the participant.

        Raises:
            WriteFailed: it could not be written.
        """
        with self._lock:
            self._end_with_records(self._session.exclude(reason, self._utc()))

    def _end(self, outcome: Outcome, reason: str, seconds: float = nan) -> None:
        """End the present presentation; seconds: its duration, nan: the time since its start."""
        if not isfinite(seconds):
            seconds = self._now_s() - self._began_s
        what = self._presenter.end()
        ended = (outcome, seconds, self._utc(), reason, what.recording, what.span_s)
        self._store_records(self._session.end(*ended))

    def _end_with_records(self, records: Sequence[Record]) -> None:
        presenting = isinstance(self._session.screen, PresentationScreen)
        self._store_records(records)
        if presenting:
            self._presenter.end()

    def _store_records(self, records: Sequence[Record]) -> None:
        """Write records to disk, then apply them; write the last record at the end."""
        self._journal.write(records)
        self._session.add(records)
        self._asked_s = self._now_s()
        end = self._session.finish(self._utc())
        self._journal.write(end)
        self._session.add(end)
