"""Page process: shows the running rig on a web page and never delays the control loop.

The page is a separate process (``gazerig.robot.dashboard.page_main``), fed through a socket pair
with frozen values. Requests of its users arrive over two more connections. Every call here returns
immediately: data that the page cannot accept is dropped and counted, and a page that is slow,
stopped or dead does not affect the caller. The page ends when this side of the socket closes, so it
never outlives the program, however the program ends.
"""

import contextlib
import os
import secrets
import shutil
import socket
import subprocess
import tempfile
import threading
from collections import deque
from collections.abc import Callable
from typing import BinaryIO
from urllib.parse import urlsplit

from gazerig.drivers.process import child_process, message_link
from gazerig.drivers.process.message_link import MessageLink, wait_readable
from gazerig.drivers.process.passed_image import send
from gazerig.robot.model.clock import RealClock

URL, NOTICE, PICTURE, BEAT = b"u", b"n", b"j", b"b"
"""First bytes of the page's messages: its address, a message for the terminal, an image of a
browser's webcam, and that it draws and serves browsers. The rig's messages are in rig_feed.py."""
MESSAGE_BYTES = 200_000
"""Longest message, bytes; the default send buffer of a socket in Linux holds 212,992."""
TOKEN_VARIABLE = "GAZERIG_PAGE_TOKEN"
"""Environment variable with the token that browsers must present."""
ONCE_VARIABLE = "GAZERIG_PAGE_ONCE"
"""Environment variable with a token that opens the page once, "" for none."""
FOLDER_VARIABLE = "GAZERIG_PAGE_FOLDER"
"""Environment variable with a folder that only this user can read, for the socket of its server."""
CANNOT_OPEN = 3
"""Exit code of a page that cannot open its address; a restart would not help."""

Serve = Callable[[socket.socket], None]
"""Answers requests over a connection, as ``RemoteServer.serve``."""

_CLOSE_TIMEOUT_S = 2.0
_CHECK_S = 0.25  # between two checks that the process neither hangs nor was suspended
_HANG_S = 5.0
"""Time without a message after which a page that receives snapshots counts as hung, s."""
_LAST_LINES_BYTES = 4096
_AGAIN_AFTER_S = 0.5
_AGAIN_LATEST_S = 30.0
_WELL_AFTER_S = 60.0  # after this time the wait before a restart is short again
_TOKEN_BYTES = 16


