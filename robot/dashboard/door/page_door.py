"""Door of a running head to the network: the page's files, its view, and the websocket.

The page and programs in any language are clients of one interface, and of one place for tokens,
Origin, Host and limits (``gazerig.robot.dashboard.door.admission``).

GET  /                       the page; /rig/NAME its files, /view/ viser in a frame
GET  /api/v1/socket          websocket: messages in both directions, states, events, pictures
POST /api/v1/do              one message; an order's answer has its outcome
GET  /api/v1/state           newest state
GET  /api/v1/waveform        outline of a track's sound
GET  /api/v1/webcam          websocket: pictures of a browser's webcam
"""

import asyncio
import fcntl
import secrets
import struct
import termios
import threading
from collections.abc import Awaitable, Callable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from socket import socket
from typing import Annotated, Any, NamedTuple, TypeVar

import aiohttp
import msgspec
from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

from gazerig.robot.dashboard.door.admission import API, Admission
from gazerig.robot.dashboard.door.browsers import Connections, TabLimits, browser_name
from gazerig.robot.dashboard.door.client_socket import (
    CONTROLS,
    NO_OUTCOME,
    ClientSocket,
    Visitor,
    Wishes,
    tag_of,
)
from gazerig.robot.dashboard.door.page_files import add_page_files
from gazerig.robot.dashboard.door.rig_link import BUSY, Answer, RigLink
from gazerig.robot.dashboard.door.sockets import (
    TAKES_S,
    TakePicture,
    WebcamSocket,
    close_socket,
    send_uncompressed,
    until_one_ends,
)
from gazerig.robot.dashboard.door.viser_server import VIEW, ViewProxy, view_client
from gazerig.robot.dashboard.door.waveforms import waveform
from gazerig.robot.loop.events import TickFeed
from gazerig.robot.loop.head_state import HeadEvent, HeadReport, head_state
from gazerig.robot.loop.tick import Tick
from gazerig.robot.model.commands import (
    HEARTBEAT_S,
    ORDERS,
    ClientCommand,
    Resume,
    State,
    Stop,
    read_request,
)
from gazerig.robot.model.reply import CommandReply, command_outcome
from gazerig.robot.net.excess import (
    CLOSED,
    REST_S,
    TOO_MANY,
    ExcessCount,
    TokenBucket,
    find_stop,
)
from gazerig.robot.net.socket_io import REQUEST_BYTES, VERSION
from gazerig.robot.net.topics import PanelContent, RigInfo, RunState, ShownPicture

_T = TypeVar("_T")
BASE = f"{API}v{VERSION}"
MOST_CLIENTS = 32
"""Largest number of websockets; one more takes the place of the oldest of the greediest client."""
UNCONFIRMED = (
    'resume needs "confirmed": true, after a person has made sure that no hand is in the mechanism; '
    "only the websocket of a program that stopped the head needs none"
)
_PER_S, _BURST = 50.0, 100.0
_ALL_PER_S, _ALL_BURST = 100.0, 200.0
_READ_S, _LOOK_S, _LOOKS = 5.0, 0.04, 10
_AT_ONCE = NO_OUTCOME | {"stop"}
_MOST_RESTS = 10
"""Stops are received for so many times REST_S while more of a client's data waits to be read."""
_WHO_CHARACTERS = 60
_TAG_CHARACTERS = 100
BACKLOG = 512
_CLOSE_TIMEOUT_S = 3.0
_DAY_S = 86400
_NEWEST = 10**15
"""Number greater than that of any event."""
_ENDS = (aiohttp.WSMsgType.CLOSE, aiohttp.WSMsgType.CLOSING, aiohttp.WSMsgType.CLOSED,
         aiohttp.WSMsgType.ERROR)  # fmt: skip
