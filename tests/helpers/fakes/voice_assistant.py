"""A Linux Voice Assistant's peripheral API, as its documentation describes it."""

import asyncio
import json
from typing import Any

from aiohttp import web
from fakes.waiting import free_port


def lva(event: str, **data: Any) -> dict[str, Any]:
    return {"event": event, "data": data} if data else {"event": event}


class Assistant:
    """A voice assistant's server: sends lines to whoever connects, then waits or closes."""

    def __init__(self) -> None:
        self.port = free_port()
        self.sockets: list[web.WebSocketResponse] = []
        self.commands: list[str] = []
        self.loop: asyncio.AbstractEventLoop

    async def __aenter__(self) -> "Assistant":
        app = web.Application()
        app.router.add_get("/", self._accept)
        self._runner = web.AppRunner(app, shutdown_timeout=0.1, handler_cancellation=True)
        await self._runner.setup()
        await web.TCPSite(self._runner, "127.0.0.1", self.port).start()
        return self

    async def __aexit__(self, *raised: object) -> None:
        await self._runner.cleanup()

    async def _accept(self, request: web.Request) -> web.WebSocketResponse:
        socket = web.WebSocketResponse()
        await socket.prepare(request)
        self.sockets.append(socket)
        await socket.send_json(lva("snapshot", muted=False))
        async for message in socket:
            self.commands.append(message.json()["command"])
        return socket

    async def send(self, *messages: Any) -> None:
        for message in messages:
            await self.sockets[-1].send_str(
                message if isinstance(message, str) else json.dumps(message)
            )

    def send_soon(self, *messages: Any) -> None:
        """Send from another thread."""
        asyncio.run_coroutine_threadsafe(self.send(*messages), self.loop).result()
