"""Serves the pages of a study: the participant's at "/", the experimenter's at "/experimenter".

Each has its own token. An event names its page and is applied once, however often and from
however many tabs it is sent; the answer is always the present page. A page is confirmed only
after its data are on the host's disk.
"""

import asyncio
import threading
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from pathlib import Path

from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from gazerig.features.study.answers import WrongAnswer
from gazerig.features.study.design import StudyDesign
from gazerig.features.study.journal import WriteFailed
from gazerig.features.study.pages.experimenter_line import ExperimenterLine, HeadLink, NoHead
from gazerig.features.study.pages.participant_page import (
    Json,
    Malformed,
    ParticipantEvent,
    page_json,
    parse_event,
)
from gazerig.features.study.pages.study_files import HEADERS, StudyFiles
from gazerig.features.study.study_run import StudyRun
from gazerig.robot.dashboard.door.admission import Admission, page_url
from gazerig.robot.dashboard.door.browsers import Connections, TabLimits
from gazerig.robot.dashboard.door.sockets import TAKES_S, until_one_ends

SENT_BYTES = 256 * 1024
"""Largest page of answers."""
_MOST_TABS = 16
_BEAT_S = 2.0
_READ_S = 5.0
_OPEN_TIMEOUT_S = 20.0
_CLOSE_TIMEOUT_S = 3.0
_PARTICIPANT, _EXPERIMENTER = "participant", "experimenter"
_OTHERWISE = {
    _PARTICIPANT: "please open the address that you were given by the experimenter",
    _EXPERIMENTER: "open the experimenter's address that the terminal shows",
}
_FILMS_FAIL = (
    "the participant's browser cannot play the films (WebM): open the participant's address in a "
    "current Firefox, Chrome or Edge, on an iPhone or iPad with iOS 17.4 or later"
)
_EXPERIMENTERS_PATHS = ("/experimenter", "/rig/")
_OF_BOTH = (".css", ".js", ".svg", ".json")
"""Endings of files below /study/ that both pages need."""


