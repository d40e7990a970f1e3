"""Channel for STOPs from the page's process to the rig: a separate socket pair.

All other requests share one socket, which a flood can fill. Only stops use this one, one at a
time: those that arrive while one is pending get the same answer.
"""

import asyncio
import contextlib
import json
import socket
import threading
from collections.abc import Callable, Mapping

from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink

MESSAGE_BYTES = 4096
_CLOSE_TIMEOUT_S = 2.0
_ANSWERED_WITHIN_S = 1.0
WORDS = 150  # of who and why, in characters


class StopListener:
    """End of the rig: a thread that only waits for stops."""

    def __init__(self, link: MessageLink, take: Callable[[Mapping[str, object]], str]) -> None:
        """Start listening.

        take: executes {"do": "stop", "why": reason, "who": name} and returns the answer
        """
        self._link = link
        self._take = take
        self._thread = threading.Thread(target=self._listen, name="page stop", daemon=True)
        self._thread.start()

    def _listen(self) -> None:
        while True:
            try:
                data = self._link.recv(MESSAGE_BYTES)
            except OSError:  # reset by a page that died, or closed here
                data = b""
            if not data:
                return
            asked = json.loads(data)
            answer = [asked.pop("number"), self._take(asked)[:WORDS]]
            try:
                self._link.send(json.dumps(answer).encode(), DONT_WAIT)
            except OSError:  # no client waits any more; the stop is executed
                continue

    def close(self) -> None:
        """Stop listening and close the socket."""
        with contextlib.suppress(OSError):  # the other side was quicker
            self._link.shutdown(socket.SHUT_RDWR)  # wakes the thread that waits on it
        if self._thread is not threading.current_thread():
            self._thread.join(_CLOSE_TIMEOUT_S)
        self._link.close()


class StopSender:
    """End of the page, in the event loop that serves the browsers."""

    def __init__(self, link: MessageLink) -> None:
        link.setblocking(False)
        self._link = link
        self._number = 0
        self._waiting: asyncio.Future[str] | None = None

    async def send(self, why: str, who: str) -> str:
        """Send a stop; return the rig's answer, "" if it is executed at the next tick.

        Raises:
            OSError: the rig has ended or does not answer.
        """
        if self._waiting is None:
            self._number += 1
            stop = {"number": self._number, "do": "stop", "why": why[:WORDS], "who": who[:WORDS]}
            # It may be full of stops, which a rig that hangs receives when it resumes.
            with contextlib.suppress(BlockingIOError):
                self._link.send(json.dumps(stop).encode())
            self._waiting = asyncio.get_running_loop().create_future()
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

    def _receive(self) -> None:
        try:
            data = self._link.recv(MESSAGE_BYTES)
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
