"""Websockets of the page: webcam, and the relay to the server behind the door."""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress

import aiohttp
from aiohttp import web

from gazerig.drivers.camera.shared_slots import MOST_BYTES
from gazerig.robot.net.excess import TokenBucket

MESSAGES_PER_S, MESSAGES_BURST = 120.0, 240.0
"""Rate limit of one browser's viewpoints."""
TAKES_S = 20.0
"""Timeout of sending to a browser, s; it reconnects after it is disconnected."""
_CLOSES_WITHIN_S = 1.0
"""Timeout for a browser's answer to the closing message, s."""

Socket = web.WebSocketResponse | aiohttp.ClientWebSocketResponse


async def relay_in(browser: web.WebSocketResponse, inside: Socket) -> None:
    """Relay a browser's messages, at a limited rate."""
    loop, rate = asyncio.get_running_loop(), TokenBucket(MESSAGES_PER_S, MESSAGES_BURST)
    async for message in browser:
        if (wait_s := rate.wait_s(loop.time())) > 0.0:
            await asyncio.sleep(wait_s)
        rate.take(loop.time())
        await _forward(message, inside)


async def relay_out(inside: Socket, browser: web.WebSocketResponse) -> None:
    """Relay the server's messages, no faster than the browser reads them.

    Raises:
        TimeoutError: the browser reads no more messages.
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


async def close_socket(
    socket: web.WebSocketResponse, request: web.Request, refusal: str = ""
) -> None:
    """Close a browser's websocket, also one that does not read the closing message."""
    code = aiohttp.WSCloseCode.POLICY_VIOLATION if refusal else aiohttp.WSCloseCode.OK
    with suppress(TimeoutError, ConnectionError):
        async with asyncio.timeout(_CLOSES_WITHIN_S):
            await socket.close(code=code, message=refusal.encode())
    if request.transport is not None:
        request.transport.abort()


async def send_uncompressed(socket: web.WebSocketResponse, data: bytes) -> None:
    """Send bytes as they are over a socket that compresses other messages."""
    writer = socket._writer
    assert writer is not None
    writer.compress, compress = 0, writer.compress
    try:
        await socket.send_bytes(data)
    finally:
        writer.compress = compress


async def _forward(message: aiohttp.WSMessage, there: Socket) -> None:
    if message.type is aiohttp.WSMsgType.BINARY:
        await there.send_bytes(message.data)
    elif message.type is aiohttp.WSMsgType.TEXT:
        await there.send_str(message.data)


PICTURES_PER_S, _BURST = 20.0, 5.0
_JPEG = b"\xff\xd8\xff"

TakePicture = Callable[[bytes], bool]
"""Sends an image to the rig; returns False if it is not accepted now."""


class WebcamSocket:
    """Receives images of one browser at a time."""

    def __init__(self, now_s: Callable[[], float], take: TakePicture) -> None:
        self._take = take
        self._now_s = now_s
        self._rate = TokenBucket(PICTURES_PER_S, _BURST)
        self._newest: web.WebSocketResponse | None = None

    @staticmethod
    def new_socket() -> web.WebSocketResponse:
        """Return a websocket that accepts one image at a time."""
        return web.WebSocketResponse(max_msg_size=MOST_BYTES, compress=False)

    async def serve(self, socket: web.WebSocketResponse) -> None:
        """Receive images until the browser ends, sends other data, or another takes over."""
        self._newest = socket
        async for message in socket:
            if self._newest is not socket:
                await _send_text(socket, "another browser's camera has taken over")
                return
            if message.type is not aiohttp.WSMsgType.BINARY or not message.data.startswith(_JPEG):
                await _send_text(socket, "only JPEG pictures are taken here")
                return
            if self._rate.take(self._now_s()):
                self._take(message.data)
            await _send_text(socket, "next")


async def _send_text(socket: web.WebSocketResponse, text: str) -> None:
    async with asyncio.timeout(TAKES_S):
        await socket.send_str(text)
