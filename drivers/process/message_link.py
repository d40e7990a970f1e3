"""Messages between this program and a child process, in both directions.

On Linux the link is a pair of message-preserving sockets, one of which the child inherits.
Elsewhere it is a connection over the loopback interface: the child sends a token first, and each
message is preceded by its length. Both ends are used like a socket.
"""

import contextlib
import hmac
import secrets
import select
import socket
import threading
from collections import deque
from collections.abc import Mapping
from typing import NamedTuple, Protocol

HAS_PAIRS = hasattr(socket, "AF_UNIX") and hasattr(socket, "SOCK_SEQPACKET")
"""Whether this system has message-preserving sockets that a child can inherit: Linux."""
DONT_WAIT: int = getattr(socket, "MSG_DONTWAIT", 0x40)
TOKEN_VARIABLE = "GAZERIG_LINK_TOKEN"
"""Environment variable with the child's token."""

_LOOPBACK = "127.0.0.1"
_TOKEN_BYTES = 32
_LENGTH_BYTES = 4
_MOST_BYTES = 1 << 23
"""Largest number of bytes waiting to be sent; more are refused, as by a full socket."""
_COMES_WITHIN_S = 60.0
_LOOK_S = 0.25


class MessageLink(Protocol):
    """One end of a link: a socket, or an object with the same methods."""

    def fileno(self) -> int:
        """Return the file descriptor to wait on; it may change until the other end is connected."""

    def setblocking(self, flag: bool, /) -> None:
        """Set whether ``recv`` waits."""

    def send(self, data: bytes, flags: int = 0, /) -> int:
        """Send one message.

        Raises:
            OSError: the link is closed; BlockingIOError if it is full.
        """

    def recv(self, bufsize: int, flags: int = 0, /) -> bytes:
        """Return one message, b"" if the other end is closed.

        Raises:
            OSError: the link is closed; BlockingIOError if there is no message yet.
        """

    def shutdown(self, how: int, /) -> None:
        """Wake all waiting threads."""

    def close(self) -> None:
        """Close."""


class LinkOffer(NamedTuple):
    """Links for a child that will be started.

    parent_ends: ends of this program
    arguments: command line arguments with which the child opens its ends
    fds: file descriptors that it must inherit; variables: additions to its environment
    child_sockets: sockets to close here once it has started
    """

    parent_ends: tuple[MessageLink, ...]
    arguments: tuple[str, ...]
    fds: tuple[int, ...]
    variables: Mapping[str, str]
    child_sockets: tuple[socket.socket, ...]


