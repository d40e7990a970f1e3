"""Sessions of simulated participants, with the same screens and journals as real ones."""

from collections.abc import Callable
from datetime import UTC, datetime, timedelta

import gazerig
from gazerig.drivers.errors import SetupError
from gazerig.features.study.data_folder import StudyData, participant_code
from gazerig.features.study.journal import AnswerValue, Journal, TrialEnded, TrialMeasured
from gazerig.features.study.run.participant import open_journal
from gazerig.features.study.run.study_file import LoadedStudy
from gazerig.features.study.screens import (
    ConsentScreen,
    EndScreen,
    InstructionsScreen,
    PresentationScreen,
    QuestionsScreen,
    ReadyScreen,
    RestScreen,
)
from gazerig.features.study.simulation import Population, SimulatedParticipant
from gazerig.features.study.study_run import FilmPresenter, StudyRun
from gazerig.features.study.study_session import StudySession

_BEGAN = datetime(2000, 1, 1, tzinfo=UTC)
_MOST_SCREENS = 100_000


def simulate_study(
    study: LoadedStudy,
    data: StudyData,
    count: int,
    population: Population,
    progress: Callable[[float], None] = lambda share: None,
) -> None:
    """Run participants 1 to ``count`` through a study; equal seeds give equal journals.

    Raises:
        SetupError: the folder has data of participants, or the data cannot be written.
    """
    if data.numbers():
        raise SetupError(
            f"{data.folder} has data of participants: simulated ones go to a folder of their own, "
            "--data NEW_FOLDER"
        )
    sha256 = data.claim(study.name, study.canonical)
    for number in range(1, count + 1):
        with open_journal(study, data, number, sha256) as journal:
            _simulate(study, journal, number, population, sha256, data.secret())
        progress(number / count)


def _simulate(
    study: LoadedStudy,
    journal: Journal,
    number: int,
    population: Population,
    sha256: str,
    secret: bytes,
) -> None:
    """Run one participant, in simulated time."""
    now_s = [0.0]

    def utc() -> str:
        return (_BEGAN + timedelta(days=number, seconds=now_s[0])).isoformat(timespec="seconds")

    session = StudySession(study.design, study.questionnaires, number, secret)
    code = participant_code(number)
    journal.write((session.open_session(code, sha256, gazerig.__version__, utc(), simulated=True),))
    run = StudyRun(code, session, journal, FilmPresenter(), lambda: now_s[0], utc)
    person = SimulatedParticipant(study.design, study.questionnaires, number, population)
    for _ in range(_MOST_SCREENS):
        page, screen = run.now()
        match screen:
            case ConsentScreen():
                run.consent(page, True, True, True)
            case InstructionsScreen():
                run.leave_page(page)
            case RestScreen():
                now_s[0] += screen.seconds
                run.leave_page(page)
            case ReadyScreen():
                run.begin(page)
            case PresentationScreen():
                run.film_fetched(screen.film)
                now_s[0] += screen.seconds
                run.film_ended(page, screen.seconds)
                run.poll()
            case QuestionsScreen():
                values, ms = _answers(session, person)
                now_s[0] += sum(ms.values()) / 1000.0
                run.answer(page, values, ms)
            case EndScreen():
                break
    ended = [one for one in journal.records if isinstance(one, TrialEnded)]
    if study.design.objective:
        shown = {**dict(enumerate(session.order))}
        journal.write([
            TrialMeasured(one.trial, shown[one.trial], person.simulate_measures(one.trial, shown[one.trial]))
            for one in ended
            if one.trial in shown and shown[one.trial] in study.design.conditions
        ])  # fmt: skip


def _answers(
    session: StudySession, person: SimulatedParticipant
) -> tuple[dict[int, AnswerValue], dict[int, float]]:
    """Return the answers to a page and the milliseconds of each, by number."""
    asked = session.asked
    assert asked is not None  # a page of questions
    values: dict[int, AnswerValue] = {}
    ms: dict[int, float] = {}
    for number, item in enumerate(asked.items):
        said = person.answer(asked.trial, asked.condition, asked.questionnaire, item)
        values[number], ms[number] = said
    return values, ms
