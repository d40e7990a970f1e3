"""One participant's session: data folder, journal, pages, and films or the head."""

import hashlib
import hmac
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import gazerig
from gazerig.drivers.errors import SetupError
from gazerig.features.study.data_folder import StudyData, participant_code
from gazerig.features.study.journal import Journal, ParticipationOpened, WriteFailed
from gazerig.features.study.pages.server import StudyServer
from gazerig.features.study.participation import check_records
from gazerig.features.study.run.head_presenter import HeadPresenter
from gazerig.features.study.run.study_file import LoadedStudy
from gazerig.features.study.study_run import FilmPresenter, StudyRun
from gazerig.features.study.study_session import StudySession
from gazerig.robot.app.options import RunOptions
from gazerig.robot.model.clock import Clock

_POLL_S = 0.05
_TOKEN_DIGITS = 32


@dataclass(frozen=True)
class SessionPlan:
    """Settings of a session.

    Attributes:
        study: A checked study.
        data: Its data folder.
        number: Number of the participant, from 1.
        address: Host and port of the pages.
        films: Film of each condition; empty with a head.
        head: Options of the head's run, None with films.
    """

    study: LoadedStudy
    data: StudyData
    number: int
    address: tuple[str, int]
    films: Mapping[str, Path]
    head: RunOptions | None


def utc_now() -> str:
    """Return date and time in UTC."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def open_journal(study: LoadedStudy, data: StudyData, number: int, sha256: str) -> Journal:
    """Return the journal of a participant who has not finished yet, for this design.

    Raises:
        SetupError: the participant's data were deleted, are of another design or damaged, or a
            session is open.
    """
    code = participant_code(number)
    if code in data.deleted():
        raise SetupError(f"the data of {code} were deleted on request: take another participant")
    folder = data.participant(number)
    journal = Journal(folder)
    try:
        for one in journal.records:
            if isinstance(one, ParticipationOpened) and one.design_sha256 != sha256:
                raise SetupError(
                    f"{folder} was begun with another design ({one.design_sha256[:12]}; this one "
                    f"is {sha256[:12]}): begin a new study with --data NEW_FOLDER"
                )
        check_records(journal.records, study.design, study.questionnaires, folder)
    except SetupError:
        journal.close()
        raise
    return journal


def run_session(
    plan: SessionPlan,
    stopped: Callable[[], str | None],
    say: Callable[[str], None],
    clock: Clock,
    browse: Callable[[str], object] | None = None,
) -> str:
    """Run a participant's session until it ends or is stopped; return the reason in words.

    Args:
        plan: settings of the session.
        stopped: returns why to stop now, None to continue; the session can be resumed.
        say: writes a line for the experimenter.
        clock: the host's.
        browse: opens the participant's page in a browser here, None: only its address is printed.

    Raises:
        SetupError: the participant has already finished, or the session cannot start.
    """
    study, data = plan.study, plan.data
    sha256 = data.claim(study.name, study.canonical)
    folder = data.participant(plan.number)
    with open_journal(study, data, plan.number, sha256) as journal:
        session = StudySession(
            study.design, study.questionnaires, plan.number, data.secret(), journal.records
        )
        code = participant_code(plan.number)
        if session.closed:
            raise SetupError(f"{code} has ended the session already: take another participant")
        journal.write((session.open_session(code, sha256, gazerig.__version__, utc_now()),))
        head = None
        if plan.head is not None:
            head = HeadPresenter(study, plan.head, folder, session.consent_given, clock)
        run = StudyRun(code, session, journal, head or FilmPresenter(), clock.now_s, utc_now)
        finished: list[str] = []

        def token(who: str) -> str:  # the same after a resumption, so that open pages continue
            text = f"the page of the {who} of session {plan.number}".encode()
            return hmac.new(data.secret(), text, hashlib.sha256).hexdigest()[:_TOKEN_DIGITS]

        server = StudyServer(
            run, study.design, plan.address, (token("participant"), token("experimenter")),
            plan.films,
            lambda: finished.append("ended by the experimenter"), head,
        )  # fmt: skip
        try:
            over = _end_action(head, study, journal, folder, say)
            try:
                server.open()
            except OSError as error:
                host, port = plan.address
                raise SetupError(
                    f"the pages cannot be served at {host}:{port} ({error.strerror or error}): "
                    "name another address with --page HOST:PORT"
                ) from error
            say(f"participant: {server.participant_url}")
            say(f"experimenter: {server.experimenter_url}")
            if browse is not None:
                browse(server.participant_url)
            why = _poll_until_stopped(
                run, server, lambda: finished[0] if finished else stopped(), over, say, clock
            )
        finally:
            server.close()
            if head is not None:
                head.close()
        over()
    return "the session is over" if session.closed else f"{why}; the same command goes on with it"


def _end_action(
    head: HeadPresenter | None,
    study: LoadedStudy,
    journal: Journal,
    folder: Path,
    say: Callable[[str], None],
) -> Callable[[], None]:
    """Return a function that parks the head and measures its presentations; no-op with films.

    Raises:
        SetupError: the measures need a package that is not installed.
    """
    if head is None:
        return lambda: None
    from gazerig.features.study.run.trial_measures import measure_presentations  # 0.7 s of CPU time

    def over() -> None:
        head.close_head()
        journal.write(measure_presentations(study, journal.records, folder, say))

    return over


def _poll_until_stopped(
    run: StudyRun,
    server: StudyServer,
    told: Callable[[], str | None],
    over: Callable[[], None],
    say: Callable[[str], None],
    clock: Clock,
) -> str:
    """Poll the session until the program is stopped; return the reason.

    over: called once after the end of the session; its last page remains
    """
    shown, said, closed = run.now()[0], "", False
    while (why := told()) is None:
        try:
            run.poll()
        except WriteFailed as error:
            if str(error) != said:
                said = str(error)
                say(said)
        if (page := run.now()[0]) != shown:
            shown = page
            server.notify()
        if not closed and run.state().closed:
            closed = True
            over()
            say("the session is over; Ctrl-C, or the experimenter's page, ends the program")
        clock.sleep_until(clock.now_s() + _POLL_S)
    return why
