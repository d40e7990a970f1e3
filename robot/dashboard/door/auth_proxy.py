"""Door of the page: the only access to it, for admitted browsers, at the configured address.

Viser itself listens where no other program can reach it
(``gazerig.robot.dashboard.door.viser_server``). The rules of access are in
``gazerig.robot.dashboard.door.admission``.

It serves the page itself (``gazerig.robot.dashboard.door.page_files``), so that the stop button and
its connection work even if viser fails; viser draws the view in a frame of the page
(``gazerig.robot.dashboard.door.viser_server``).
"""

import asyncio
import json
import secrets
import threading
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from pathlib import Path

import aiohttp
from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from gazerig.robot.dashboard.door.admission import API, Admission
from gazerig.robot.dashboard.door.browsers import Browsers, Connections, TabLimits
from gazerig.robot.dashboard.door.page_files import PageFiles
from gazerig.robot.dashboard.door.programs import ProgramRoutes
from gazerig.robot.dashboard.door.sockets import (
    TAKES_S,
    TakePicture,
    WebcamSocket,
    WidgetSocket,
    close_socket,
    until_one_ends,
)
from gazerig.robot.dashboard.door.viser_server import VIEW, ViewProxy, view_client
from gazerig.robot.dashboard.requests.outbox import (
    ASKED_BYTES,
    UNCONFIRMED,
    add_client,
    encode_request,
    takes_control,
)
from gazerig.robot.dashboard.requests.rig_relay import RigRelay
from gazerig.robot.dashboard.requests.stop_sender import StopSender
from gazerig.robot.dashboard.widgets.widgets import RECEIVED_BYTES, Widgets
from gazerig.robot.remote.excess import TokenBucket

MOST_LINES = 32
"""Largest number of tabs whose stop button receives the state of the rig."""

_ASKED_PER_S, _ASKED_BURST = 20.0, 40.0  # clicks of all people together
_READ_S = 5.0
_BEAT_S = 1.0
_RENEWED_EVERY_S = 0.25
_OPEN_TIMEOUT_S = 20.0
_CLOSE_TIMEOUT_S = 3.0
_DAY_S = 86400
_HEADERS = {
    "X-Frame-Options": "DENY",  # no other page may cover the buttons
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
}

_WHERE = (
    "open the address with the token that the rig's terminal shows; "
    "there is a new one each time the rig is started"
)

Ask = Callable[[bytes], bool]
"""Sends a JSON object to the rig; returns False if the rig does not accept it."""
Point = Callable[[object, str], bool]
"""Receives a pointer's position as a browser sent it, and the name of the browser."""


