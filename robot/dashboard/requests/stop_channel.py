"""Channel for STOPs from the page's process to the rig: a separate socket pair.

All other requests share one socket, which a flood of requests can fill. Only stops use this one,
one
at a time: stops that arrive while one is pending receive the same answer.
"""

import contextlib
import json
import socket
import threading
from collections.abc import Callable, Mapping

from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink

MESSAGE_BYTES = 4096
_CLOSE_TIMEOUT_S = 2.0
WORDS = 150  # length of who and why, in characters


class StopListener:
    """Rig's end of the channel: a thread that only waits for stops."""

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
            except OSError:  # reset because the page died, or closed here
                data = b""
            if not data:
                return
            asked = json.loads(data)
            answer = [asked.pop("number"), self._take(asked)[:WORDS]]
            try:
                self._link.send(json.dumps(answer).encode(), DONT_WAIT)
            except OSError:  # no client waits any more; the stop has been executed
                continue

    def close(self) -> None:
        """Stop listening and close the socket."""
        with contextlib.suppress(OSError):  # the other side has already closed it
            self._link.shutdown(socket.SHUT_RDWR)  # wakes the thread that waits on it
        if self._thread is not threading.current_thread():
            self._thread.join(_CLOSE_TIMEOUT_S)
        self._link.close()
