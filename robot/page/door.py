"""The page's door: the only way in, at the asked address, for those who may come in.

A reverse proxy before viser, which itself listens on the loopback alone and turns away
everybody who does not come through here (``robot.page.server``). On a loopback address
whoever is on this machine may come in, but no page of another origin: the Origin of every
websocket and of everything that is sent must be the address of this page, and that address
must be a name of the loopback, or a foreign name made to point here would do (DNS
rebinding). On any other address a token is asked for as well, once, in the query of the
first address; a cookie takes its place.

It also serves what must work whatever viser does: the stop button, written into the page,
and what the button talks to.
"""

import asyncio
import hmac
import json
import secrets
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from urllib.parse import urlsplit

import aiohttp
from aiohttp import web
from aiohttp.typedefs import Handler, Middleware

SECRET_HEADER = "X-Gazerig-Door"
"""Says to the server behind the door that somebody has come through it."""
LOOPBACK = ("127.0.0.1", "::1", "localhost")

_SCRIPT = Path(__file__).with_name("stop.js")
_SCRIPT_TAG = b'<script src="/rig/stop.js"></script>'
_HEAD = b"<head>"
_MOST_ASKED_BYTES = 65536
_BEAT_S = 1.0
_OPEN_PATIENCE_S = 20.0
_CLOSE_PATIENCE_S = 3.0
# What a proxy must not hand on: it is about one leg of the way (RFC 9110, 7.6.1).
_ONE_LEG = {"connection", "transfer-encoding", "content-encoding", "content-length", "keep-alive"}
_HEADERS = {
    "X-Frame-Options": "DENY",  # nobody may lay a page of theirs over the buttons
    "Referrer-Policy": "no-referrer",
    "Cache-Control": "no-store",
}
_PLAIN = {"Accept-Encoding": "identity"}

Ask = Callable[[bytes], bool]
"""Hands a JSON object to the rig; False where the rig does not take it."""


def needs_token(host: str) -> bool:
    """Tell whether others than this machine can reach an address."""
    return host not in LOOPBACK


