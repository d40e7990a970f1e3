"""Messages between this program and a child process: message-preserving socket pairs."""

import select
import socket
from typing import NamedTuple

MessageLink = socket.socket
"""One end of a link; each ``send`` is one ``recv`` of the other end."""
DONT_WAIT = socket.MSG_DONTWAIT


class LinkOffer(NamedTuple):
    """Links for a child that will be started.

    parent_ends: ends of this program
    arguments: command line arguments with which the child opens its ends
    fds: file descriptors that it must inherit
    child_sockets: sockets to close here once it has started
    """

    parent_ends: tuple[MessageLink, ...]
    arguments: tuple[str, ...]
    fds: tuple[int, ...]
    child_sockets: tuple[MessageLink, ...]


def create_links(count: int) -> LinkOffer:
    """Create links for a child.

    Raises:
        OSError: no more sockets are available.
    """
    pairs = [socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET) for _ in range(count)]
    ours, theirs = zip(*pairs, strict=True)
    fds = tuple(end.fileno() for end in theirs)
    return LinkOffer(ours, tuple(map(str, fds)), fds, theirs)


def open_link(word: str) -> MessageLink:
    """Open the child's end."""
    return socket.socket(fileno=int(word))


def wait_readable(link: MessageLink) -> None:
    """Wait until a message or the end of the link arrives."""
    waiting = select.poll()
    waiting.register(link, select.POLLIN)
    waiting.poll()
