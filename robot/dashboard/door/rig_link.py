"""Requests from the page's process to the rig, over the connections that the rig has opened."""

import asyncio
from collections import deque
from collections.abc import Mapping, Sequence
from contextlib import suppress
from socket import socket
from typing import Any

import msgspec

from gazerig.robot.dashboard.door.sockets import until_one_ends
from gazerig.robot.model.commands import SLOW
from gazerig.robot.net.excess import TOO_MANY
from gazerig.robot.net.socket_io import ANSWER_BYTES

Answer = dict[str, Any]
NO_RIG = "no head takes requests here: it starts or has ended"
NO_ANSWER = "the rig does not answer"
BUSY = f"{TOO_MANY}; try again"
_MOST_WAITING = 48
"""Largest number of requests that wait for an answer; the rig would refuse more than 64."""
_SLOW = SLOW | {"parameters", "get", "unsaved", "menus", "tracks"}
_ANSWER_S, _SLOW_S = 10.0, 40.0
_STOP_S = 1.5


class _Connection:
    """One connection; the rig answers its requests in their order, but executes stops at once."""

    def __init__(self, end: socket) -> None:
        self._end = end
        self._writer: asyncio.StreamWriter | None = None
        self._waiting: deque[asyncio.Future[Answer]] = deque()

    async def run(self) -> None:
        """Receive answers until the rig closes the connection."""
        reader, self._writer = await asyncio.open_unix_connection(
            sock=self._end, limit=ANSWER_BYTES
        )
        with suppress(OSError, ValueError):  # reset, or not a line
            while line := await reader.readline():
                answer = self._waiting.popleft()
                if not answer.done():
                    answer.set_result(msgspec.json.decode(line))
        self._writer.close()
        self._writer = None
        for answer in self._waiting:
            if not answer.done():
                answer.set_result({"failed": NO_RIG})
        self._waiting.clear()

    def send(self, request: Mapping[str, object]) -> asyncio.Future[Answer]:
        """Send a request; return its future answer."""
        answer: asyncio.Future[Answer] = asyncio.get_running_loop().create_future()
        if self._writer is None:
            answer.set_result({"failed": NO_RIG})
        elif len(self._waiting) >= _MOST_WAITING and request.get("do") != "stop":
            answer.set_result({"refused": BUSY})
        else:
            self._writer.write(msgspec.json.encode(request) + b"\n")
            self._waiting.append(answer)
        return answer


class RigLink:
    """Requests to the rig, from an event loop.

    Args:
        ends: Connections for orders, with stops, and for requests that take longer.
    """

    def __init__(self, ends: Sequence[socket]) -> None:
        self._orders, self._slow = map(_Connection, ends)
        self._stop: asyncio.Future[Answer] | None = None

    async def run(self) -> None:
        """Receive answers until the rig closes a connection: then the page must start again."""
        await until_one_ends(self._orders.run(), self._slow.run())

    async def ask(self, request: Mapping[str, object]) -> Answer:
        """Send a request; return the rig's answer, "failed" without one."""
        quick = str(request.get("do")) not in _SLOW
        connection, within_s = (self._orders, _ANSWER_S) if quick else (self._slow, _SLOW_S)
        try:
            return dict(await asyncio.wait_for(connection.send(request), within_s))
        except TimeoutError:
            return {"failed": NO_ANSWER}

    async def stop(self, request: Mapping[str, object]) -> Answer:
        """Send a stop; stops that arrive while one is pending receive the same answer."""
        if self._stop is None or self._stop.done():
            self._stop = self._orders.send(request)
        stop = self._stop
        try:
            return dict(await asyncio.wait_for(asyncio.shield(stop), _STOP_S))
        except TimeoutError:
            if self._stop is stop:  # the next one is sent again
                self._stop = None
            return {"failed": NO_ANSWER}