class Door:
    """Lets people in to the server behind it, from a thread of its own."""

    def __init__(self, host: str, port: int, inside_port: int, secret: str, ask: Ask) -> None:
        """Take the address, a free port of it, the server's loopback port and its secret.

        ask: called in the door's thread with what is sent to the rig
        """
        self._host = host
        self._port = port
        self._inside = f"127.0.0.1:{inside_port}"
        self._secret = secret
        self._ask = ask
        self.token = secrets.token_urlsafe(24) if needs_token(host) else None
        self._cookie = f"gazerig_{port}"  # cookies do not tell ports apart
        self._state: bytes = b"{}"
        self._news: set[asyncio.Event] = set()
        self._loop = asyncio.new_event_loop()
        self._over = asyncio.Event()
        self._opened = threading.Event()
        self._failed: OSError | None = None
        self._thread = threading.Thread(target=self._run, name="page door", daemon=True)

    def open(self) -> None:
        """Listen.

        Raises:
            OSError: the address cannot be listened on.
        """
        self._thread.start()
        if not self._opened.wait(_OPEN_PATIENCE_S):
            raise OSError("the page's door did not open in time")
        if self._failed is not None:
            raise self._failed

    def tell(self, state: Mapping[str, object]) -> None:
        """Show this to everybody who looks at the stop button; from any thread."""
        data = json.dumps(state).encode()
        if data != self._state:
            self._state = data
            self._loop.call_soon_threadsafe(self._wake)

    def close(self) -> None:
        """Send everybody away."""
        if self._thread.is_alive():
            self._loop.call_soon_threadsafe(self._over.set)
            self._thread.join(_CLOSE_PATIENCE_S)

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        app = web.Application(middlewares=[self._doorkeeper()], client_max_size=_MOST_ASKED_BYTES)
        app.router.add_get("/rig/stop.js", self._script)
        app.router.add_get("/rig/state", self._stream)
        app.router.add_post("/rig/ask", self._asked)
        app.router.add_get("/{path:.*}", self._pass_on)
        runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.5)
        await runner.setup()
        try:
            await web.TCPSite(runner, self._host, self._port, reuse_address=True).start()
        except OSError as error:
            self._failed = error
            return
        finally:
            self._opened.set()
        self._client = aiohttp.ClientSession(auto_decompress=True)
        async with self._client:
            await self._over.wait()
            self._wake()
            await runner.cleanup()

    # --- who may come in ----------------------------------------------------------------

    def _doorkeeper(self) -> Middleware:
        """Let in, send on without the token in the address, or refuse in one line."""

        @web.middleware
        async def admit(request: web.Request, handler: Handler) -> web.StreamResponse:
            why_not = self._refusal(request)
            if why_not is not None:
                return web.Response(status=403, text=f"{why_not}\n", headers=_HEADERS)
            if "token" in request.query:
                return self._with_cookie(request)
            return await handler(request)

        return admit

    def _refusal(self, request: web.Request) -> str | None:
        """Say why somebody may not come in, None for those who may."""
        sends = request.method not in ("GET", "HEAD") or "upgrade" in request.headers
        origin = request.headers.get("Origin")
        if origin is None and sends:
            return "refused: no Origin; only a browser with this page open may ask for anything"
        if origin is not None and urlsplit(origin).netloc != request.host:
            return "refused: a page of another origin may not look or ask"
        if self.token is None:
            if urlsplit(f"//{request.host}").hostname not in LOOPBACK:
                return f"refused: on this machine the page is at http://{self._host}:{self._port}"
            return None
        given = request.query.get("token") or request.cookies.get(self._cookie) or ""
        if hmac.compare_digest(given.encode(), self.token.encode()):
            return None
        return "refused: open the address with the token that the rig showed when it started"

    def _with_cookie(self, request: web.Request) -> web.Response:
        """Take the token out of the address, so that it is not seen, kept or sent on."""
        clean = request.url.with_query(
            {key: value for key, value in request.query.items() if key != "token"}
        )
        answer = web.Response(status=302, headers={**_HEADERS, "Location": clean.raw_path_qs})
        if self.token is not None:
            answer.set_cookie(self._cookie, self.token, httponly=True, samesite="Strict", path="/")
        return answer

    # --- the stop button ------------------------------------------------------------------

    async def _script(self, request: web.Request) -> web.Response:
        return web.Response(
            body=_SCRIPT.read_bytes(), content_type="text/javascript", headers=_HEADERS
        )

    async def _asked(self, request: web.Request) -> web.Response:
        """Hand what is asked for to the rig, and say whether it was taken."""
        data = compact(await request.read())
        if data is None:
            return web.Response(status=400, text="not a JSON object\n")
        if not self._ask(data):
            return web.Response(status=503, text="the rig does not take it\n")
        return web.Response(status=204)

    async def _stream(self, request: web.Request) -> web.StreamResponse:
        """Send the state whenever it changes, and a sign of life in between."""
        answer = web.StreamResponse(headers={**_HEADERS, "Content-Type": "text/event-stream"})
        await answer.prepare(request)
        news = asyncio.Event()
        self._news.add(news)
        try:
            while not self._over.is_set():
                news.clear()
                await answer.write(b"data: " + self._state + b"\n\n")
                try:
                    await asyncio.wait_for(news.wait(), _BEAT_S)
                except TimeoutError:
                    continue
        except ConnectionError:  # the browser has gone
            return answer
        finally:
            self._news.discard(news)
        return answer

    def _wake(self) -> None:
        for news in self._news:
            news.set()

    # --- the server behind the door -------------------------------------------------------

    async def _pass_on(self, request: web.Request) -> web.StreamResponse:
        if "upgrade" in request.headers:
            return await self._relay(request)
        url = f"http://{self._inside}{request.raw_path}"
        async with self._client.get(url, headers=_PLAIN) as inside:
            body = await inside.read()
            headers = {k: v for k, v in inside.headers.items() if k.lower() not in _ONE_LEG}
            status = inside.status
        if headers.get("Content-Type", "").startswith("text/html"):
            body = body.replace(_HEAD, _HEAD + _SCRIPT_TAG, 1)
        return web.Response(status=status, body=body, headers={**headers, **_HEADERS})

    async def _relay(self, request: web.Request) -> web.WebSocketResponse:
        """Carry a browser's websocket to the server and back, each side as slow as the other."""
        offered = [
            word.strip()
            for word in request.headers.get("Sec-WebSocket-Protocol", "").split(",")
            if word.strip()
        ]
        browser = web.WebSocketResponse(protocols=offered, max_msg_size=0, compress=False)
        async with self._client.ws_connect(
            f"ws://{self._inside}{request.raw_path}",
            protocols=offered,
            headers={SECRET_HEADER: self._secret},
            max_msg_size=0,
            compress=0,
        ) as inside:
            await browser.prepare(request)
            ways = {
                asyncio.ensure_future(_carry(browser, inside)),
                asyncio.ensure_future(_carry(inside, browser)),
                asyncio.ensure_future(self._over.wait()),
            }
            _, still = await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            for way in still:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)
        await browser.close()
        return browser


Socket = web.WebSocketResponse | aiohttp.ClientWebSocketResponse


async def _carry(here: Socket, there: Socket) -> None:
    """Carry messages one way; ``send`` waits where the other side takes them slowly."""
    async for message in here:
        if message.type is aiohttp.WSMsgType.BINARY:
            await there.send_bytes(message.data)
        elif message.type is aiohttp.WSMsgType.TEXT:
            await there.send_str(message.data)


def compact(body: bytes) -> bytes | None:
    """Give a JSON object without blanks, None where it is none."""
    try:
        data = json.loads(body)
    except ValueError:
        return None
    return json.dumps(data, separators=(",", ":")).encode() if isinstance(data, dict) else None