class StudyServer:
    """The pages of one session, served from their own thread."""

    def __init__(
        self,
        run: StudyRun,
        design: StudyDesign,
        address: tuple[str, int],
        tokens: tuple[str, str],
        films: Mapping[str, Path],
        finish: Callable[[], None],
        head: HeadLink | None = None,
    ) -> None:
        """Prepare the server.

        Args:
            run: the session.
            design: the study's design.
            address: host and port to listen on, e.g. ("127.0.0.1", 8090).
            tokens: tokens of the participant's and the experimenter's browser.
            films: film of each condition; empty with a head.
            finish: called from any thread when the experimenter ends the program.
            head: the head that is shown, None with films.
        """
        self._study_run, self._design, self._films = run, design, films
        self._address = address
        self._tokens = dict(zip((_PARTICIPANT, _EXPERIMENTER), tokens, strict=True))
        self._admissions = {
            who: Admission(*address, token, f"gazerig_study_{address[1]}_{who}", _OTHERWISE[who])
            for who, token in self._tokens.items()
        }
        self._loop = asyncio.new_event_loop()
        self._over = asyncio.Event()
        self._opened = threading.Event()
        self._failed: OSError | None = None
        self._news: set[asyncio.Event] = set()
        self._tabs = TabLimits(_MOST_TABS)
        self._once = ""
        self._one_at_a_time = asyncio.Lock()
        self._thread = threading.Thread(target=self._run, name="study pages", daemon=True)
        self._experimenter = ExperimenterLine(
            run, design, head or NoHead(), self._watch, self.notify, finish
        )

    @property
    def participant_url(self) -> str:
        """Return the participant's address with its token."""
        return self._url(_PARTICIPANT, "/")

    @property
    def experimenter_url(self) -> str:
        """Return the experimenter's address with its token."""
        return self._url(_EXPERIMENTER, "/experimenter")

    def open(self) -> None:
        """Start to listen.

        Raises:
            OSError: the address is not available.
        """
        self._thread.start()
        if not self._opened.wait(_OPEN_TIMEOUT_S):
            raise OSError("the study's page did not open in time")
        if self._failed is not None:
            raise self._failed

    def notify(self) -> None:
        """Make the browsers fetch the present page; safe from any thread."""
        with suppress(RuntimeError):  # closed already
            self._loop.call_soon_threadsafe(self._wake)

    def close(self) -> None:
        """Close all connections."""
        if self._thread.is_alive():
            with suppress(RuntimeError):
                self._loop.call_soon_threadsafe(self._over.set)
            self._thread.join(_CLOSE_TIMEOUT_S)

    def _url(self, who: str, path: str) -> str:
        return f"{page_url(*self._address)}{path}?token={self._tokens[who]}"

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        app = web.Application(middlewares=[self._access_middleware()], client_max_size=SENT_BYTES)
        app.router.add_get("/study/page", self._page)
        app.router.add_get("/study/news", self._stream_news)
        app.router.add_post("/study/done", self._handle_event)
        app.router.add_get("/study/film/{token}", self._film)
        app.router.add_post("/study/film_failed", self._film_failed)
        StudyFiles(self._design.language).add_to(app.router)
        self._experimenter.add_to(app.router)
        app.router.add_get("/{path:.*}", _nothing)
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.5, lingering_time=0.0)
        await runner.setup()
        assert runner.server is not None
        self._connections = Connections(runner.server)
        try:
            listener = await self._loop.create_server(
                self._connections.accept, *self._address, reuse_address=True
            )
        except OSError as error:
            self._failed = error
            return
        finally:
            self._opened.set()
        await until_one_ends(self._over.wait(), self._connections.watch())
        self._wake()
        listener.close()
        await runner.cleanup()

    def _access_middleware(self) -> Middleware:
        """Accept a request, redirect it to an address without token, or refuse it in one line."""

        @web.middleware
        async def admit(request: web.Request, handler: Handler) -> web.StreamResponse:
            with self._connections.mark_busy(request):
                theirs = request.path.startswith(_EXPERIMENTERS_PATHS)
                admission = self._admissions[_EXPERIMENTER if theirs else _PARTICIPANT]
                why_not = admission.refusal(request)
                of_study = request.path.startswith("/study/")
                if why_not is not None and of_study and request.path.endswith(_OF_BOTH):
                    why_not = self._admissions[_EXPERIMENTER].refusal(request)
                if why_not is not None:
                    return web.Response(status=403, text=f"{why_not}\n", headers=HEADERS)
                if "token" in request.query:
                    return admission.with_cookie(request, HEADERS)
                return await handler(request)

        return admit

    def _present_page(self) -> Json:
        """Return the present page."""
        name, screen = self._study_run.now()
        return {
            "page": name,
            **page_json(screen, self._design, self._study_run.state().participant),
        }

    # --- the participant ----------------------------------------------------------------------

    async def _page(self, request: web.Request) -> web.Response:
        return web.json_response(await asyncio.to_thread(self._present_page), headers=HEADERS)

    async def _handle_event(self, request: web.Request) -> web.Response:
        """Apply an event; answer with the next page."""
        async with asyncio.timeout(_READ_S):
            body = await request.read()
        try:
            event = parse_event(body)
        except Malformed as error:
            return web.Response(status=400, text=f"{error}\n", headers=HEADERS)

        try:
            async with self._one_at_a_time:
                status, page = await asyncio.to_thread(self._apply_event, event)
        except WrongAnswer as error:
            return web.Response(status=400, text=f"{error}\n", headers=HEADERS)
        except WriteFailed as error:
            self._experimenter.trouble = str(error)
            self._wake()
            # An error of the disk may contain file names, which are not for participants.
            return web.Response(status=507, text="not kept\n", headers=HEADERS)
        if status == 200:
            self._experimenter.trouble = ""
        self._wake()
        return web.json_response(page, status=status, headers=HEADERS)

    def _apply_event(self, event: ParticipantEvent) -> tuple[int, Json]:
        """Return 200 for an applied event, 409 if its page is over; and the present page."""
        if event.once != self._once:
            if event.page != self._study_run.now()[0]:
                return 409, self._present_page()
            event.tell(self._study_run)
            self._once = event.once
        return 200, self._present_page()

    async def _stream_news(self, request: web.Request) -> web.StreamResponse:
        """Send the name of the present page at every change, and every two seconds."""
        stream = web.StreamResponse(headers={**HEADERS, "Content-Type": "text/event-stream"})
        await stream.prepare(request)

        async def tell() -> None:
            name, _ = await asyncio.to_thread(self._study_run.now)
            async with asyncio.timeout(TAKES_S):
                await stream.write(f"data: {name}\n\n".encode())

        await self._watch(request, _PARTICIPANT, tell, _BEAT_S)
        return stream

    async def _film(self, request: web.Request) -> web.StreamResponse:
        """Send a film without its name, date or tag, which could identify the condition."""
        token = request.match_info["token"]
        condition = await asyncio.to_thread(self._study_run.film_of, token)
        path = None if condition is None else self._films.get(condition)
        if path is None:
            return await _nothing(request)
        try:
            body = await asyncio.to_thread(path.read_bytes)
        except OSError as error:
            self._experimenter.trouble = f"the film cannot be read: {error}"
            self._wake()
            return await _nothing(request)
        self._connections.mark_websocket(request)  # as long as a slow network takes
        answer = web.Response(body=body, content_type="video/webm", headers=HEADERS)
        answer.force_close()
        await answer.prepare(request)
        await answer.write_eof()
        if request.method == "GET":
            self._study_run.film_fetched(token)  # before any further event of the browser
        return answer

    async def _film_failed(self, request: web.Request) -> web.Response:
        """Warn the experimenter, until the next event, that the browser cannot play the films."""
        self._experimenter.trouble = _FILMS_FAIL
        self._wake()
        return web.Response(status=204, headers=HEADERS)

    # --- connections ----------------------------------------------------------------------------

    async def _watch(
        self,
        request: web.Request,
        who: str,
        tell: Callable[[], Awaitable[None]],
        beat_s: float,
    ) -> None:
        """Send to a browser now, at news and at an interval, until it disconnects."""
        self._connections.mark_websocket(request)
        news = asyncio.Event()
        self._news.add(news)
        try:
            with self._tabs.occupy(who) as leave, suppress(ConnectionError, TimeoutError):
                while not (self._over.is_set() or leave.is_set()):
                    news.clear()
                    await tell()
                    with suppress(TimeoutError):
                        await asyncio.wait_for(news.wait(), beat_s)
        finally:
            self._news.discard(news)

    def _wake(self) -> None:
        for news in self._news:
            news.set()


async def _nothing(request: web.Request) -> web.Response:
    return web.Response(status=404, text="there is nothing at this address\n", headers=HEADERS)
