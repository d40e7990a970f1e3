"""Relay of a browser's websocket to the server behind the door and back."""

import asyncio
from collections.abc import Awaitable
from contextlib import suppress

import aiohttp
from aiohttp import web

from gazerig.robot.dashboard.requests.token_bucket import TokenBucket

MESSAGES_PER_S, MESSAGES_BURST = 120.0, 240.0
"""Messages of one browser; a person who drags with two hands sends some 60 a second."""
BYTES_PER_S, BYTES_BURST = 1e6, 4e6
TAKES_S = 20.0
"""Timeout of sending to a browser, s; it reconnects after it is disconnected."""
_CLOSES_WITHIN_S = 1.0
"""Timeout of a browser's answer to the closing message, s."""

Socket = web.WebSocketResponse | aiohttp.ClientWebSocketResponse


async def relay_in(browser: web.WebSocketResponse, inside: Socket) -> None:
    """Relay a browser's messages, at a limited rate."""
    messages, size = (
        TokenBucket(MESSAGES_PER_S, MESSAGES_BURST),
        TokenBucket(BYTES_PER_S, BYTES_BURST),
    )
    loop = asyncio.get_running_loop()
    async for message in browser:
        if (wait_s := max(messages.wait_s(loop.time()), size.wait_s(loop.time()))) > 0.0:
            await asyncio.sleep(wait_s)
        messages.take(loop.time())
        size.take(loop.time(), len(message.data or ""))
        await _forward(message, inside)


async def relay_out(inside: Socket, browser: web.WebSocketResponse) -> None:
    """Relay the server's messages, as fast as the browser reads them.

    Raises:
        TimeoutError: it takes nothing any more.
    """
    async for message in inside:
        async with asyncio.timeout(TAKES_S):
            await _forward(message, browser)


async def until_one_ends(*works: Awaitable[object]) -> None:
    """Run all until one ends, and cancel the others."""
    tasks = {asyncio.ensure_future(work) for work in works}
    _, others = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    for task in others:
        task.cancel()
    await asyncio.gather(*tasks, return_exceptions=True)


async def close_socket(socket: web.WebSocketResponse, request: web.Request) -> None:
    """Close a browser's websocket; a browser that reads nothing does not read the closing message.

    Args:
        socket: to be closed.
        request: by which it was opened.
    """
    with suppress(TimeoutError, ConnectionError):
        async with asyncio.timeout(_CLOSES_WITHIN_S):
            await socket.close()
    if request.transport is not None:
        request.transport.abort()


async def _forward(message: aiohttp.WSMessage, there: Socket) -> None:
    if message.type is aiohttp.WSMsgType.BINARY:
        await there.send_bytes(message.data)
    elif message.type is aiohttp.WSMsgType.TEXT:
        await there.send_str(message.data)
