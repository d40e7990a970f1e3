"""JSON messages over WebSockets: connections to a neighbour, and from neighbours."""

import asyncio
import contextlib
import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Protocol
from urllib.parse import urlsplit

from aiohttp import ClientError, ClientSession, ClientWebSocketResponse, WSMsgType, web

from gazerig.doors.admission import MOST, page_refusal, user_refusal
from gazerig.doors.door import Address, DoorLink
from gazerig.doors.turn_taking import Orders, TurnTaking, UnknownMessage

MAX_BYTES = 4_000_000
"""Longest message."""
_MAX_PER_S = 500
"""Messages per second that are read; of a flood, the rest waits at its sender."""
_HEARTBEAT_S = 20.0
ERRORS = (OSError, TimeoutError, ClientError)
"""Errors of a connection."""


class Translator(Protocol):
    """Messages of one connection as orders."""

    talk: TurnTaking

    def take(self, message: Mapping[str, Any], now_s: float) -> Orders:
        """Return the orders for a message.

        Raises:
            UnknownMessage: the door does not know it.
        """


class Intake:
    """Reads the messages of one connection: bad ones are reported once, and a flood is slowed.

    Args:
        link: The head.
        translator: What the messages mean.
    """

    def __init__(self, link: DoorLink, translator: Translator) -> None:
        self._link, self._translator = link, translator
        self._second_s, self._count = link.now_s(), 0

    async def read(self, socket: ClientWebSocketResponse | web.WebSocketResponse) -> None:
        """Read the messages of a connection until it ends, and with it the conversation."""
        try:
            async for message in socket:
                if message.type in (WSMsgType.TEXT, WSMsgType.BINARY):
                    await self.take(message.data)
        finally:
            self.end()

    async def take(self, text: str | bytes) -> None:
        """Read one message."""
        await self.slow_down()
        try:
            message = json.loads(text)
            if not isinstance(message, dict):
                raise ValueError(f"expected an object, not {type(message).__name__}")
        except (ValueError, RecursionError) as error:
            self._link.report(
                f"a message is ignored, because it is not a JSON object ({error}); check the "
                "neighbour's address and version"
            )
            return
        self.translate(message)

    def translate(self, message: Mapping[str, Any]) -> None:
        """Send the orders for a message to the head."""
        try:
            self._link.send(self._translator.take(message, self._link.now_s()))
        except UnknownMessage as error:
            self._link.report(str(error))

    async def slow_down(self) -> None:
        """Count a message; wait for the next second if there were too many."""
        now_s = self._link.now_s()
        if now_s - self._second_s >= 1.0:
            self._second_s, self._count = now_s, 0
        self._count += 1
        if self._count > _MAX_PER_S:
            self._link.report(f"more than {_MAX_PER_S} messages a second: they are slowed down")
            await asyncio.sleep(self._second_s + 1.0 - now_s)

    def end(self) -> None:
        """End the conversation with the connection."""
        self._link.send(self._translator.talk.end())


async def follow_socket(
    link: DoorLink, make: Callable[[], Translator], neighbour: str, remedy: str = ""
) -> None:  # fmt: skip
    """Follow a neighbour's WebSocket at the link's address; reconnect for ever.

    Args:
        link: The head.
        make: Creates the translator of a connection.
        neighbour: What the door waits for.
        remedy: What to do if it does not come.
    """

    async def follow() -> None:
        async with (
            ClientSession() as session,
            session.ws_connect(
                link.address, heartbeat=_HEARTBEAT_S, max_msg_size=MAX_BYTES
            ) as socket,
        ):
            link.report(f"connected to {link.address}")
            await Intake(link, make()).read(socket)

    if urlsplit(link.address).scheme not in ("ws", "wss", "http", "https"):
        import gazerig

        raise gazerig.Error(f"{link.address!r} is not ws://HOST:PORT or wss://HOST/PATH")
    await link.keep(follow, f"{neighbour} at {link.address}", remedy, ERRORS)


async def receive_sockets(link: DoorLink, make: Callable[[], Translator], neighbour: str) -> None:
    """Receive the messages of neighbours that connect to the door, for ever.

    Args:
        link: The head.
        make: Creates the translator of a connection.
        neighbour: What the door waits for.
    """

    async def handle(request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse(heartbeat=_HEARTBEAT_S, max_msg_size=MAX_BYTES)
        await socket.prepare(request)
        await Intake(link, make()).read(socket)
        return socket

    await listen(link, handle, neighbour)


async def listen(
    link: DoorLink,
    handle: Callable[[web.Request], Awaitable[web.WebSocketResponse]],
    neighbour: str,
) -> None:
    """Accept WebSockets at the link's bind address, for ever.

    Web pages and, on the loopback, other users of this computer are refused.

    Args:
        link: The head.
        handle: Serves a request.
        neighbour: What the door waits for.

    Raises:
        OSError: the port is not free.
    """
    connections: set[asyncio.Transport] = set()

    async def admit(request: web.Request) -> web.StreamResponse:
        transport = request.transport
        if transport is None:
            raise web.HTTPForbidden  # it has disconnected
        port = transport.get_extra_info("sockname")[1]
        refused = page_refusal(link.bind, port, request.headers)
        if refused := refused or user_refusal(link.bind, transport):
            link.report(refused)
            raise web.HTTPForbidden(text=refused)
        if not web.WebSocketResponse().can_prepare(request):
            raise web.HTTPUpgradeRequired
        if len(connections) >= MOST:
            link.report(f"more than {MOST} connections at once: the newest is refused")
            raise web.HTTPServiceUnavailable
        connections.add(transport)
        try:
            return await handle(request)
        finally:
            connections.discard(transport)

    app = web.Application()
    app.router.add_get("/{path:.*}", admit)
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.5, handler_cancellation=True)
    await runner.setup()
    try:
        host, port = Address.parse(link.bind)
        await web.TCPSite(runner, host, port).start()
        link.report(f"waiting for {neighbour} on ws://{link.bind}")
        await asyncio.Event().wait()
    finally:
        with contextlib.suppress(asyncio.CancelledError):
            await runner.cleanup()