class AuthProxy:
    """Proxy that admits browsers to the server behind it, in its own thread.

    webcam: receives pictures of browsers' own cameras; admission: decides who has access
    """

    def __init__(
        self,
        host: str,
        port: int,
        inside: Path,
        ask: Ask,
        stop: StopSender,
        token: str,
        browsers: Browsers,
        widgets: Widgets,
        point: Point,
        picture: TakePicture,
        rig: Path | None = None,
    ) -> None:
        """Prepare to listen.

        Args:
            host: the address
            port: a free port of that address
            inside: address of the server
            ask: called in the door's thread with each request for the rig
            stop: receives stops, before all other requests
            token: what a client must show
            browsers: names the browsers by their cookies
            widgets: of the panels
            point: receives positions of a browser's pointer; sends no answer
            picture: receives pictures of browsers' own cameras; returns False if it does not accept
                them
            rig: the rig's command socket, for programs; None without one
        """
        self._host = host
        self._port = port
        self._inside = inside
        self._ask = ask
        self._stop = stop
        self.token = token
        self._point = point
        self.browsers = browsers
        self.widgets = widgets
        self._panel_socket = WidgetSocket(self.widgets)
        self._panel_tabs = TabLimits(MOST_LINES)
        self._cookie = f"gazerig_{port}"  # cookies are shared by all ports
        self.admission = Admission(host, port, token, self._cookie, _WHERE)
        self._state: Mapping[str, object] = {}
        self._asked_rate = TokenBucket(_ASKED_PER_S, _ASKED_BURST)
        self._news: set[asyncio.Event] = set()
        self._lines = TabLimits(MOST_LINES)
        self._loop = asyncio.new_event_loop()
        self.webcam, self._webcams = WebcamSocket(self._loop.time, picture), TabLimits(2)
        self._over = asyncio.Event()
        self._relay = RigRelay(rig)
        self._programs = ProgramRoutes(self._relay, stop, self._over, _HEADERS)
        self._opened = threading.Event()
        self._failed: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="page door", daemon=True)

    def open(self) -> None:
        """Listen.

        Raises:
            OSError: it is not possible to listen on the address.
        """
        self._thread.start()
        if not self._opened.wait(_OPEN_TIMEOUT_S):
            raise OSError("the page's door did not open in time")
        if self._failed is not None:
            raise self._failed

    def call_soon(self, do: Callable[[], None]) -> None:
        """Let the thread that serves browsers call a function.

        Raises:
            RuntimeError: the thread has ended.
        """
        self._loop.call_soon_threadsafe(do)

    def is_open(self) -> bool:
        """Return whether browsers can connect."""
        return self._thread.is_alive()

    def send_state(self, state: Mapping[str, object]) -> None:
        """Send the state to all stop buttons; may be called from any thread."""
        if state != self._state:
            self._state = dict(state)
            self._loop.call_soon_threadsafe(self._wake)

    def close(self) -> None:
        """Close all connections."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._over.set)
            self._thread.join(_CLOSE_TIMEOUT_S)
        self._panel_socket.close()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        app = web.Application(
            middlewares=[self._admission_middleware()], client_max_size=ASKED_BYTES
        )
        app.router.add_get("/rig/line", self._handle_line)
        app.router.add_get("/rig/panels", self._panels)
        app.router.add_get("/rig/webcam", self._webcam)
        app.router.add_post("/rig/ask", self._handle_post)
        PageFiles(_HEADERS).add_to(app.router)
        self._programs.add_to(app.router, lambda: self._connections)
        app.router.add_get(VIEW, self._relay_view)
        app.router.add_get(f"{VIEW}/{{path:.*}}", self._relay_view)
        app.router.add_get("/{path:.*}", self._not_found)
        runner = web.AppRunner(
            app, access_log=None, shutdown_timeout=0.5, lingering_time=0.0, max_line_size=4096
        )
        await runner.setup()
        assert runner.server is not None
        self._connections = Connections(runner.server)
        async with view_client(self._inside) as client:
            self._view = ViewProxy(client, self._connections, _HEADERS)
            try:
                listener = await self._loop.create_server(
                    self._connections.accept,
                    self._host,
                    self._port,
                    reuse_address=True,
                    backlog=512,
                )
            except OSError as error:
                self._failed = error
                return
            finally:
                self._opened.set()
            self._stop.attach(self._loop)
            await until_one_ends(
                self._over.wait(), self._connections.watch(), self._programs.feed.run()
            )
            self._over.set()
            self._relay.close()
            self._wake()
            listener.close()
            await runner.cleanup()

    # --- admission ---------------------------------------------------------------------

    def _admission_middleware(self) -> Middleware:
        """Accept a request, redirect it to an address without token, or refuse it in one line."""

        @web.middleware
        async def admit(request: web.Request, handler: Handler) -> web.StreamResponse:
            with self._connections.mark_busy(request):
                why_not = self.admission.refusal(request)
                is_program = request.path.startswith(API)
                if why_not is not None and is_program:
                    return self._programs.refuse(why_not.removeprefix("refused: "))
                if why_not is not None:
                    return web.Response(status=403, text=f"{why_not}\n", headers=_HEADERS)
                if "token" in request.query and not is_program:
                    answer = self.admission.with_cookie(request, _HEADERS)
                    if self._name_cookie not in request.cookies:
                        answer.set_cookie(
                            self._name_cookie,
                            secrets.token_urlsafe(9),
                            httponly=True,
                            samesite="Strict",
                            path="/",
                            max_age=_DAY_S,
                        )
                    return answer
                return await handler(request)

        return admit

    @property
    def _name_cookie(self) -> str:
        return f"{self._cookie}_browser"

    def _browser_name(self, request: web.Request) -> str:
        return self.browsers.name(request.cookies.get(self._name_cookie))

    # --- the stop button ------------------------------------------------------------------

    async def _handle_post(self, request: web.Request) -> web.Response:
        """Send a request to the rig; answer the browser with its acceptance or refusal."""
        async with asyncio.timeout(_READ_S):
            body = await request.read()
        who = self._browser_name(request)
        status, text = await self._handle(add_client(body, who), who)
        return web.Response(status=status, text=f"{text}\n" if text else None, headers=_HEADERS)

    async def _handle(self, asked: dict[str, object] | None, who: str) -> tuple[int, str]:
        """Send a browser's request to the rig; return an HTTP status and the refusal."""
        if asked is None:
            return 400, "not a valid JSON request"
        if asked.get("do") == "stop":
            try:
                text = await self._stop.send(f"{asked.get('why', '')!s:.100} ({who})", who)
            except OSError as error:
                return 503, str(error)
            return (503, text) if text else (204, "")
        if not self._asked_rate.take(self._loop.time()):
            return 429, "too many requests; try again"
        if asked.get("do") == "resume" and asked.get("confirmed") is not True:
            return 409, UNCONFIRMED  # a cookie with the name of a browser proves nothing
        if takes_control(asked):
            self.browsers.give_control(who)
        return (
            (204, "")
            if self._ask(encode_request(asked))
            else (503, "the rig accepts no requests now")
        )

    async def _handle_line(self, request: web.Request) -> web.StreamResponse:
        """Send the state whenever it changes, with heartbeats in between; receive stops.

        This connection is already open when STOP is pressed; a browser opens only six others.
        """
        line = web.WebSocketResponse(max_msg_size=ASKED_BYTES, compress=False, autoping=False)
        await line.prepare(request)
        self._connections.mark_websocket(request)
        who = self._browser_name(request)
        news = asyncio.Event()
        self._news.add(news)
        try:
            with self.browsers.connected(who), self._lines.occupy(who) as leave:
                await until_one_ends(
                    self._send_state(line, news, who),
                    self._receive_line(line, who),
                    self._ping(line, who),
                    self._over.wait(),
                    leave.wait(),
                )
        finally:
            self._news.discard(news)
        await close_socket(line, request)
        return line

    async def _send_state(self, line: web.WebSocketResponse, news: asyncio.Event, who: str) -> None:
        while not line.closed:
            news.clear()
            async with asyncio.timeout(TAKES_S):
                await line.send_str(json.dumps({"state": {**self._state, "you": who}}))
            with suppress(TimeoutError):
                await asyncio.wait_for(news.wait(), _BEAT_S)

    async def _receive_line(self, line: web.WebSocketResponse, who: str) -> None:
        async for message in line:
            if message.type is aiohttp.WSMsgType.PING:
                async with asyncio.timeout(TAKES_S):
                    await line.pong(message.data)
            elif message.type is aiohttp.WSMsgType.PONG and who == self.browsers.in_control():
                self._ask(encode_request({"do": "renew", "who": who}))
            if message.type is not aiohttp.WSMsgType.TEXT:
                continue
            asked = add_client(message.data, who)
            if asked is not None and "point" in asked:
                self.browsers.give_control("")  # no control is renewed during pointer control
                self._point(asked["point"], who)
                continue
            status, text = await self._handle(asked, who)
            async with asyncio.timeout(TAKES_S):
                await line.send_str(json.dumps({"answer": status, "words": text}))

    # --- the panels -----------------------------------------------------------------------

    async def _panels(self, request: web.Request) -> web.StreamResponse:
        """Send the panels to a browser, no faster than it reads them."""
        socket = web.WebSocketResponse(max_msg_size=RECEIVED_BYTES, compress=False)
        who = self._browser_name(request)
        return await self._keep_open(
            request, socket, self._panel_tabs, lambda: self._panel_socket.serve(socket, who)
        )

    async def _webcam(self, request: web.Request) -> web.StreamResponse:
        """Receive the images of a browser's webcam."""
        socket = self.webcam.new_socket()
        return await self._keep_open(
            request, socket, self._webcams, lambda: self.webcam.serve(socket)
        )

    async def _keep_open(
        self,
        request: web.Request,
        socket: web.WebSocketResponse,
        tabs: TabLimits,
        serve: Callable[[], Awaitable[object]],
    ) -> web.StreamResponse:
        """Keep a websocket until it ends, the page closes or its slot is freed."""
        await socket.prepare(request)
        self._connections.mark_websocket(request)
        with tabs.occupy(self._browser_name(request)) as leave:
            await until_one_ends(serve(), self._over.wait(), leave.wait())
        await close_socket(socket, request)
        return socket

    # --- heartbeats ---------------------------------------------------------------------

    def _wake(self) -> None:
        for news in self._news:
            news.set()

    async def _ping(self, line: web.WebSocketResponse, who: str) -> None:
        """Ping the browser in control; each answer renews its control.

        An open connection does not prove that the browser is present: after a computer is suspended
        or loses its network, the connection stays open for minutes. Browsers also answer pings for
        pages in the background.
        """
        while True:
            await asyncio.sleep(_RENEWED_EVERY_S)
            if who == self.browsers.in_control():
                async with asyncio.timeout(TAKES_S):
                    await line.ping()

    # --- the server behind the door -------------------------------------------------------

    async def _relay_view(self, request: web.Request) -> web.StreamResponse:
        if "upgrade" in request.headers:
            return await self._view.relay(request, self._browser_name(request), self._over.wait())
        if request.path == VIEW:  # paths in the document are relative to it
            return web.Response(status=302, headers={**_HEADERS, "Location": f"{VIEW}/"})
        return await self._view.get(request)

    async def _not_found(self, request: web.Request) -> web.Response:
        return web.Response(status=404, text="there is no page at this address\n", headers=_HEADERS)
