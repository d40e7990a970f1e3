"""Relay from the page's process to the command socket of the rig, for programs of the network.

A few connections carry the requests of all programs. While any program requests states, the newest
state is read at the highest requested rate and distributed to all programs.
"""

import asyncio
import queue
from collections.abc import Awaitable, Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import msgspec

from gazerig.robot.model.outcome import Progress
from gazerig.robot.model.requests import SLOW
from gazerig.robot.remote.client import CONNECT_S
from gazerig.robot.remote.excess import TOO_MANY
from gazerig.robot.remote.socket_io import ANSWER_BYTES, MalformedMessage, Wire, connect_to_socket

_THREADS = 4
_MOST_WAITING = 64
"""Largest number of requests that wait for an answer; further ones are refused."""
_ANSWER_S, _FILES_S = 10.0, 40.0
_AGAIN_S = 0.5

Answer = dict[str, Any]
NO_RIG = "no head takes requests here: it starts or has ended"
BUSY = f"{TOO_MANY}; try again"
NEWEST = 10**15
"""Number greater than that of any event."""


class RigRelay:
    """Requests to the command socket, from an event loop.

    Args:
        path: Socket of the rig; None without one.
    """

    def __init__(self, path: Path | None) -> None:
        self._path = path
        self._threads = ThreadPoolExecutor(_THREADS, thread_name_prefix="page relay")
        self._wires: queue.SimpleQueue[Wire] = queue.SimpleQueue()
        self._waiting = 0

    async def ask(self, request: Mapping[str, object]) -> Answer:
        """Send a request of a network client; return the rig's answer, "failed" without one."""
        if self._path is None:
            return {"failed": NO_RIG}
        if self._waiting >= _MOST_WAITING:
            return {"refused": BUSY}
        self._waiting += 1
        try:
            loop = asyncio.get_running_loop()
            return await loop.run_in_executor(
                self._threads, self._exchange, self._path, {**request, "network": True}
            )
        finally:
            self._waiting -= 1

    def close(self) -> None:
        """End the threads and connections."""
        self._threads.shutdown(wait=False, cancel_futures=True)
        with suppress(queue.Empty):
            while True:
                self._wires.get_nowait().close()

    def _exchange(self, path: Path, request: Mapping[str, object]) -> Answer:
        """Exchange one request and answer; called by a thread."""
        within_s = _FILES_S if request.get("do") in SLOW else _ANSWER_S
        # The rig may have closed this connection as the least recently active one.
        for first in (True, False):
            wire = None
            with suppress(queue.Empty):
                wire = self._wires.get_nowait() if first else None
            try:
                wire = wire or Wire(connect_to_socket(path, CONNECT_S), ANSWER_BYTES)
                wire.write(request, CONNECT_S)
                answer = wire.read(within_s, within_s)
            except (OSError, EOFError, MalformedMessage) as error:
                if wire is not None:
                    wire.close()
                if first and isinstance(error, EOFError | ConnectionError):
                    continue
                return {"failed": NO_RIG}
            self._wires.put(wire)
            return answer if isinstance(answer, dict) else {"failed": NO_RIG}
        return {"failed": NO_RIG}


class HeadNews(NamedTuple):
    """The newest state of the head, as text, with its events and progress."""

    state: str
    events: tuple[str, ...]
    progress: Progress


class StateFeed:
    """Reads the state of the head for all programs, only while one wants it.

    Args:
        ask: Sends a request to the rig.
    """

    def __init__(self, ask: Callable[[Mapping[str, object]], Awaitable[Answer]]) -> None:
        self._ask = ask
        self._readers: dict[Callable[[HeadNews, float], None], Callable[[], float]] = {}
        self._wanted = asyncio.Event()
        self._after: int | None = None

    def add(self, take: Callable[[HeadNews, float], None], rate_hz: Callable[[], float]) -> None:
        """Send all news to a reader, with the time.

        Args:
            take: receives the news; it must not block.
            rate_hz: returns the rate that the reader wants now, 0 for none.
        """
        self._readers[take] = rate_hz
        self._wanted.set()

    def remove(self, take: Callable[[HeadNews, float], None]) -> None:
        """Stop sending news to a reader."""
        self._readers.pop(take, None)

    def wake(self) -> None:
        """Read again soon, because a reader wants a higher rate."""
        self._wanted.set()

    async def run(self) -> None:
        """Read and distribute until cancelled."""
        loop = asyncio.get_running_loop()
        while True:
            rate_hz = max((rate() for rate in self._readers.values()), default=0.0)
            if rate_hz <= 0.0:
                self._after = None  # events in the meantime are not reported later
                self._wanted.clear()
                await self._wanted.wait()
                continue
            began_s = loop.time()
            pause_s = _AGAIN_S
            if (news := await self._read()) is not None:
                pause_s = 1.0 / rate_hz
                for take in tuple(self._readers):
                    take(news, began_s)
            await asyncio.sleep(max(0.001, began_s + pause_s - loop.time()))

    async def _read(self) -> HeadNews | None:
        after = NEWEST if self._after is None else self._after
        match await self._ask({"do": "state", "after": after}):
            case {"ok": {"state": dict(state), "events": list(events), "number": int(number)}}:
                known = number if self._after is None else self._after
                self._after = max([event["number"] for event in events], default=known)
            case _:  # the rig is busy, starting or has ended
                return None
        progress = msgspec.convert(state, Progress)
        lines = tuple(_line({"event": event}) for event in events)
        return HeadNews(_line({"state": state}), lines, progress)


def _line(value: object) -> str:
    return msgspec.json.encode(value).decode()