class PageProcess:
    """Live page, for the control loop.

    Only one thread may call ``check``; any thread may call the other methods.

    A page process that dies is restarted at the same address, after a wait that grows.

    dropped: ticks that the page did not accept
    started: number of starts of the page; its feed starts again when this changes
    """

    def __init__(
        self,
        host: str,
        port: int,
        serve: Serve | None = None,
        on_picture: Callable[[bytes], None] | None = None,
        token: str = "",
    ) -> None:
        """Prepare a page for an address and port; if the port is busy, the next one is used.

        serve: answers the requests of the page's users; None: nobody does
        on_picture: called with each picture of a browser's own camera; None: they are dropped
        token: what browsers and programs must show, "" for a new one
        """
        self._unserved: list[socket.socket] = []
        self._serve, self._on_picture = serve or self._unserved.append, on_picture
        self._host = host
        self._port = port
        self._token = token or secrets.token_urlsafe(_TOKEN_BYTES)
        self._once = secrets.token_urlsafe(_TOKEN_BYTES)
        self._socket: MessageLink | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._over = threading.Event()
        self._beginning = threading.Lock()
        self._clock = RealClock()
        self._began_s = self._check_s = self._silent_s = 0.0
        self._wait_s = _AGAIN_AFTER_S
        self.started = 0
        self._errors: BinaryIO | None = None
        self._folder: str | None = None
        self._url: str | None = None
        self._notices: deque[str] = deque()
        self.dropped = 0

    def open(self) -> str:
        """Start the page without waiting; return a message for the user."""
        self._begin()
        return f"the page is starting on port {self._port}"

    def _begin(self) -> None:
        """Start a process and connect to it."""
        links = message_link.create_links(1)
        # Orders and slow requests: an order does not wait until a file is written.
        orders, slow = socket.socketpair(), socket.socketpair()
        theirs = (orders[1], slow[1])
        # A file: the page's messages matter only if it dies, and a pipe without a reader would fill
        # up.
        self._errors = _errors_file()
        self._folder = tempfile.mkdtemp(prefix="gazerig-page-")
        try:
            self._process = child_process.start(
                "gazerig.robot.dashboard.page_main",
                *links.arguments,
                *(str(end.fileno()) for end in theirs),
                *(str(os.getpid()), self._host, str(self._port)),
                stderr=self._errors.fileno(),
                pass_fds=(*links.fds, *(end.fileno() for end in theirs)),
                variables={
                    TOKEN_VARIABLE: self._token,
                    ONCE_VARIABLE: self._once if self.started == 0 else "",
                    FOLDER_VARIABLE: self._folder,
                },
            )
        finally:
            for end in (*links.child_sockets, *theirs):
                end.close()
        self._began_s = self._clock.now_s()
        self._serve(orders[0])
        self._serve(slow[0])
        self.join(*links.parent_ends)

    def join(self, link: MessageLink) -> None:
        """Use this link from now on; ``open`` creates it with a process at the other end."""
        link.setblocking(False)
        self._socket = link
        self._listener = threading.Thread(
            target=self._listen, args=(link,), name="page link", daemon=True
        )
        self._listener.start()

    def send(self, message: bytes, fd: int = -1) -> bool:
        """Send an encoded message; return False if the page does not accept it now.

        fd: file descriptor to send with it, -1 for none; the caller still owns it
        """
        page = self._socket
        if page is None or len(message) > MESSAGE_BYTES:
            return False
        try:
            send(page, message, fd)
        except OSError:  # its buffer is full, it has ended, or close() has just closed it
            return False
        return True

    def url(self) -> str | None:
        """Return the page's URL with its token while the page is available, else None."""
        return self._url

    def url_once(self) -> str | None:
        """Return an address that opens the page once, to pass to a program as an argument.

        All users of this computer can read a program's arguments.
        """
        return self._url and self._url.replace(self._token, self._once)

    def notice(self) -> str | None:
        """Return the next line for the terminal; each line is returned once."""
        return self._notices.popleft() if self._notices else None

    def _listen(self, link: MessageLink) -> None:
        """Take the page's messages until it ends."""
        while True:
            wait_readable(link)
            try:
                message = link.recv(MESSAGE_BYTES)
            except BlockingIOError:
                continue
            except OSError:  # reset because the page died, or closed here
                break
            if not message:
                break
            self._take(message)
        if not self._over.is_set():
            self._handle_loss()

    def _take(self, message: bytes) -> None:
        kind, body = message[:1], message[1:]
        if kind == PICTURE:
            if self._on_picture is not None:
                self._on_picture(body)
        elif kind == BEAT:
            self._silent_s = 0.0
        elif kind == URL:
            url = body.decode()
            self._url, self._silent_s = url, 0.0
            self._port = int(urlsplit(url).port or self._port)
            self.started += 1
            if self.started > 1:
                self._notices.append(f"the page is there again, at {url}")
        elif kind == NOTICE:
            self._notices.append(body.decode())

    def _handle_loss(self) -> None:
        """Report once that the page has died, and restart it if that can help."""
        process = self._process
        self._disconnect()
        text = "it gave no reason"
        if self._errors is not None:
            lines = _read_tail(self._errors).decode(errors="replace").strip().splitlines()
            text = lines[-1].strip() if lines else text
        code: int | None = CANNOT_OPEN
        if process is not None:
            try:
                code = process.wait(_CLOSE_TIMEOUT_S)
            except subprocess.TimeoutExpired:  # it has closed its link but hangs
                code = None
        gone = code == CANNOT_OPEN
        if self._clock.now_s() - self._began_s > _WELL_AFTER_S:
            self._wait_s = _AGAIN_AFTER_S
        then = "start it again to see the page" if gone else "it is started again"
        self._notices.append(f"the page has stopped ({text}); the rig runs on, {then}")
        if not gone:
            threading.Thread(target=self._restart, name="page start", daemon=True).start()

    def _restart(self) -> None:
        wait_s, self._wait_s = self._wait_s, min(2.0 * self._wait_s, _AGAIN_LATEST_S)
        self._over.wait(wait_s)
        with self._beginning:
            if self._over.is_set():
                return
            self._end_process()
            try:
                self._begin()
            except OSError as error:  # out of memory, processes or files
                self._notices.append(f"the page cannot be started again: {error.strerror}")

    def check(self) -> None:
        """Kill and restart a page that hangs or is suspended: its STOP button may not work.

        Called by the loop. A page that is still starting and has no address does not count as hung.
        """
        now_s, process = self._clock.now_s(), self._process
        if now_s < self._check_s or process is None or process.returncode is not None:
            return
        # If no check ran, the whole machine may have been suspended: count only part of that time.
        looked_s = min(now_s - self._check_s + _CHECK_S, 2.0 * _CHECK_S)
        self._silent_s = self._silent_s + looked_s if self._url is not None else 0.0
        self._check_s = now_s + _CHECK_S
        if self._silent_s >= _HANG_S or child_process.is_suspended(process.pid):
            process.kill()

    def _disconnect(self) -> None:
        link, self._socket = self._socket, None
        if link is not None:
            with contextlib.suppress(OSError):  # the other side has already closed it
                link.shutdown(socket.SHUT_RDWR)  # wakes the thread that waits on it
            if self._listener is not threading.current_thread():
                self._listener.join(_CLOSE_TIMEOUT_S)
            link.close()
        self._url = None

    def close(self) -> None:
        """End the page; safe to call twice."""
        self._over.set()
        with self._beginning:
            self._disconnect()
            self._end_process()

    def _end_process(self) -> None:
        if self._process is None:
            return
        try:
            self._process.wait(_CLOSE_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process = None
        if self._errors is not None:
            self._errors.close()
            self._errors = None
        if self._folder is not None:
            shutil.rmtree(self._folder, ignore_errors=True)  # close() may have killed the process


def _errors_file() -> BinaryIO:
    return os.fdopen(os.memfd_create("page_errors"), "w+b", buffering=0)


def _read_tail(file: BinaryIO) -> bytes:
    """Return the last bytes of a file that another process may still write to."""
    start = max(0, os.fstat(file.fileno()).st_size - _LAST_LINES_BYTES)
    # Keeps the position at which the other process writes.
    return os.pread(file.fileno(), _LAST_LINES_BYTES, start)
