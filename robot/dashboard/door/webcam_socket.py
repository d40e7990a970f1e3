"""Websocket for the images of a browser's webcam, one image at a time.

The browser sends a JPEG and waits for the answer "next" before it sends another, so that a slow rig
or a slow connection results in fewer images and no queue. Only one browser sends: the newest.
"""

import asyncio
from collections.abc import Callable

import aiohttp
from aiohttp import web

from gazerig.drivers.camera.jpeg_slot import MOST_BYTES
from gazerig.robot.dashboard.door.websocket_relay import TAKES_S
from gazerig.robot.dashboard.requests.token_bucket import TokenBucket

PICTURES_PER_S, _BURST = 20.0, 5.0
_JPEG = b"\xff\xd8\xff"

TakePicture = Callable[[bytes], bool]
"""Sends an image to the rig; returns False if it is not accepted now."""


class WebcamSocket:
    """Receives images of one browser at a time.

    Args:
        now_s: the clock of the event loop.
        take: receives pictures.
    """

    def __init__(self, now_s: Callable[[], float], take: TakePicture) -> None:
        self._take = take
        self._now_s = now_s
        self._rate = TokenBucket(PICTURES_PER_S, _BURST)
        self._newest: web.WebSocketResponse | None = None

    @staticmethod
    def prepared() -> web.WebSocketResponse:
        """Return a websocket that accepts one image at a time."""
        return web.WebSocketResponse(max_msg_size=MOST_BYTES, compress=False)

    async def serve(self, socket: web.WebSocketResponse) -> None:
        """Receive images until the browser ends, sends other data, or another takes over."""
        self._newest = socket
        async for message in socket:
            if self._newest is not socket:
                await _say(socket, "another browser's camera has taken over")
                return
            if message.type is not aiohttp.WSMsgType.BINARY or not message.data.startswith(_JPEG):
                await _say(socket, "only JPEG pictures are taken here")
                return
            if self._rate.take(self._now_s()):
                self._take(message.data)
            await _say(socket, "next")


async def _say(socket: web.WebSocketResponse, text: str) -> None:
    async with asyncio.timeout(TAKES_S):
        await socket.send_str(text)
