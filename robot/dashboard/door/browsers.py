"""Browsers of the page: their names, and limits on their connections and tabs.

A browser needs a handful of connections. A client that opens hundreds and sends nothing, or sends
one byte per second, must not prevent others from pressing STOP. So a new connection over the limit
closes the one that has been idle longest, and a request has a second before it can be closed.
Websockets do not count: each kind has a limit of its own.
"""

import asyncio
import hashlib
import hmac
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

from aiohttp import web
from aiohttp.web_protocol import RequestHandler

MOST = 96
"""Largest number of connections of all browsers together, without websockets."""
RESERVE = 64
"""Number of further connections that are younger than a second."""
IDLE_S = 15.0
"""Longest time of a connection without a request, s."""
BUSY_S = 20.0
"""Longest time of one request, except websockets, s."""
_LOOK_EVERY_S = 1.0
_TRIM_AFTER_S = 0.02
_BEGINS_WITHIN_S = 5.0
_YOUNG_S = 1.0
_DIGITS = 4


def browser_name(key: str, cookie: str) -> str:
    """Return a browser's name; it is constant while the browser keeps its cookie."""
    digest = hmac.new(key.encode(), cookie.encode(errors="replace"), hashlib.sha256)
    return f"browser {digest.hexdigest()[:_DIGITS]}"


class TabLimits:
    """Limit on open tabs; a tab over it closes the oldest tab of the browser with most tabs.

    Belongs to one event loop.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._taken: dict[asyncio.Event, str] = {}  # oldest first

    @contextmanager
    def occupy(self, name: str) -> Iterator[asyncio.Event]:
        """Occupy a slot; the event is set when the slot must be freed."""
        leave = asyncio.Event()
        self._taken[leave] = name
        if len(self._taken) > self._most:
            greedy = Counter(self._taken.values()).most_common(1)[0][0]
            oldest = next(event for event, who in self._taken.items() if who == greedy)
            del self._taken[oldest]
            oldest.set()
        try:
            yield leave
        finally:
            self._taken.pop(leave, None)


class _ConnectionState:
    """State of a connection and the time at which the state began."""

    def __init__(self, since_s: float) -> None:
        self.since_s = since_s
        self.busy = self.lasting = False


class Connections:
    """Creates the handlers of connections and closes those over a limit."""

    def __init__(self, server: web.Server) -> None:
        self._server = server
        self._states: dict[RequestHandler, _ConnectionState] = {}
        self._trimming = False

    def accept(self) -> RequestHandler:
        """Return the handler of a new connection; over the limit, close the longest idle one."""
        handler: RequestHandler = self._server()
        self._states[handler] = _ConnectionState(asyncio.get_running_loop().time())
        self._trim_soon()
        return handler

    def _trim_soon(self) -> None:
        """Over the limit, close the longest idle connection after the new ones have started."""
        if len(self._states) > MOST and not self._trimming:
            self._trimming = True
            asyncio.get_running_loop().call_later(_TRIM_AFTER_S, self._trim)

    @property
    def count(self) -> int:
        """Return the number of connections."""
        return len(self._server.connections)

    def _trim(self) -> None:
        """Close those over the limit that are idle or busy longest, and forget those that ended."""
        self._trimming = False
        now_s = asyncio.get_running_loop().time()
        for handler, state in tuple(self._states.items()):
            if handler.transport is None and now_s - state.since_s > _BEGINS_WITHIN_S:
                del self._states[handler]
        counted = [
            (state.since_s > now_s - _YOUNG_S, state.busy, state.since_s, handler)
            for handler, state in self._states.items()
            if handler.transport is not None and not state.lasting
        ]
        counted.sort(key=lambda one: one[:3])
        too_many, old = len(counted) - MOST, sum(not young for young, *_ in counted)
        for *_, handler in counted[: max(0, min(too_many, old), too_many - RESERVE)]:
            self._end(handler)

    @contextmanager
    def mark_busy(self, request: web.BaseRequest) -> Iterator[None]:
        """Record that a request is being answered."""
        state = self._states.get(request.protocol)
        if state is None:
            yield
            return
        loop = asyncio.get_running_loop()
        state.busy, state.since_s = True, loop.time()
        try:
            yield
        finally:
            state.busy, state.since_s = False, loop.time()

    def mark_websocket(self, request: web.BaseRequest) -> None:
        """Record that a request is a websocket, which the browser ends."""
        if (state := self._states.get(request.protocol)) is not None:
            state.lasting = True

    async def watch(self) -> None:
        """Close connections that are idle or busy for too long; runs until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            await asyncio.sleep(_LOOK_EVERY_S)
            self._trim()
            now_s = loop.time()
            for handler, state in tuple(self._states.items()):
                longest_s = BUSY_S if state.busy else IDLE_S
                if not state.lasting and now_s - state.since_s > longest_s:
                    self._end(handler)

    def _end(self, handler: RequestHandler) -> None:
        del self._states[handler]
        if handler.transport is not None:
            handler.transport.abort()
