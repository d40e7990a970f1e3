"""Viser server behind the page's door, and the door's proxy to it.

Viser draws the 3-D view in a frame of the page. It authenticates no client: on a port of the
loopback every user of the machine, and every page that is open in a browser here, could connect to
it and bypass the door. So it listens on a Unix socket that no other user can reach.
"""

import asyncio
import contextlib
import functools
import socket
from collections.abc import Awaitable, Iterator
from pathlib import Path
from typing import Any

import aiohttp
import viser
import websockets.asyncio.server as websocket_server
from aiohttp import web
from viser import _messages
from yarl import URL

from gazerig.robot.dashboard.door.browsers import Connections, TabLimits
from gazerig.robot.dashboard.door.sockets import (
    close_socket,
    relay_in,
    relay_out,
    until_one_ends,
)
from gazerig.robot.net.excess import TokenBucket

TO_BROWSER_BYTES = 1 << 25
"""Longest message to a browser, bytes."""
FROM_BROWSER_BYTES = 1 << 14
"""Longest message from a browser, bytes; its viewpoint has 300."""


def open_server(socket_path: Path) -> viser.ViserServer:
    """Open a server on a new Unix socket, in a folder of this user only.

    Raises:
        OSError: the socket cannot be created.
    """
    with _listening_inside(socket_path):
        server = viser.ViserServer(host="127.0.0.1", port=0, label="gazerig", verbose=False)
    # A browser must not be able to publish this page on the internet.
    for publish in (_messages.ShareUrlRequest, _messages.ShareUrlDisconnect):
        server._websock_server.unregister_handler(publish)
    return server


@contextlib.contextmanager
def _listening_inside(path: Path) -> Iterator[None]:
    """Within the block, make viser's server, which supports only ports, listen on a socket file."""
    serve = websocket_server.serve
    # Bound here: viser would try again and then wait without end, if the folder of a killed rig
    # has been removed meanwhile.
    listener = socket.socket(socket.AF_UNIX)
    listener.bind(str(path))

    @functools.wraps(serve)
    def for_the_door(handler: object, host: str, port: int, **settings: Any) -> object:
        settings["max_size"] = FROM_BROWSER_BYTES
        return serve(handler, unix=True, sock=listener, **settings)  # type: ignore[arg-type]

    websocket_server.serve = for_the_door  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        websocket_server.serve = serve  # type: ignore[misc]


VIEW = "/view"
"""Folder of the view in the page's addresses; the server behind the door does not use it."""
MOST_TABS = 16
"""Largest number of tabs that show the page."""

_OWN_TAGS = b'<link rel="stylesheet" href="/rig/view.css"><script src="/rig/view.js"></script>'
_HEAD_END = b"</head>"
_TABS_PER_S, _TABS_BURST = 2.0, 20.0  # each tab receives the whole state, which takes a moment
# Headers of a single connection, which a proxy must not forward (RFC 9110, 7.6.1).
_ONE_LEG = {"connection", "transfer-encoding", "content-encoding", "content-length", "keep-alive"}
_PLAIN = {"Accept-Encoding": "identity"}


def view_client(socket_path: Path) -> aiohttp.ClientSession:
    """Return a client of the server behind the door; called in the door's event loop."""
    connector = aiohttp.UnixConnector(str(socket_path), limit=0)
    return aiohttp.ClientSession(connector=connector, auto_decompress=True)


class ViewProxy:
    """Proxy to viser behind the door; used in the door's event loop."""

    def __init__(self, client: aiohttp.ClientSession, connections: Connections) -> None:
        self._client, self._connections = client, connections
        self._tabs = TabLimits(MOST_TABS)
        self._tab_rate = TokenBucket(_TABS_PER_S, _TABS_BURST)

    async def get(self, request: web.Request) -> web.StreamResponse:
        """Return a file of viser; add the page's style and script for the view to its document."""
        async with self._client.get(_address("http", request), headers=_PLAIN) as inside:
            body = await inside.read()
            headers = {k: v for k, v in inside.headers.items() if k.lower() not in _ONE_LEG}
            status = inside.status
        if headers.get("Content-Type", "").startswith("text/html"):
            body = body.replace(_HEAD_END, _OWN_TAGS + _HEAD_END, 1)
        return web.Response(status=status, body=body, headers=headers)

    async def relay(
        self, request: web.Request, who: str, over: Awaitable[object]
    ) -> web.StreamResponse:
        """Relay a browser's websocket to the server and back, at the speed of the slower side."""
        if not self._tab_rate.take(asyncio.get_running_loop().time()):
            return web.Response(status=429, text="too many tabs at once\n")
        words = request.headers.get("Sec-WebSocket-Protocol", "")
        offered = [word.strip() for word in words.split(",") if words]
        browser = web.WebSocketResponse(
            protocols=offered, max_msg_size=FROM_BROWSER_BYTES, compress=False
        )
        with self._tabs.occupy(who) as leave:
            async with self._client.ws_connect(
                _address("ws", request),
                protocols=offered,
                max_msg_size=TO_BROWSER_BYTES,
                compress=0,
            ) as inside:
                await browser.prepare(request)
                self._connections.mark_websocket(request)
                await until_one_ends(
                    relay_in(browser, inside), relay_out(inside, browser), over, leave.wait()
                )
        await close_socket(browser, request)
        return browser


def _address(scheme: str, request: web.Request) -> URL:
    """Return the address of the server behind the door, without the folder of the view."""
    path = request.rel_url.raw_path_qs.removeprefix(VIEW).lstrip("/")
    return URL(f"{scheme}://page/{path}", encoded=True)
