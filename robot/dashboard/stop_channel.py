"""The way of a STOP from the page's process to the rig: a socket pair of its own.

Whatever else people ask for shares one socket, which a flood can fill. Nothing but stops goes
here, one at a time: those that come while one is on its way are answered with it.
"""

import asyncio
import contextlib
import json
import socket
import threading
from collections.abc import Callable, Mapping

_MESSAGE_BYTES = 4096
_ANSWERED_WITHIN_S = 1.0
_CLOSE_TIMEOUT_S = 2.0
_WORDS = 150  # of who and why, in characters


class StopSender:
    """The page's end, of the event loop that serves the browsers."""

    def __init__(self, link: socket.socket) -> None:
        link.setblocking(False)
        self._link = link
        self._number = 0
        self._waiting: asyncio.Future[str] | None = None

    async def send(self, why: str, who: str) -> str:
        """Return what the rig says to a stop: "" where it is obeyed at the next tick.

        Raises:
            OSError: the rig is gone, or does not answer.
        """
        if self._waiting is None:
            self._waiting = self._sent(why[:_WORDS], who[:_WORDS])
        waiting = self._waiting
        try:
            return await asyncio.wait_for(asyncio.shield(waiting), _ANSWERED_WITHIN_S)
        except TimeoutError:
            if self._waiting is waiting:  # the next one sends again
                self._waiting = None
            raise OSError("the rig does not answer") from None

    def attach(self, loop: asyncio.AbstractEventLoop) -> None:
        """Receive the replies in this event loop."""
        loop.add_reader(self._link.fileno(), self._receive)

    def _sent(self, why: str, who: str) -> asyncio.Future[str]:
        self._number += 1
        stop = {"number": self._number, "do": "stop", "why": why, "who": who}
        # It may be full of stops, which a rig that hangs will find when it wakes.
        with contextlib.suppress(BlockingIOError):
            self._link.send(json.dumps(stop).encode())
        return asyncio.get_running_loop().create_future()

    def _receive(self) -> None:
        try:
            data = self._link.recv(_MESSAGE_BYTES)
        except BlockingIOError:
            return
        except OSError:
            data = b""
        if not data:
            asyncio.get_running_loop().remove_reader(self._link.fileno())
            return
        number, text = json.loads(data)
        if number == self._number and self._waiting is not None:
            self._waiting.set_result(text)
            self._waiting = None


class StopListener:
    """The rig's end: a thread that waits for stops and for nothing else."""

    def __init__(self, link: socket.socket, take: Callable[[Mapping[str, object]], str]) -> None:
        """Listen at once.

        take: obeys {"do": "stop", "why": words, "who": words}; what it returns is answered
        """
        self._link = link
        self._take = take
        self._thread = threading.Thread(target=self._listen, name="page stop", daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        while True:
            try:
                data = self._link.recv(_MESSAGE_BYTES)
            except OSError:  # reset by a page that died, or closed here
                data = b""
            if not data:
                return
            asked = json.loads(data)
            answer = [asked.pop("number"), self._take(asked)[:_WORDS]]
            try:
                self._link.send(json.dumps(answer).encode(), socket.MSG_DONTWAIT)
            except OSError:  # no client waits any more; the stop is obeyed
                continue

    def close(self) -> None:
        """Stop listening and close the socket."""
        with contextlib.suppress(OSError):  # the other side was quicker
            self._link.shutdown(socket.SHUT_RDWR)  # wakes the thread that waits on it
        if self._thread is not threading.current_thread():
            self._thread.join(_CLOSE_TIMEOUT_S)
        self._link.close()
