"""Page process: shows the running rig on a web page and never delays the control loop.

The page is a separate process (``gazerig.robot.dashboard.page_main``), fed through a socket pair
with frozen values. Every call here returns immediately: data that the page cannot accept is dropped
and counted, and a page that is slow, stopped or dead does not affect the caller. The page ends when
this side of the socket closes, so it never outlives the program, however the program ends.
"""

import json
import os
import secrets
import shutil
import subprocess
import tempfile
import threading
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO
from urllib.parse import urlsplit

import msgspec

from gazerig.drivers.process import child_process, message_link
from gazerig.drivers.process.message_link import MessageLink
from gazerig.drivers.process.passed_image import send
from gazerig.robot.control.track_choices import TrackInfo
from gazerig.robot.dashboard.requests.inbox import (
    BEAT,
    MESSAGE_BYTES,
    PICTURE,
    REQUEST,
    Inbox,
    parse_request,
)
from gazerig.robot.dashboard.requests.stop_channel import StopListener
from gazerig.robot.model.clock import RealClock

# The first byte of a message is its kind. To the page: menus, the parameters, their values, a reply
# or a message to all users; the messages of a running rig are in live_feed.py.
CHOICES, PARAMS, VALUES, MESSAGE = b"c", b"k", b"v", b"w"
TRACKS = b"l"
# From the page: its address, a message for the terminal, and REQUEST, a user's request.
URL, NOTICE = b"u", b"n"
TOKEN_VARIABLE = "GAZERIG_PAGE_TOKEN"
"""Environment variable with the token that browsers must present."""
ONCE_VARIABLE = "GAZERIG_PAGE_ONCE"
"""Environment variable with a token that opens the page once, "" for none."""
FOLDER_VARIABLE = "GAZERIG_PAGE_FOLDER"
"""Environment variable with a folder that only this user can read, for the socket of its server."""
COMMANDS_VARIABLE = "GAZERIG_PAGE_COMMANDS"
"""Environment variable with the path of the rig's command socket, "" for none."""
CANNOT_OPEN = 3
"""Exit code of a page that cannot open its address; a restart would not help."""
ALL_USERS = "*"
"""User name in messages to all users of the page."""

OnRequest = Callable[[dict[str, object]], str | None]
"""Executes a request of a user of the page; returns the reply or None."""