_TOPICS: Mapping[type, str] = {RigInfo: "rig", RunState: "run", PanelContent: "panel"}
_STATUS = {"ok": 200, "refused": 409, "failed": 503}
_HEADERS = {
    "X-Frame-Options": "DENY",  # no other page may cover the buttons
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
    "X-Content-Type-Options": "nosniff",
    # Allow scripts and connections of this address only. Panels contain their own styles, and the
    # page itself creates the camera image and the icon of the tab.
    "Content-Security-Policy": (
        "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
        "media-src 'self' blob:; object-src 'none'; base-uri 'none'; form-action 'none'; "
        "frame-ancestors 'none'"
    ),
}
_FRAMED_HEADERS = {
    **_HEADERS,
    # The page itself shows the view in a frame, and no other page may.
    "X-Frame-Options": "SAMEORIGIN",
    "Content-Security-Policy": "frame-ancestors 'self'",
}
_WHERE = (
    "open the address with the token that the rig's terminal shows; "
    "there is a new one each time the rig is started"
)


class MessageRefused(ValueError):
    """Refusal of a message to the rig; the text gives the reason.

    Attributes:
        status: Status of the HTTP answer.
    """

    def __init__(self, text: str, status: int = 400) -> None:
        super().__init__(text)
        self.status = status


class _Wait(msgspec.Struct):
    """Query of a message: longest wait for its outcome, s."""

    wait_s: Annotated[float, msgspec.Meta(ge=0.0, le=15.0)] = 10.0


class _After(msgspec.Struct):
    """Query of a state: number of the last known event."""

    after: Annotated[int, msgspec.Meta(ge=0, le=_NEWEST)] = _NEWEST


class HeadNews(NamedTuple):
    """What is new of the head; None and () for what is not.

    tick: The newest tick.
    topics: The rig, the run and the contents of packages' panels.
    silent_s: Time without a tick if the rig is silent, else 0.
    """

    tick: Tick | None = None
    events: tuple[HeadEvent, ...] = ()
    topics: tuple[RigInfo | RunState | PanelContent, ...] = ()
    picture: ShownPicture | None = None
    silent_s: float = 0.0


def parse_message(data: str | bytes) -> dict[str, Any]:
    """Parse a message that was received as text.

    Raises:
        MessageRefused: it is too long, or not a JSON object.
    """
    if len(data) > REQUEST_BYTES:
        raise MessageRefused(f"longer than {REQUEST_BYTES} bytes", 413)
    try:
        found = msgspec.json.decode(data)
    except RecursionError:
        raise MessageRefused("nested too deep") from None
    except ValueError as error:
        raise MessageRefused(f"not JSON: {error}") from None
    if not isinstance(found, dict):
        raise MessageRefused('not a JSON object like {"do": "status"}')
    tag = found.get("tag", 0)
    if not isinstance(tag, str | int) or len(str(tag)) > _TAG_CHARACTERS:
        raise MessageRefused(f"tag: a whole number or text of at most {_TAG_CHARACTERS} characters")
    return found


def parse_query(request: web.Request, kind: type[_T]) -> _T:
    """Parse the values of a query.

    Raises:
        MessageRefused: one is of the wrong type, or outside its bounds.
    """
    try:
        return msgspec.convert(dict(request.query), kind, strict=False)
    except msgspec.ValidationError as error:
        raise MessageRefused(f"query: {error}") from None


def add_client(message: dict[str, Any], visitor: Visitor, websocket: str = "") -> dict[str, Any]:
    """Return a message with the name of its client: the browser's, or a chosen one with address.

    Args:
        message: Message as received.
        visitor: Who has sent it.
        websocket: Name of the websocket, for a stop or a resume.
    """
    kind = ORDERS.get(str(message.get("do")))
    if kind is None or not issubclass(kind, ClientCommand):
        return message
    chosen = "".join(filter(str.isprintable, str(message.get("who") or "")))
    name = f"{chosen[:_WHO_CHARACTERS]} at {visitor.address}" if chosen else visitor.name
    here = f", {websocket}" if websocket and kind in (Stop, Resume) else ""
    by = f" ({visitor.browser})" if kind is Stop and visitor.browser else ""
    why = {"why": f"{message.get('why', '')!s:.100}{by}"} if kind is Stop else {}
    return {**message, **why, "who": f"{name}{here}"}