def create_links(count: int) -> LinkOffer:
    """Create links for a child.

    Raises:
        OSError: no more sockets are available.
    """
    if HAS_PAIRS:
        pairs = [socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(count)]
        ours, theirs = zip(*pairs, strict=True)
        fds = tuple(end.fileno() for end in theirs)
        return LinkOffer(ours, tuple(map(str, fds)), fds, {}, theirs)
    token = secrets.token_hex(_TOKEN_BYTES // 2)
    links = tuple(LoopbackLink(listener=_listen(), token=token) for _ in range(count))
    words = tuple(f"port:{link.port}" for link in links)
    return LinkOffer(links, words, (), {TOKEN_VARIABLE: token}, ())


def open_link(word: str, token: str = "") -> MessageLink:
    """Open the child's end.

    Raises:
        OSError: the other end is closed.
    """
    kind, _, port = word.rpartition(":")
    if not kind:
        return socket.socket(fileno=int(word))
    end = socket.create_connection((_LOOPBACK, int(port)))
    end.sendall(token.encode())
    return LoopbackLink(end)


def wait_readable(link: MessageLink) -> None:
    """Wait until a message, the end of the link or a caller arrives."""
    if isinstance(link, LoopbackLink):
        link.wait()
        return
    waiting = select.poll()
    waiting.register(link, select.POLLIN)
    waiting.poll()


class LoopbackLink:
    """One end of a connection over the loopback interface.

    A thread sends the messages, so that no caller waits for the other end.

    Args:
        end: Connection; None: it is accepted by the listener.
        listener: Accepts the connection that sends the token.
        token: Token that the other end must send.
    """

    def __init__(
        self,
        end: socket.socket | None = None,
        listener: socket.socket | None = None,
        token: str = "",
    ) -> None:
        self._end, self._listener, self._token = end, listener, token.encode()
        self.port = int(listener.getsockname()[1]) if listener is not None else 0
        self._looks = round(_COMES_WITHIN_S / _LOOK_S)
        self._waits = True
        self._closed = False
        self._got = b""
        self._queue: deque[bytes] = deque()
        self._queued = 0
        self._news = threading.Condition()
        threading.Thread(target=self._send_queued, name="link", daemon=True).start()

    def fileno(self) -> int:
        """Return the file descriptor to wait on."""
        held = self._end if self._end is not None else self._listener
        return held.fileno() if held is not None else -1

    def setblocking(self, flag: bool, /) -> None:
        """Set whether ``recv`` waits."""
        self._waits = flag

    def send(self, data: bytes, flags: int = 0, /) -> int:
        """Queue one message; see MessageLink."""
        with self._news:
            if self._closed:
                raise BrokenPipeError("the link is closed")
            if self._queued + len(data) > _MOST_BYTES:
                raise BlockingIOError("the link is full")
            self._queue.append(len(data).to_bytes(_LENGTH_BYTES, "little") + data)
            self._queued += len(data)
            self._news.notify()
        return len(data)

    def recv(self, bufsize: int, flags: int = 0, /) -> bytes:
        """Return one message; see MessageLink."""
        waits = self._waits and not flags & DONT_WAIT
        while True:
            if waits:
                self.wait()
            elif not self._is_ready(0.0):
                raise BlockingIOError
            if self._closed or (self._end is None and not self._accept()):
                return b""
            if self._end is None or not self._is_ready(0.0):
                continue
            try:
                more = self._end.recv(self._missing_bytes())
            except ConnectionError:
                more = b""
            if not more:
                return b""
            self._got += more
            if self._missing_bytes() == 0:
                message, self._got = self._got[_LENGTH_BYTES:], b""
                return message

    def wait(self) -> None:
        """Wait until a message, the end of the link or a caller arrives."""
        while not self._closed and not self._is_ready(_LOOK_S):
            if self._end is None:
                self._looks -= 1
                if self._looks <= 0:  # the child has died before it connected
                    self.shutdown()

    def shutdown(self, how: int = socket.SHUT_RDWR, /) -> None:
        """Wake all waiting threads; no more messages are sent or received."""
        with self._news:
            self._closed = True
            self._news.notify_all()
        if self._end is not None:
            with contextlib.suppress(OSError):
                self._end.shutdown(how)

    def close(self) -> None:
        """Close."""
        self.shutdown()
        for held in (self._end, self._listener):
            if held is not None:
                held.close()

    def _is_ready(self, within_s: float) -> bool:
        """Return whether there are bytes to read or a connection to accept."""
        try:
            return bool(select.select([self.fileno()], [], [], within_s)[0])
        except (OSError, ValueError):  # closed meanwhile
            self._closed = True
            return True

    def _accept(self) -> bool:
        """Accept a connection; return False if none will come any more."""
        assert self._listener is not None
        try:
            end, _ = self._listener.accept()
        except OSError:
            return False
        end.settimeout(1.0)
        shown = b""
        with contextlib.suppress(OSError):
            while len(shown) < _TOKEN_BYTES and (more := end.recv(_TOKEN_BYTES - len(shown))):
                shown += more
        if not hmac.compare_digest(shown, self._token):  # another program; the child may follow
            end.close()
            return True
        end.settimeout(None)
        self._listener.close()
        with self._news:
            self._end = end
            self._news.notify_all()
        return True

    def _missing_bytes(self) -> int:
        """Return how many bytes of the message, or of its length, have not arrived yet."""
        if len(self._got) < _LENGTH_BYTES:
            return _LENGTH_BYTES - len(self._got)
        length = int.from_bytes(self._got[:_LENGTH_BYTES], "little")
        return _LENGTH_BYTES + length - len(self._got)

    def _send_queued(self) -> None:
        """Send queued messages as fast as the other end receives them."""
        while True:
            with self._news:
                while not self._closed and (self._end is None or not self._queue):
                    self._news.wait()
                if self._closed or self._end is None:
                    return
                message, end = self._queue.popleft(), self._end
                self._queued -= len(message) - _LENGTH_BYTES
            try:
                end.sendall(message)
            except OSError:
                return  # the receiver finds the end


def _listen() -> socket.socket:
    listener = socket.socket()
    listener.bind((_LOOPBACK, 0))
    listener.listen(8)
    return listener
