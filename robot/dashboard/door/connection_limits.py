"""Limits on the number of connections to the page and on their idle time.

A browser needs a handful. A client that opens hundreds and sends nothing, or sends a byte a second,
must not keep others from pressing STOP, so that the one who has been idle longest goes when
another comes.
"""

import asyncio
from collections.abc import Iterator
from contextlib import contextmanager

from aiohttp import web
from aiohttp.web_protocol import RequestHandler

MOST = 96
"""Largest number of connections of all browsers together."""
IDLE_S = 15.0
"""Longest time of a connection without a request, s."""
BUSY_S = 20.0
"""Longest time of one request, except websockets, s."""
_LOOK_EVERY_S = 1.0
_TRIM_AFTER_S = 0.02
_BEGINS_WITHIN_S = 5.0


class _ConnectionState:
    """State of a connection and the time since it has it."""

    def __init__(self, since_s: float) -> None:
        self.since_s = since_s
        self.begun = self.busy = self.lasting = False


class Connections:
    """Creates the handlers of connections and closes those over a limit."""

    def __init__(self, server: web.Server) -> None:
        self._server = server
        self._states: dict[RequestHandler, _ConnectionState] = {}
        self._trimming = False

    def accept(self) -> RequestHandler:
        """Return the handler of a new connection; if there are too many, close the idlest."""
        handler: RequestHandler = self._server()
        self._states[handler] = _ConnectionState(asyncio.get_running_loop().time())
        self._trim_soon()
        return handler

    def _trim_soon(self) -> None:
        """If there are too many connections, close the idlest after the new ones have started."""
        if len(self._states) > MOST and not self._trimming:
            self._trimming = True
            asyncio.get_running_loop().call_later(_TRIM_AFTER_S, self._trim)

    @property
    def count(self) -> int:
        """Return the number of connections."""
        return len(self._server.connections)

    def _trim(self) -> None:
        self._trimming = False
        self._forget_gone()
        begun = sorted((h for h, s in self._states.items() if s.begun), key=self._rank)
        for handler in begun[: max(0, len(begun) - MOST)]:
            self._end(handler)
        self._trim_soon()

    @contextmanager
    def busy(self, request: web.BaseRequest) -> Iterator[None]:
        """Record that a request is being answered."""
        state = self._states.get(request.protocol)
        if state is None:
            yield
            return
        loop = asyncio.get_running_loop()
        state.begun, state.busy, state.since_s = True, True, loop.time()
        try:
            yield
        finally:
            state.busy, state.since_s = False, loop.time()

    def lasting(self, request: web.BaseRequest) -> None:
        """Record that a request is a websocket, which the browser ends."""
        if (state := self._states.get(request.protocol)) is not None:
            state.lasting = True

    async def watch(self) -> None:
        """Close connections that are idle or busy for too long; runs until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(_LOOK_EVERY_S)
            self._forget_gone()
            now_s = loop.time()
            for handler, state in tuple(self._states.items()):
                longest_s = BUSY_S if state.busy else IDLE_S
                if not state.lasting and now_s - state.since_s > longest_s:
                    self._end(handler)

    def _rank(self, handler: RequestHandler) -> tuple[bool, bool, float]:
        state = self._states[handler]
        return state.lasting, state.busy, state.since_s

    def _end(self, handler: RequestHandler) -> None:
        del self._states[handler]
        if handler.transport is not None:
            handler.transport.abort()

    def _forget_gone(self) -> None:
        """Remove connections that have ended; a new one appears after a moment."""
        known = set(self._server.connections)
        now_s = asyncio.get_running_loop().time()
        for handler, state in tuple(self._states.items()):
            if handler in known:
                state.begun = True
            elif state.begun or now_s - state.since_s > _BEGINS_WITHIN_S:
                del self._states[handler]
