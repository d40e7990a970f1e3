"""Websocket of the page's panels: sends changes, receives the input of users."""

import asyncio
from concurrent.futures import ThreadPoolExecutor

import aiohttp
from aiohttp import web

from gazerig.robot.dashboard.door.websocket_relay import (
    MESSAGES_BURST,
    MESSAGES_PER_S,
    TAKES_S,
    until_one_ends,
)
from gazerig.robot.dashboard.requests.token_bucket import TokenBucket
from gazerig.robot.dashboard.widgets.widgets import Client, Widgets

_PAUSE_S = 0.04
"""Time between messages to a browser, s: 25 a second, more cannot be read."""


class WidgetSocket:
    """Sends the panels to browsers, to each as fast as it reads them.

    Args:
        widgets: all panels.
    """

    def __init__(self, widgets: Widgets) -> None:
        self._widgets = widgets
        # Input of users is handled in a separate thread, in order: a STOP through the same loop
        # must not wait for it.
        self._worker = ThreadPoolExecutor(1, thread_name_prefix="page panels")

    async def serve(self, socket: web.WebSocketResponse, browser: str) -> None:
        """Serve a connection of a browser until it ends."""
        loop, news = asyncio.get_running_loop(), asyncio.Event()

        def wake() -> None:
            loop.call_soon_threadsafe(news.set)

        client = await loop.run_in_executor(self._worker, self._widgets.join, browser, wake)
        try:
            await until_one_ends(self._send(socket, client, news), self._receive(socket, client))
        finally:
            await asyncio.shield(loop.run_in_executor(self._worker, self._widgets.leave, client))

    def close(self) -> None:
        """End the thread."""
        self._worker.shutdown(wait=False, cancel_futures=True)

    async def _send(
        self, socket: web.WebSocketResponse, client: Client, news: asyncio.Event
    ) -> None:
        while not socket.closed:
            await news.wait()
            news.clear()
            message = self._widgets.outgoing(client)
            if message is None:
                continue
            async with asyncio.timeout(TAKES_S):
                if message.text:
                    await socket.send_str(message.text)
                for image in message.images:
                    await socket.send_bytes(image)
            await asyncio.sleep(_PAUSE_S)

    async def _receive(self, socket: web.WebSocketResponse, client: Client) -> None:
        loop = asyncio.get_running_loop()
        rate = TokenBucket(MESSAGES_PER_S, MESSAGES_BURST)
        async for message in socket:
            if message.type is not aiohttp.WSMsgType.TEXT:
                continue
            if (wait_s := rate.wait_s(loop.time())) > 0.0:
                await asyncio.sleep(wait_s)
            rate.take(loop.time())
            await loop.run_in_executor(self._worker, self._widgets.received, client, message.data)