class PageDoor:
    """Server of all clients, in its own thread.

    webcam: receives pictures of browsers' own cameras; admission: decides who has access
    """

    def __init__(
        self,
        host: str,
        listener: socket,
        inside: Path,
        ends: Sequence[socket],
        token: str,
        feed: TickFeed,
        picture: TakePicture,
    ) -> None:
        """Prepare to listen.

        Args:
            host: the address
            listener: socket that listens there
            inside: address of viser's server
            ends: connections to the rig, see ``RigLink``
            token: what a client must show
            feed: the newest tick and the last events
            picture: receives pictures of browsers' own cameras; returns False if it does not accept
                them
        """
        self._listener, self._inside, self._token = listener, inside, token
        port = listener.getsockname()[1]
        self._feed = feed
        self._cookie = f"gazerig_{port}"  # cookies are shared by all ports
        self._name_cookie = f"{self._cookie}_browser"
        self.admission = Admission(host, port, token, self._cookie, _WHERE)
        self._rig = RigLink(ends)
        self._clients: set[ClientSocket] = set()
        self._lasting: dict[tuple[type, str], str] = {}
        self._rate = TokenBucket(_ALL_PER_S, _ALL_BURST)
        self._limits = TabLimits(MOST_CLIENTS)
        self._websockets, self._replied_s = 0, 0.0
        self._loop = asyncio.new_event_loop()
        self.webcam, self._webcams = WebcamSocket(self._loop.time, picture), TabLimits(2)
        self._over = asyncio.Event()
        self._thread = threading.Thread(target=self._run, name="page door", daemon=True)

    def open(self) -> None:
        """Start to serve."""
        self._thread.start()

    def call_soon(self, do: Callable[..., object], *words: object) -> None:
        """Let the thread that serves the clients call a function.

        Raises:
            RuntimeError: the thread has ended.
        """
        self._loop.call_soon_threadsafe(do, *words)

    def is_open(self) -> bool:
        """Return whether clients can connect."""
        return self._thread.is_alive()

    def wanted(self) -> Wishes:
        """Return whether any client wants pictures, and the rig; for any thread."""
        wishes = [client.wishes for client in tuple(self._clients)]
        return Wishes(
            pictures=any(one.pictures for one in wishes), rig=any(one.rig for one in wishes)
        )

    def close(self) -> None:
        """Close all connections."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._over.set)
            self._thread.join(_CLOSE_TIMEOUT_S)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        app = web.Application(middlewares=[self._admission_middleware()])
        app.on_response_prepare.append(add_headers)
        add_page_files(app.router)
        app.router.add_route("*", API + "{path:.*}", self._handle)
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
            self._view = ViewProxy(client, self._connections)
            listener = await self._loop.create_server(
                self._connections.accept, sock=self._listener, backlog=BACKLOG
            )
            await until_one_ends(self._over.wait(), self._connections.watch(), self._rig.run())
            self._over.set()
            listener.close()
            await runner.cleanup()

    def distribute(self, news: HeadNews) -> None:
        """Give every client what it wants of the news; called in the thread of the clients."""
        now_s = self._loop.time()
        if news.tick is not None:
            t_s = news.tick.t_s
            progress = self._feed.progress()
            due = [client for client in self._clients if client.wants_state(t_s, now_s)]
            text = _line(state=head_state(news.tick)) if due else ""
            for client in due:
                client.add_state(text, now_s)
            for client in self._clients:
                client.add_progress(progress)
        events = [_line(event=event) for event in news.events]
        texts = [_line(**{_TOPICS[type(topic)]: topic}) for topic in news.topics]
        for topic, text in zip(news.topics, texts, strict=True):
            self._lasting[type(topic), getattr(topic, "title", "")] = text
        silent = [_line(silent=news.silent_s)] if news.silent_s else []
        picture = _line(picture=news.picture.picture) if news.picture is not None else ""
        for client in self._clients:
            wishes = client.wishes
            for text in (
                *silent,
                *(events if wishes.events else ()),
                *(texts if wishes.rig else ()),
            ):
                client.queue_text(text)
            if news.picture is not None and wishes.pictures:
                client.add_picture(picture, news.picture.jpeg)

    # --- admission ---------------------------------------------------------------------

    def _admission_middleware(self) -> Middleware:
        """Accept a request, redirect it to an address without token, or refuse it in one line."""

        @web.middleware
        async def admit(request: web.Request, handler: Handler) -> web.StreamResponse:
            with self._connections.mark_busy(request):
                why_not = self.admission.refusal(request)
                is_program = request.path.startswith(API)
                if why_not is not None and is_program:
                    return _answer({"refused": why_not.removeprefix("refused: ")}, 403)
                if why_not is not None:
                    return web.Response(status=403, text=f"{why_not}\n")
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

    def _visitor(self, request: web.Request) -> Visitor:
        cookie = request.cookies.get(self._name_cookie)
        browser = browser_name(self._token, cookie) if cookie else ""
        return Visitor(browser, request.remote or "")

    # --- HTTP ---------------------------------------------------------------------------

    async def _handle(self, request: web.Request) -> web.StreamResponse:
        try:
            match request.method, request.path.removeprefix(f"{BASE}/"):
                case "GET", "state":
                    after = parse_query(request, _After).after
                    return _answer({"ok": await self._report(after)}, 200)
                case "POST", "do":
                    return await self._post(request)
                case "GET", "socket":
                    return await self._socket(request)
                case "GET", "webcam":
                    return await self._webcam(request)
                case "GET", "waveform":
                    wave = await waveform(self._rig, request.query.get("track", ""))
                    if not wave:
                        raise MessageRefused("no track of this name has a sound", 404)
                    return _answer({"ok": wave}, 200)
            raise MessageRefused(
                f"{request.method} {request.path:.60} is not here: version {VERSION} is at {BASE}/",
                404,
            )
        except MessageRefused as error:
            return _answer({"refused": str(error)}, error.status)

    async def _report(self, after: int) -> HeadReport:
        """Return the newest state, which is not older than the last answer to an order."""
        for _ in range(_LOOKS):
            tick = self._feed.newest
            if tick is None or tick.t_s >= self._replied_s:
                break
            await asyncio.sleep(_LOOK_S)
        return self._feed.report(after)

    async def _post(self, request: web.Request) -> web.StreamResponse:
        wait_s = parse_query(request, _Wait).wait_s
        data = b""
        async with asyncio.timeout(_READ_S):
            while len(data) <= REQUEST_BYTES and (more := await request.content.readany()):
                data += more
        visitor = self._visitor(request)
        message = add_client(parse_message(data), visitor)
        if message.get("do") == "resume" and message.get("confirmed") is not True:
            raise MessageRefused(UNCONFIRMED, 409)
        if message.get("do") != "stop" and not self._is_within_rate():
            raise MessageRefused(BUSY, 429)
        verb = message.get("do")
        if verb in (*CONTROLS, "talk"):
            # An order with a duration ends after it; a request has no connection to be lost.
            message["stay"] = message.get("stay") or any(map(message.get, ("for_s", "seconds")))
        answer = await self._ask(message, visitor)
        match answer:
            case {"ok": {"reply": dict(reply)}} if wait_s and message["do"] not in _AT_ONCE:
                answer |= await self._outcome(message, msgspec.convert(reply, CommandReply), wait_s)
        status = _STATUS[next(key for key in _STATUS if key in answer)]
        return _answer(answer, 429 if answer.get("refused") == BUSY else status)

    async def _outcome(
        self, message: Mapping[str, Any], reply: CommandReply, wait_s: float
    ) -> dict[str, object]:
        """Wait for the outcome of an order, and renew its control meanwhile."""
        renewing = reply.control_number and not message.get("stay")
        begin_s = renewed_s = self._loop.time()
        while (now_s := self._loop.time()) - begin_s < wait_s:
            end = command_outcome(reply, self._feed.progress())
            if end is not None:
                return {"outcome": end[0], "why": end[1]}
            if renewing and now_s - renewed_s > 0.25 * HEARTBEAT_S:
                renewed_s = now_s
                await self._rig.ask({"do": "renew", "who": message["who"]})
            await asyncio.sleep(_LOOK_S)
        return {"outcome": "timed out", "why": ""}

    async def _ask(self, message: Mapping[str, Any], visitor: Visitor) -> Answer:
        """Answer a message, or send it to the rig, a stop before all others."""
        tag = tag_of(message)
        plain = {key: value for key, value in message.items() if key != "tag"}
        try:
            match message.get("do"):
                case "stop":  # whatever else it says
                    stop = {key: message[key] for key in ("do", "why", "who")}
                    answer = await self._rig.stop(stop) | tag
                case "state":
                    asked = read_request(plain)
                    assert isinstance(asked, State)
                    answer = {"ok": await self._report(asked.after)} | tag
                case _:
                    answer = await self._rig.ask(message)
        except ValueError as error:
            answer = {"refused": str(error)} | tag
        match answer:
            case {"ok": {"reply": {"t_s": replied_s}}}:
                self._replied_s = replied_s
        return answer

    def _is_within_rate(self) -> bool:
        return self._rate.take(self._loop.time())

    # --- the websocket ------------------------------------------------------------------

    async def _socket(self, request: web.Request) -> web.StreamResponse:
        _require_websocket(request)
        wishes = parse_query(request, Wishes)
        self._websockets += 1
        visitor = self._visitor(request)
        client = ClientSocket(wishes, visitor, f"websocket {self._websockets}")
        socket = web.WebSocketResponse(
            max_msg_size=4 * REQUEST_BYTES, compress=True, autoping=False
        )
        await socket.prepare(request)
        self._connections.mark_websocket(request)
        client.orders.put_nowait({"do": "hello", "version": VERSION, "tag": "hello"})
        self._clients.add(client)
        if wishes.rig:
            for text in self._lasting.values():
                client.queue_text(text)
        excess = ExcessCount()
        try:
            with self._limits.occupy(visitor.name) as leave:
                await until_one_ends(
                    _outlasted(self._send(socket, client)),
                    self._receive(socket, client, request, excess),
                    self._carry_out(client),
                    _outlasted(self._renew(socket, client)),
                    self._over.wait(),
                    leave.wait(),
                )
        finally:
            self._clients.discard(client)
        await close_socket(socket, request, CLOSED if excess.is_over else "")
        return socket

    async def _send(self, socket: web.WebSocketResponse, client: ClientSocket) -> None:
        while not socket.closed:
            await client.news.wait()
            client.news.clear()
            async with asyncio.timeout(TAKES_S):
                if (ping := client.ping) is not None:
                    client.ping = None
                    await socket.pong(ping)
            while message := client.outgoing():
                async with asyncio.timeout(TAKES_S):
                    if isinstance(message, bytes):
                        await send_uncompressed(socket, message)
                    else:
                        await socket.send_str(message)

    async def _receive(
        self,
        socket: web.WebSocketResponse,
        client: ClientSocket,
        request: web.Request,
        excess: ExcessCount,
    ) -> None:
        """Receive messages; nothing here waits except a stop, so that a stop never waits.

        A client that sends far too many messages is disconnected, after the stops among those that
        it has sent.
        """
        loop, rate = asyncio.get_running_loop(), TokenBucket(_PER_S, _BURST)
        while not excess.is_over:
            frame = await socket.receive()
            if frame.type in _ENDS:
                return
            now_s = loop.time()
            late = frame.type is aiohttp.WSMsgType.TEXT and not rate.take(now_s)
            if late and not _may_stop(frame):
                client.drop_message()
            else:
                await self._take_frame(frame, client, late)
            excess.add(late, now_s)
        client.queue_message({"refused": CLOSED})
        for _ in range(_MOST_RESTS):
            with suppress(TimeoutError):
                async with asyncio.timeout(REST_S):
                    while (frame := await socket.receive()).type not in _ENDS:
                        if _may_stop(frame):
                            await self._take_frame(frame, client, late=True)
                    return
            if not _unread_bytes(request):
                return

    async def _take_frame(self, frame: aiohttp.WSMessage, client: ClientSocket, late: bool) -> None:
        """Take one message; of one that is too many only a stop is carried out."""
        if frame.type is aiohttp.WSMsgType.PING:
            client.ping = frame.data  # answered by the sender, as the client may not read
            client.news.set()
        elif frame.type is aiohttp.WSMsgType.PONG:
            client.alive.set()
        elif frame.type is not aiohttp.WSMsgType.TEXT:
            client.queue_message({"refused": "not text: one JSON object in each message"})
        else:
            try:
                await self._take_message(parse_message(frame.data), client, late)
            except MessageRefused as error:
                client.queue_message({"refused": str(error)})

    async def _take_message(
        self, message: dict[str, Any], client: ClientSocket, late: bool
    ) -> None:
        message = add_client(message, client.visitor, client.name)
        # A cookie with the name of a browser proves nothing.
        unconfirmed = client.visitor.browser and message.get("confirmed") is not True
        if message.get("do") == "stop":
            client.refuse_commands()
            client.queue_answer(message, await self._ask(message, client.visitor))
        elif late or client.orders.full() or not self._is_within_rate():
            client.queue_message({"refused": BUSY, **tag_of(message)})
        elif message.get("do") == "resume" and unconfirmed:
            client.queue_message({"refused": UNCONFIRMED, **tag_of(message)})
        else:
            client.orders.put_nowait(message)

    async def _carry_out(self, client: ClientSocket) -> None:
        """Send a client's messages to the rig, in order."""
        while True:
            message = await client.orders.get()
            answer = await self._ask(message, client.visitor)
            if message.get("do") == "hello" and "ok" in answer:
                answer["ok"]["you"] = client.visitor.name
            client.queue_answer(message, answer)

    async def _renew(self, socket: web.WebSocketResponse, client: ClientSocket) -> None:
        """Ping a client in control; each answer renews its control.

        A client that hangs or does not read loses control within a second, like one that has
        disconnected. An open connection proves nothing: after a computer is suspended or loses its
        network, it stays open for minutes.
        """
        while True:
            await asyncio.sleep(0.25 * HEARTBEAT_S)
            if not client.held:
                continue
            client.alive.clear()
            async with asyncio.timeout(TAKES_S):
                await socket.ping()
                await client.alive.wait()
            answer = await self._rig.ask({"do": "renew", "who": client.who})
            if "refused" in answer and TOO_MANY not in answer["refused"]:
                client.held.clear()  # another client, or no client, is in control

    async def _webcam(self, request: web.Request) -> web.StreamResponse:
        """Receive the images of a browser's webcam."""
        _require_websocket(request)
        socket = self.webcam.new_socket()
        await socket.prepare(request)
        self._connections.mark_websocket(request)
        with self._webcams.occupy(self._visitor(request).name) as leave:
            await until_one_ends(self.webcam.serve(socket), self._over.wait(), leave.wait())
        await close_socket(socket, request)
        return socket

    # --- the server behind the door -------------------------------------------------------

    async def _relay_view(self, request: web.Request) -> web.StreamResponse:
        if "upgrade" in request.headers:
            browser = self._visitor(request).browser
            return await self._view.relay(request, browser, self._over.wait())
        if request.path == VIEW:  # paths in the document are relative to it
            return web.Response(status=302, headers={"Location": f"{VIEW}/"})
        return await self._view.get(request)

    async def _not_found(self, request: web.Request) -> web.Response:
        return web.Response(status=404, text="there is no page at this address\n")


