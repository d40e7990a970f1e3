"""Participants who answer in tests: a study run without a browser or a head."""

from collections.abc import Callable
from itertools import count
from pathlib import Path

from gazerig.features.study.journal import Journal
from gazerig.features.study.run.study_file import LoadedStudy
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
from gazerig.features.study.study_run import FilmPresenter, Presenter, StudyRun
from gazerig.features.study.study_session import StudySession

UTC = "2026-01-01T00:00:00+00:00"


def run_of(
    study: LoadedStudy,
    folder: Path,
    number: int = 1,
    presenter: Presenter | None = None,
    now_s: Callable[[], float] | None = None,
) -> tuple[StudyRun, Journal]:
    """Return a session that is begun or resumed, and its open journal.

    now_s: its clock, None: a clock that advances by a minute per call
    """
    journal = Journal(folder)
    known = journal.records
    session = StudySession(study.design, study.questionnaires, number, b"secret", known)
    journal.write((session.open_session(f"P{number:03d}", "0" * 64, "test", UTC),))
    shows = presenter or FilmPresenter()
    now_s = now_s or count(0.0, 60.0).__next__
    return StudyRun(f"P{number:03d}", session, journal, shows, now_s, lambda: UTC), journal


def step(run: StudyRun, value: int = 2) -> Screen:
    """Do what the screen asks for, as a browser does; return that screen."""
    page, screen = run.now()
    match screen:
        case ConsentScreen():
            run.consent(page, True, True, True)
        case InstructionsScreen() | RestScreen():
            run.leave_page(page)
        case ReadyScreen():
            run.begin(page)
        case PresentationScreen():
            run.film_fetched(screen.film)
            run.film_ended(page, screen.seconds)
        case QuestionsScreen():
            values: dict[int, int | str] = {}
            for question in screen.questions:
                answers: dict[str, int | str] = {"rating": value, "choice": "first", "text": "well"}
                values[question.number] = answers[question.item.kind]
            run.answer(page, values, dict.fromkeys(values, 900.0))
        case PausedScreen():
            run.pause(False)
        case EndScreen():
            pass
    return screen


def screens(run: StudyRun, most: int = 300) -> list[Screen]:
    """Return all screens up to the end."""
    seen = []
    for _ in range(most):
        seen.append(step(run))
        if isinstance(seen[-1], EndScreen):
            return seen
    raise AssertionError(f"no end after {most} screens")
