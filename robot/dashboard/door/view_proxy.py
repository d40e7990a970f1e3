"""Proxy to viser, which draws the 3-D view in a frame of the page."""

import asyncio
import socket
from collections.abc import Awaitable, Mapping

import aiohttp
from aiohttp import web
from aiohttp.abc import AbstractResolver, ResolveResult
from yarl import URL

from gazerig.robot.dashboard.door.browsers import TabLimits
from gazerig.robot.dashboard.door.connection_limits import Connections
from gazerig.robot.dashboard.door.viser_server import (
    BROWSER_HEADER,
    FROM_BROWSER_BYTES,
    KEY_HEADER,
    TO_BROWSER_BYTES,
    ViewAddress,
)
from gazerig.robot.dashboard.door.websocket_relay import (
    close_socket,
    relay_in,
    relay_out,
    until_one_ends,
)
from gazerig.robot.dashboard.requests.token_bucket import TokenBucket

VIEW = "/view"
"""Folder of the view in the page's addresses; the server behind the door does not use it."""
MOST_TABS = 16
"""Largest number of tabs that show the page."""

_STYLE_TAG = b'<link rel="stylesheet" href="/rig/view.css">'
_HEAD_END = b"</head>"
_TABS_PER_S, _TABS_BURST = 2.0, 20.0  # each receives the whole state, which takes a moment
# Headers of a single connection, which a proxy must not forward (RFC 9110, 7.6.1).
_ONE_LEG = {"connection", "transfer-encoding", "content-encoding", "content-length", "keep-alive"}
_PLAIN = {"Accept-Encoding": "identity"}
# The page itself shows it in a frame, and no other page may.
_FRAMED = {
    "X-Frame-Options": "SAMEORIGIN",
    "Content-Security-Policy": "frame-ancestors 'self'",
}


class _OnlyInside(AbstractResolver):
    """Resolver that returns one address for every name."""

    def __init__(self, port: int) -> None:
        self._port = port

    async def resolve(
        self, host: str, port: int = 0, family: socket.AddressFamily = socket.AF_INET
    ) -> list[ResolveResult]:
        """Return the server's address."""
        return [
            ResolveResult(
                hostname=host,
                host="127.0.0.1",
                port=self._port,
                family=socket.AF_INET,
                proto=0,
                flags=socket.AI_NUMERICHOST,
            )
        ]

    async def close(self) -> None:
        """Close nothing."""


def client_of(inside: ViewAddress) -> aiohttp.ClientSession:
    """Return a client of the server behind the door; called in the door's event loop."""
    connector: aiohttp.BaseConnector
    if inside.path is not None:
        connector = aiohttp.UnixConnector(str(inside.path), limit=0)
    else:
        connector = aiohttp.TCPConnector(limit=0, resolver=_OnlyInside(inside.port))
    return aiohttp.ClientSession(
        connector=connector, auto_decompress=True, headers={KEY_HEADER: inside.key}
    )


class ViewProxy:
    """Proxy to viser behind the door; used in the door's event loop.

    Args:
        client: reaches the server.
        connections: of the door.
        headers: of every answer.
    """

    def __init__(
        self,
        client: aiohttp.ClientSession,
        connections: Connections,
        headers: Mapping[str, str],
    ) -> None:
        self._client, self._connections = client, connections
        self._headers = {**headers, **_FRAMED}
        self._tabs = TabLimits(MOST_TABS)
        self._tab_rate = TokenBucket(_TABS_PER_S, _TABS_BURST)

    async def get(self, request: web.Request) -> web.StreamResponse:
        """Return a file of viser; its document gets the page's style for the view."""
        async with self._client.get(_address("http", request), headers=_PLAIN) as inside:
            body = await inside.read()
            headers = {k: v for k, v in inside.headers.items() if k.lower() not in _ONE_LEG}
            status = inside.status
        if headers.get("Content-Type", "").startswith("text/html"):
            body = body.replace(_HEAD_END, _STYLE_TAG + _HEAD_END, 1)
        return web.Response(status=status, body=body, headers={**headers, **self._headers})

    async def relay(
        self, request: web.Request, who: str, over: Awaitable[object]
    ) -> web.StreamResponse:
        """Relay a browser's websocket to the server and back, at the speed of the slower side.

        Args:
            request: to open it.
            who: Name of the browser.
            over: ends the connection.
        """
        if not self._tab_rate.take(asyncio.get_running_loop().time()):
            return web.Response(status=429, text="too many tabs at once\n", headers=self._headers)
        offered = [
            word.strip()
            for word in request.headers.get("Sec-WebSocket-Protocol", "").split(",")
            if word.strip()
        ]
        browser = web.WebSocketResponse(
            protocols=offered, max_msg_size=FROM_BROWSER_BYTES, compress=False
        )
        with self._tabs.take(who) as leave:
            async with self._client.ws_connect(
                _address("ws", request),
                protocols=offered,
                headers={BROWSER_HEADER: who},
                max_msg_size=TO_BROWSER_BYTES,
                compress=0,
            ) as inside:
                await browser.prepare(request)
                self._connections.lasting(request)
                await until_one_ends(
                    relay_in(browser, inside), relay_out(inside, browser), over, leave.wait()
                )
        await close_socket(browser, request)
        return browser


def _address(scheme: str, request: web.Request) -> URL:
    """Return the address of the server behind the door, without the folder of the view."""
    path = request.rel_url.raw_path_qs.removeprefix(VIEW).lstrip("/")
    return URL(f"{scheme}://page/{path}", encoded=True)
