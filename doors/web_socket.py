"""JSON messages over WebSockets: connections to a neighbour, and from neighbours."""

import asyncio
import contextlib
import json
from collections.abc import Awaitable, Callable, Mapping
from typing import Any, Protocol
from urllib.parse import urlsplit

from aiohttp import ClientError, ClientSession, ClientWebSocketResponse, WSMsgType, web

from gazerig.doors.door import Address, DoorLink
from gazerig.doors.turn_taking import Orders, TurnTaking, UnknownMessage

MAX_BYTES = 16_000_000
"""Longest message."""
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

    def addressed(self, person: int | None) -> Mapping[str, Any] | None:
        """Return the message that a person addresses the head, or that nobody does."""


class Intake:
    """Reads the messages of one connection; bad ones are reported once.

    Args:
        link: The head.
        translator: What the messages mean.
    """

    def __init__(self, link: DoorLink, translator: Translator) -> None:
        self._link, self._translator = link, translator

    async def read(self, socket: ClientWebSocketResponse | web.WebSocketResponse) -> None:
        """Read the messages of a connection until it ends, and with it the conversation."""

        async def tell(person: int | None) -> None:
            if (message := self._translator.addressed(person)) is not None:
                await socket.send_json(message)

        try:
            with self._link.on_addressed(tell):
                async for message in socket:
                    if message.type in (WSMsgType.TEXT, WSMsgType.BINARY):
                        self.take(message.data)
        finally:
            self._link.send(self._translator.talk.end())

    def take(self, text: str | bytes) -> None:
        """Read one message."""
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
        try:
            self._link.send(self._translator.take(message, self._link.now_s()))
        except UnknownMessage as error:
            self._link.report(str(error))


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

    Web pages are refused.

    Args:
        link: The head.
        handle: Serves a request.
        neighbour: What the door waits for.

    Raises:
        OSError: the port is not free.
    """
    host, port = Address.parse(link.bind)

    async def admit(request: web.Request) -> web.StreamResponse:
        if refused := page_refusal(port, request.headers.get("Origin")):
            link.report(refused)
            raise web.HTTPForbidden(text=refused)
        return await handle(request)

    app = web.Application()
    app.router.add_get("/{path:.*}", admit)
    runner = web.AppRunner(app, access_log=None, shutdown_timeout=0.5, handler_cancellation=True)
    await runner.setup()
    try:
        await web.TCPSite(runner, host, port).start()
        link.report(f"waiting for {neighbour} on ws://{link.bind}")
        await asyncio.Event().wait()
    finally:
        with contextlib.suppress(asyncio.CancelledError):
            await runner.cleanup()


def page_refusal(port: int, origin: str | None) -> str:
    """Return why a request is refused as that of a web page, "" if it is not.

    Browsers write the page's address into Origin, also if its name leads to this computer (DNS
    rebinding); no page has the door's own.

    Args:
        port: Port of the door.
        origin: The header of the request, None without it.
    """
    own = [f"http://{name}:{port}" for name in ("127.0.0.1", "[::1]", "localhost")]
    if origin is None or origin in own:
        return ""
    return (
        f"a web page of {origin or 'no address':.60} was refused; let a program connect, which "
        "sends no Origin"
    )
