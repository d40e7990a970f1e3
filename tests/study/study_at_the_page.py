"""A study's session with its pages, without the program around it."""

import itertools
import json
import time
import urllib.error
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from page_visitor import Opener, fetch
from shown_page import free_port
from websockets.sync.client import connect
from websockets.typing import Origin

from gazerig.features.study.journal import Journal
from gazerig.features.study.pages.experimenter_line import HeadLink
from gazerig.features.study.pages.server import StudyServer
from gazerig.features.study.run.study_file import LoadedStudy
from gazerig.features.study.study_run import FilmPresenter, Presenter, StudyRun
from gazerig.features.study.study_session import StudySession

PARTICIPANT, EXPERIMENTER = "participants-token", "experimenters-token"
CODE = "P007"
UTC = "2026-11-23T04:00:00Z"


class Pages:
    """The pages of one session, and what is on disk of it.

    now_s: the session's clock, which a test moves with a head; with films 1 us is 1 s
    finished: how often the program was to end
    """

    def __init__(
        self,
        study: LoadedStudy,
        folder: Path,
        films: dict[str, Path],
        presenter: Presenter | None = None,
        head: HeadLink | None = None,
        participant: int = 7,
    ) -> None:
        self.now_s, self.finished = 0.0, 0
        self.journal = Journal(folder)
        session = StudySession(
            study.design, study.questionnaires, participant, b"secret", self.journal.records
        )
        self.journal.write([session.open_session(CODE, study.sha256, "test", UTC)])
        self.session = session
        self.run = StudyRun(
            CODE, session, self.journal, presenter or FilmPresenter(), self._clock, lambda: UTC
        )
        self._made_of = study.design, films, head
        self._port = free_port()
        self.server = self._new_server()

    def _clock(self) -> float:
        films = self.session.design.presentation.on == "film"
        return 1e6 * time.monotonic() if films else self.now_s

    def _new_server(self) -> StudyServer:
        design, films, head = self._made_of
        address, tokens = ("127.0.0.1", self._port), (PARTICIPANT, EXPERIMENTER)
        return StudyServer(self.run, design, address, tokens, films, self._finish, head)

    def serve_again(self) -> None:
        """Serve at the same address, after the server was closed."""
        self.server = self._new_server()
        self.server.open()

    def _finish(self) -> None:
        self.finished += 1

    def head_has_shown(self) -> None:
        """Let the time of a presentation of the head pass."""
        self.now_s += self.session.design.trials.seconds
        self.run.poll()
        self.server.notify()

    def close(self) -> None:
        self.server.close()
        self.journal.close()


@contextmanager
def serving(*what: Any, **more: Any) -> Iterator[Pages]:
    """Serve the pages of a session."""
    pages = Pages(*what, **more)
    pages.server.open()
    try:
        yield pages
    finally:
        pages.close()


class Tab:
    """A participant's browser without the drawing: every byte that came is in ``traffic``.

    head: lets a presentation of a head in the room pass
    """

    head: Callable[[], None]

    def __init__(self, address: str) -> None:
        self.traffic: list[bytes] = []
        self._once = itertools.count()
        self.url = address.partition("/?")[0].partition("/experimenter")[0]
        status, headers, _ = fetch(address)
        assert status == 302
        self.headers = {"Cookie": headers["Set-Cookie"].partition(";")[0], "Origin": self.url}

    def get(self, path: str, body: bytes | None = None) -> tuple[int, bytes]:
        """Status and body of what is at a path, or of an answer to what is sent there."""
        request = urllib.request.Request(self.url + path, body, self.headers)
        try:
            answer = urllib.request.build_opener(Opener).open(request, timeout=20.0)
        except urllib.error.HTTPError as error:
            answer = error
        with answer:
            data = answer.read()
            self.traffic += [path.encode(), str(answer.headers).encode(), data]
            return answer.status, data

    def state(self) -> dict[str, Any]:
        """State on the experimenter's page."""
        with connect(
            f"ws{self.url.removeprefix('http')}/rig/line",
            origin=Origin(self.url),
            additional_headers={"Cookie": self.headers["Cookie"]},
            close_timeout=1.0,
        ) as line:
            state: dict[str, Any] = json.loads(line.recv(timeout=20.0))["state"]
            return state

    def press(self, what: str, **more: object) -> tuple[int, str]:
        """Press a button of the experimenter's page; status and words of a refusal."""
        status, words = self.get("/rig/ask", json.dumps({"do": what, **more}).encode())
        return status, words.decode()

    def page(self) -> dict[str, Any]:
        """Content of the page."""
        status, data = self.get("/study/page")
        assert status == 200
        page: dict[str, Any] = json.loads(data)
        return page

    def send(self, page: str, **done: object) -> tuple[int, Any]:
        """Say what was done on a page; status and the page that follows."""
        body = json.dumps({"page": page, "once": f"{id(self)}-{next(self._once)}", **done})
        status, data = self.get("/study/done", body.encode())
        return status, json.loads(data) if status in (200, 409) else data.decode()

    def do(self, page: str, **done: object) -> dict[str, Any]:
        """Do something that is taken; the page that follows."""
        status, page_then = self.send(page, **done)
        assert status == 200, (status, page_then)
        shown: dict[str, Any] = page_then
        return shown

    def goes_through(self, page: dict[str, Any]) -> dict[str, Any]:
        """Do what opens the next page."""
        name, kind = page["page"], page["kind"]
        if kind == "consent":
            return self.do(name, do="consent", given=True, uses=page["uses"])
        if kind == "ready":
            return self.do(name, do="begin")
        if kind == "presentation" and not page["film"]:
            self.head()
            return self.page()
        if kind == "presentation":
            status, _ = self.get(page["film"])
            assert status == 200
            return self.do(name, do="seen", seconds=page["seconds"])
        if kind == "questions":
            return self.do(name, do="answer", answers=answers(page))
        return self.do(name, do="next")


def answers(page: dict[str, Any], rating: int = 2) -> list[dict[str, object]]:
    """An answer to each question of a page."""
    value = {"rating": rating, "choice": "second", "text": ""}
    return [{"key": i["key"], "value": value[i["kind"]], "ms": 1200.0} for i in page["items"]]
