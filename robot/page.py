"""Show the running rig on a web page without ever making the control loop wait.

The page is a process of its own (``robot.page_view``), fed through a socket pair with
frozen values. Every call here returns at once: what the page cannot take is dropped and
counted, and a page that is slow, stopped or dead changes nothing for the caller. The
page ends when this side of the socket closes, so it never outlives the program, however
that ends.
"""

import json
import os
import pickle
import socket
import subprocess
import sys
from collections import deque
from collections.abc import Mapping
from dataclasses import fields
from math import nan
from operator import attrgetter
from pathlib import Path

from robot.types import SeenBody, SeenFace, Snapshot

# The first byte of a message says what follows it.
SNAPSHOT, PICTURE, URL, NOTICE, CHOICES, ASK = b"s", b"p", b"u", b"n", b"c", b"a"
MESSAGE_BYTES = 200_000
"""No message is longer: a socket's default send buffer in Linux holds 212,992 bytes."""

_CLOSE_PATIENCE_S = 2.0
_LAST_WORDS_BYTES = 4096


SHOWN_EVERY_S = 0.0095
"""Snapshots closer together than some 10 ms are passed over: 100 a second show a saccade of
40 ms as a slope. A little under 10 ms, so that rounding does not turn it into 15."""

# A frozen dataclass with slots is pickled field by field in Python; taking all fields at
# once, by names found ahead, costs a third of that.
_PLAIN = tuple(field.name for field in fields(Snapshot) if field.name not in ("faces", "bodies"))
_plain_values = attrgetter(*_PLAIN)
_face_values = attrgetter(*(field.name for field in fields(SeenFace)))
_body_values = attrgetter(*(field.name for field in fields(SeenBody)))


def pack(snapshot: Snapshot) -> bytes:
    """Write a snapshot as one message."""
    faces = [_face_values(face) for face in snapshot.faces]
    bodies = [_body_values(body) for body in snapshot.bodies]
    values = (_plain_values(snapshot), faces, bodies)
    return SNAPSHOT + pickle.dumps(values, pickle.HIGHEST_PROTOCOL)


def unpack(message: bytes) -> Snapshot:
    """Read a message that ``pack`` wrote; only ever fed by the process that started the page."""
    values, faces, bodies = pickle.loads(memoryview(message)[1:])
    return Snapshot(
        **dict(zip(_PLAIN, values, strict=True)),
        faces=tuple(SeenFace(*face) for face in faces),
        bodies=tuple(SeenBody(*body) for body in bodies),
    )


class Page:
    """The live page as the control loop sees it.

    ``show_picture`` may be called from another thread; everything else belongs to one.

    dropped: snapshots the page did not take; pictures_dropped: the same for pictures
    """

    def __init__(self, host: str, port: int) -> None:
        """Prepare a page for this address and port; a busy port moves on to the next."""
        self._host = host
        self._port = port
        self._socket: socket.socket | None = None
        self._process: subprocess.Popen[bytes] | None = None
        self._errors_fd = -1
        self._url: str | None = None
        self._notices: deque[str] = deque()
        self._asked: deque[tuple[str, str]] = deque()
        self._shown_s = nan
        self.dropped = 0
        self.pictures_dropped = 0

    def open(self) -> str:
        """Start the page and return at once, with the words to say meanwhile."""
        ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        ours.setblocking(False)
        # The page's own words are of interest only if it dies, and a pipe nobody reads fills.
        self._errors_fd = os.memfd_create("page_errors")
        with theirs:
            self._process = subprocess.Popen(
                self._command(theirs.fileno()),
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=self._errors_fd,
                pass_fds=(theirs.fileno(),),
                env=_environment(),
                start_new_session=True,  # Ctrl-C in the terminal is the rig's, not the page's
            )
        self._socket = ours
        return f"the page is starting on port {self._port}"

    def _command(self, fd: int) -> list[str]:
        arguments = [str(fd), str(os.getpid()), self._host, str(self._port)]
        return [sys.executable, "-P", "-m", "robot.page_view", *arguments]

    def show(self, snapshot: Snapshot) -> None:
        """Hand over a snapshot; dropped and counted where the page does not take it."""
        if abs(snapshot.t_s - self._shown_s) < SHOWN_EVERY_S:
            return
        self._shown_s = snapshot.t_s
        if not self._send(pack(snapshot)):
            self.dropped += 1

    def show_picture(self, jpeg: bytes) -> None:
        """Hand over an encoded camera picture with what was found already drawn in."""
        if not self._send(PICTURE + jpeg):
            self.pictures_dropped += 1

    def offer(self, choices: Mapping[str, tuple[str, ...]]) -> None:
        """Put menus on the page: name of the menu -> what can be chosen, the present first."""
        self._send(CHOICES + json.dumps(choices).encode())

    def asked(self) -> tuple[str, str] | None:
        """Give the next choice a spectator has made, as (menu, choice), each one once."""
        self._listen()
        return self._asked.popleft() if self._asked else None

    def _send(self, message: bytes) -> bool:
        page = self._socket
        if page is None or len(message) > MESSAGE_BYTES:
            return False
        try:
            page.send(message)
        except OSError:  # full, gone, or closed by close() in this very moment
            return False
        return True

    def url(self) -> str | None:
        """Give the page's address once it is there and as long as it is."""
        self._listen()
        return self._url

    def notice(self) -> str | None:
        """Give the next line for the person in front of the rig, each one once."""
        self._listen()
        return self._notices.popleft() if self._notices else None

    def _listen(self) -> None:
        while self._socket is not None:
            try:
                message = self._socket.recv(MESSAGE_BYTES)
            except BlockingIOError:
                return
            except OSError:
                message = b""
            if not message:
                self._lose()
            elif message[:1] == URL:
                self._url = message[1:].decode()
            elif message[:1] == NOTICE:
                self._notices.append(message[1:].decode())
            elif message[:1] == ASK:
                menu, choice = json.loads(message[1:])
                self._asked.append((menu, choice))

    def _lose(self) -> None:
        words = self._last_words()
        self._hang_up()
        self._notices.append(
            f"the page has stopped ({words}); the rig runs on, start it again to see the page"
        )

    def _last_words(self) -> str:
        text = os.pread(self._errors_fd, _LAST_WORDS_BYTES, self._errors_from()).decode(
            errors="replace"
        )
        lines = text.strip().splitlines()
        return lines[-1].strip() if lines else "it gave no reason"

    def _errors_from(self) -> int:
        return max(0, os.fstat(self._errors_fd).st_size - _LAST_WORDS_BYTES)

    def _hang_up(self) -> None:
        if self._socket is not None:
            self._socket.close()
            self._socket = None
        self._url = None

    def close(self) -> None:
        """End the page; safe to call twice."""
        self._hang_up()
        if self._process is None:
            return
        try:
            self._process.wait(_CLOSE_PATIENCE_S)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
        self._process = None
        os.close(self._errors_fd)


def _environment() -> dict[str, str]:
    """Let the page find this very package, and keep its numerics to one thread."""
    here = str(Path(__file__).resolve().parents[1])
    known = os.environ.get("PYTHONPATH")
    path = os.pathsep.join((here, known)) if known else here
    return {**os.environ, "PYTHONPATH": path, "OPENBLAS_NUM_THREADS": "1"}
