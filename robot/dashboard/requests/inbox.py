"""Inbox of the page's requests, outside the control loop; urgent ones are handled first.

One thread waits on the socket and handles commands as soon as they arrive, so that a stop is
executed at the next tick. A second thread handles slow requests, such as the check of a changed
parameter, and a stop never waits for them.
"""

import contextlib
import json
import queue
import socket
import threading
from collections.abc import Callable

from gazerig.drivers.process.message_link import MessageLink, wait_readable
from gazerig.robot.model.commands import COMMANDS

REQUEST = b"t"
"""First byte of a request of a user of the page."""
BEAT = b"b"
"""Complete message by which a page reports that it draws and serves browsers."""
PICTURE = b"j"
"""First byte of an image of a browser's webcam."""
MESSAGE_BYTES = 200_000
"""Longest message, bytes; the default send buffer of a socket in Linux has 212,992."""

_URGENT = tuple(f'{{"do":"{name}"'.encode() for name in COMMANDS if name != "tune")
_CHANGE = b'{"do":"set",'
_OVER = b""
_MOST_WAITING = 100
"""Largest number of requests that wait for the slow thread; further ones are refused."""
_CHANGES_EVERY_S = 0.1
"""Time between changes, s; each takes a few ms of the processor from the control loop."""
_CLOSE_TIMEOUT_S = 2.0


def request_message(who: str, data: bytes) -> bytes:
    """Return the message with a request of a user.

    who: name that is returned with the answer
    data: a JSON object, compact (no blanks between its parts), its "do" first
    """
    return REQUEST + who.encode() + b" " + data


def parse_request(message: bytes) -> tuple[str, bytes]:
    """Return the user and the JSON object of a message of ``request_message``."""
    who, _, data = message[1:].partition(b" ")
    return who.decode(), data


def is_superseded(earlier: bytes, later: bytes) -> bool:
    """Return whether a later change of the same parameters replaces an earlier one."""
    who, first = parse_request(earlier)
    again, second = parse_request(later)
    if who != again or not (first.startswith(_CHANGE) and second.startswith(_CHANGE)):
        return False
    keys: set[str] = set(json.loads(first)["changes"])
    return keys <= set(json.loads(second)["changes"])


def is_urgent(message: bytes) -> bool:
    """Return whether a message cannot wait: a command, or a message of the page itself."""
    return message[:1] != REQUEST or parse_request(message)[1].startswith(_URGENT)


class Inbox:
    """Two threads that receive the messages of one socket."""

    def __init__(
        self,
        link: MessageLink,
        take: Callable[[bytes], None],
        lost: Callable[[], None],
        refuse: Callable[[bytes], None] | None = None,
    ) -> None:
        """Start listening.

        take: called with each message, commands in one thread and the rest in another
        refuse: called with each message that is dropped because too many wait
        lost: called once when the other side has closed, unless this side was closed first
        """
        self._link = link
        self._take = take
        self._lost = lost
        self._refuse = refuse
        self._over = threading.Event()
        self._later: queue.Queue[bytes] = queue.Queue(_MOST_WAITING)
        self._threads = [
            threading.Thread(target=self._listen, name="page inbox", daemon=True),
            threading.Thread(target=self._handle_later, name="page inbox, slow", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def _listen(self) -> None:
        while True:
            wait_readable(self._link)
            try:
                message = self._link.recv(MESSAGE_BYTES)
            except BlockingIOError:
                continue
            except OSError:  # reset because the page died, or closed here
                message = b""
            if not message:
                break
            if is_urgent(message):
                self._take(message)
            else:
                try:
                    self._later.put_nowait(message)
                except queue.Full:
                    if self._refuse is not None:
                        self._refuse(message)
        # End the slow thread after its present request; requests that wait are dropped.
        while True:
            try:
                self._later.put_nowait(_OVER)
                break
            except queue.Full:
                with contextlib.suppress(queue.Empty):
                    self._later.get_nowait()
        if not self._over.is_set():
            self._lost()

    def _handle_later(self) -> None:
        waiting = [self._later.get()]
        while waiting[0]:
            while len(waiting) < _MOST_WAITING and not self._later.empty():
                waiting.append(self._later.get())
            # A dragged slider sends more values than can be checked: only the last one counts.
            message = waiting.pop(0)
            if not any(is_superseded(message, later) for later in waiting if later):
                self._take(message)
                if parse_request(message)[1].startswith(_CHANGE):
                    self._over.wait(_CHANGES_EVERY_S)
            if not waiting:
                waiting.append(self._later.get())

    def close(self) -> None:
        """Stop listening; the caller closes the socket."""
        self._over.set()
        try:
            self._link.shutdown(socket.SHUT_RDWR)  # wakes the thread that waits on it
        except OSError:
            return  # the other side has already closed it
        for thread in self._threads:
            if thread is not threading.current_thread():
                thread.join(_CLOSE_TIMEOUT_S)