_CLOSE_TIMEOUT_S = 2.0
_CHECK_S = 0.25  # between two checks that the process neither hangs nor was suspended
_HANG_S = 5.0
"""Time without a message after which a page that receives snapshots counts as hung, s."""
_LAST_LINES_BYTES = 4096
_MOST_WORDS = 20_000  # length of one answer, in characters
_MAX_PENDING = 100  # waiting answers to a page that accepts none
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
    gone: whether it has ended and is not restarted
    """

    def __init__(
        self,
        host: str,
        port: int,
        on_request: OnRequest | None = None,
        on_picture: Callable[[bytes], None] | None = None,
        commands: Callable[[], Path | None] = lambda: None,
        token: str = "",
    ) -> None:
        """Prepare a page for an address and port; if the port is busy, the next one is used.

        on_request: called with each request of a user of the page; None: requests are dropped
        on_picture: called with each picture of a browser's own camera; None: they are dropped
        commands: returns the path of the rig's command socket, to which programs are relayed
        token: what browsers and programs must show, "" for a new one
        """
        self._commands = commands
        self._on_picture = on_picture
        self._host = host
        self._port = port
        self._on_request = on_request
        self._token = token or secrets.token_urlsafe(_TOKEN_BYTES)
        self._once = secrets.token_urlsafe(_TOKEN_BYTES)
        self._socket: MessageLink | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._inbox: Inbox | None = None
        self._stops: StopListener | None = None
        self._choices: Mapping[str, tuple[str, ...]] = {}
        self._tracks: Sequence[TrackInfo] = ()
        self._over = threading.Event()
        self._beginning = threading.Lock()
        self._clock = RealClock()
        self._began_s = self._check_s = self._silent_s = 0.0
        self._wait_s = _AGAIN_AFTER_S
        self._mourned = self._welcomed = False
        self.started = 0
        self.gone = False
        self._errors: BinaryIO | None = None
        self._folder: str | None = None
        self._url: str | None = None
        self._notices: deque[str] = deque()
        self._pending_replies: deque[bytes] = deque(maxlen=_MAX_PENDING)
        self._paying = threading.Lock()
        self.dropped = 0

    def open(self) -> str:
        """Start the page without waiting; return a message for the user."""
        self._begin()
        return f"the page is starting on port {self._port}"

    def _begin(self) -> None:
        """Start a process and connect to it."""
        links = message_link.create_links(2)
        # A file: the page's messages matter only if it dies, and a pipe without a reader would fill
        # up.
        self._errors = _errors_file()
        self._folder = tempfile.mkdtemp(prefix="gazerig-page-")
        try:
            self._process = child_process.start(
                "gazerig.robot.dashboard.page_main",
                *links.arguments,
                *(str(os.getpid()), self._host, str(self._port)),
                stderr=self._errors.fileno(),
                pass_fds=links.fds,
                variables={
                    TOKEN_VARIABLE: self._token,
                    ONCE_VARIABLE: self._once if self.started == 0 else "",
                    FOLDER_VARIABLE: self._folder,
                    COMMANDS_VARIABLE: str(self._commands() or ""),
                },
            )
        finally:
            for theirs in links.child_sockets:
                theirs.close()
        ours, stops = links.parent_ends
        self._began_s = self._clock.now_s()
        self.join(ours, stops)

    def join(self, link: MessageLink, stops: MessageLink | None = None) -> None:
        """Use these links from now on; ``open`` creates them with a process at the other ends.

        stops: link for stops only
        """
        link.setblocking(False)
        self._socket = link

        def refuse(message: bytes) -> None:
            self._answer(parse_request(message)[0], "refused: too many requests at once; try again")

        def stop(asked: Mapping[str, object]) -> str:
            return self._handle(json.dumps(asked).encode()) or ""

        self._inbox = Inbox(link, self._take, self._handle_loss, refuse)
        self._stops = StopListener(stops, stop) if stops is not None else None

    def check(self) -> None:
        """End a page that hangs, and send answers that it could not accept; for the loop."""
        self._kill_if_hung()
        self._flush_replies()

    def offer(self, choices: Mapping[str, tuple[str, ...]]) -> None:
        """Set the menus of the page: name of the menu -> choices, the present one first."""
        self._choices = choices
        self.send(CHOICES + json.dumps(choices).encode())

    def offer_tracks(self, infos: Sequence[TrackInfo]) -> None:
        """Describe the rig's tracks to the page."""
        self._tracks = infos
        self.send(TRACKS + msgspec.json.encode(infos))

    def say(self, text: str) -> None:
        """Show a message to all users of the page."""
        self._answer(ALL_USERS, text)

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

    def _take(self, message: bytes) -> None:
        """Handle a message of the page; called by the inbox."""
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
            if self.started > 1 and self._choices:
                self.offer(self._choices)
                self.offer_tracks(self._tracks)
            if self._mourned and not self._welcomed:
                self._welcomed = True
                self._notices.append(f"the page is there again, at {url}")
        elif kind == NOTICE:
            self._notices.append(body.decode())
        elif kind == REQUEST:
            who, data = parse_request(message)
            self._answer(who, self._handle(data))

    def _handle(self, data: bytes) -> str | None:
        """Execute a request; an error in it must not end the handling of requests."""
        try:
            asked = json.loads(data)
            return self._on_request(asked) if self._on_request is not None else None
        except Exception as error:  # a stop must be executed after any fault
            return f"the rig could not do that: {type(error).__name__}: {error}"

    def _answer(self, who: str, text: str | None) -> None:
        """Acknowledge a request, with the reply."""
        text = text[:_MOST_WORDS] if text is not None else None
        self._pending_replies.append(MESSAGE + json.dumps((who, text)).encode())
        self._flush_replies()

    def _flush_replies(self) -> None:
        """Send the answers that the page could not accept so far."""
        with self._paying:
            while self._pending_replies and self.send(self._pending_replies[0]):
                self._pending_replies.popleft()

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
        self.gone = code == CANNOT_OPEN
        if self._clock.now_s() - self._began_s > _WELL_AFTER_S:
            self._wait_s, self._mourned, self._welcomed = _AGAIN_AFTER_S, False, False
        if not self._mourned:
            then = "start it again to see the page" if self.gone else "it is started again"
            self._notices.append(f"the page has stopped ({text}); the rig runs on, {then}")
        self._mourned = True
        if self.gone:
            return
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

    def _kill_if_hung(self) -> None:
        """Kill and restart a page that hangs or is suspended: its STOP button may not work.

        A page that is still starting and has no address does not count as hung.
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
            link.close()
        stops, self._stops = self._stops, None
        if stops is not None:
            stops.close()
        self._url = None

    def close(self) -> None:
        """End the page; safe to call twice."""
        self._over.set()
        with self._beginning:
            ear, self._inbox = self._inbox, None
            if ear is not None:
                ear.close()
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
    """Return a file without a name, in memory."""
    return os.fdopen(os.memfd_create("page_errors"), "w+b", buffering=0)


def _read_tail(file: BinaryIO) -> bytes:
    """Return the last bytes of a file that another process may still write to."""
    start = max(0, os.fstat(file.fileno()).st_size - _LAST_LINES_BYTES)
    # Keeps the position at which the other process writes.
    return os.pread(file.fileno(), _LAST_LINES_BYTES, start)
