"""The participant's page: one document, the present page as JSON, and the participant's events.

An event names its page and is applied once, however often and from however many tabs it is sent;
the answer is always the present page.
"""

import asyncio
import mimetypes
import secrets
from collections.abc import Callable, Mapping
from pathlib import Path

import msgspec
from aiohttp import web
from aiohttp.typedefs import Handler

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import write_file
from gazerig.errors import Error
from gazerig.features.study.session import PageEvent, StudySession, WrongEvent
from gazerig.robot.dashboard.door.admission import Admission, page_url

_FILES = Path(__file__).parent / "browser"
_SENT_BYTES = 256 * 1024
_POLL_S = 0.05
# No external and no inline content; nothing is stored by the browser.
_HEADERS = {
    "Cache-Control": "no-store",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
    "Content-Security-Policy": (
        "default-src 'none'; script-src 'self'; style-src 'self'; connect-src 'self'; "
        "media-src blob:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'"
    ),
}


class StudyServer:
    """Serves the page of one session.

    Args:
        folder: folder of the participant, with the token of the page.
        films: film of each condition; empty with a head.
        say: receives messages for the experimenter.
    """

    def __init__(
        self,
        session: StudySession,
        address: tuple[str, int],
        folder: Path,
        films: Mapping[str, Path],
        say: Callable[[str], None],
    ) -> None:
        self._session, self._address, self._films, self._say = session, address, films, say
        self._lost: Error | None = None
        token_file = folder / "token"
        if not token_file.exists():  # after a resumption it is the same
            write_file(token_file, secrets.token_hex(16))
            token_file.chmod(0o600)
        token = token_file.read_text()
        self.url = f"{page_url(*address)}/?token={token}"
        self._admission = Admission(
            *address, token, f"gazerig_study_{address[1]}", "open the address of your session"
        )

    async def serve(self, stopped: Callable[[], str | None]) -> None:
        """Serve until ``stopped`` returns a reason.

        Raises:
            OSError: the address is not available.
            gazerig.Error: the head cannot show conditions any more.
        """
        app = web.Application(middlewares=[self._admit], client_max_size=_SENT_BYTES)
        app.router.add_get("/page", self._get_page)
        app.router.add_post("/event", self._post_event)
        app.router.add_get("/film/{page}", self._get_film)
        app.router.add_get("/{name:(participant.js|participant.css)?}", self._get_file)
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.5)
        await runner.setup()
        try:
            await web.TCPSite(runner, *self._address, reuse_address=True).start()
            while stopped() is None:
                if self._lost is not None:
                    raise self._lost
                self._session.poll()
                await asyncio.sleep(_POLL_S)
        finally:
            await runner.cleanup()

    @web.middleware
    async def _admit(self, request: web.Request, handler: Handler) -> web.StreamResponse:
        """Accept a request, redirect it to an address without token, or refuse it in one line."""
        refusal = self._admission.refusal(request)
        if refusal is not None:
            return _reply(403, refusal.encode())
        if "token" in request.query:
            return self._admission.with_cookie(request, _HEADERS)
        return await handler(request)

    async def _get_file(self, request: web.Request) -> web.Response:
        path = _FILES / (request.match_info["name"] or "participant.html")
        return _reply(200, path.read_bytes(), mimetypes.guess_type(path)[0] or "")

    async def _get_page(self, request: web.Request, status: int = 200) -> web.Response:
        return web.json_response(self._session.page_json(), status=status, headers=_HEADERS)

    async def _post_event(self, request: web.Request) -> web.Response:
        """Apply an event; the answer is the present page, with 409 if the event's page is over."""
        try:
            event = msgspec.json.decode(await request.read(), type=PageEvent)
            applied = self._session.handle(event)
        except (msgspec.DecodeError, UnicodeDecodeError, WrongEvent) as error:
            return _reply(400, str(error).encode())
        except SetupError as error:
            self._say(str(error))
            # The message may contain file names, which are not for participants.
            return _reply(507, b"not saved")
        except Error as lost:
            self._lost = lost
            return _reply(503, b"not saved")
        if self._session.closed:
            self._say("the session is over: Ctrl-C ends the program")
        return await self._get_page(request, 200 if applied else 409)

    async def _get_film(self, request: web.Request) -> web.Response:
        """Send the present film without its name or date, which could identify the condition."""
        session = self._session
        presenting = session.place.step == "presentation" and self._films
        if not presenting or request.match_info["page"] != session.page:
            return _reply(404, b"there is no film at this address")
        body = self._films[session.condition].read_bytes()
        session.film_fetched()
        return _reply(200, body, "video/webm")


def _reply(status: int, body: bytes, kind: str = "text/plain") -> web.Response:
    return web.Response(status=status, body=body, content_type=kind, headers=_HEADERS)