async def add_headers(request: web.Request, response: web.StreamResponse) -> None:
    """Add the headers of every answer."""
    response.headers.update(_FRAMED_HEADERS if request.path.startswith(VIEW) else _HEADERS)


def _require_websocket(request: web.Request) -> None:
    if "upgrade" not in request.headers:
        raise MessageRefused("this is a websocket", 426)


def _answer(answer: Mapping[str, object], status: int) -> web.Response:
    return web.Response(
        body=msgspec.json.encode(answer),
        status=status,
        content_type="application/json",
    )


def _line(**message: object) -> str:
    return msgspec.json.encode(message).decode()


def _unread_bytes(request: web.Request) -> int:
    """Return how much of what a client has sent waits in the kernel."""
    end = request.transport and request.transport.get_extra_info("socket")
    if not end:
        return 0
    (unread,) = struct.unpack("i", fcntl.ioctl(end.fileno(), termios.FIONREAD, bytes(4)))
    return int(unread)


def _may_stop(frame: aiohttp.WSMessage) -> bool:
    return (
        frame.type is aiohttp.WSMsgType.TEXT and find_stop(frame.data[:REQUEST_BYTES].encode()) >= 0
    )


async def _outlasted(sending: Awaitable[None]) -> None:
    """Await a task that sends; if it fails, leave time to receive what the client has sent."""
    try:
        await sending
    except (ConnectionError, TimeoutError):
        await asyncio.sleep(REST_S)
