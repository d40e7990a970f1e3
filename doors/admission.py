"""Who may connect to a door: programs of the same user, no web pages, and so many at once."""

import asyncio
import os
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from ipaddress import IPv4Address, IPv6Address, ip_address
from math import inf
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from gazerig.doors.door import Address, DoorLink, is_loopback

MOST = 8
"""Connections of a door at once."""
IDLE_S = 10.0
"""A connection is idle after this time without a message from it, and before its first one."""
_TABLES = ("/proc/net/tcp", "/proc/net/tcp6")
"""Linux: the ends of all connections on this computer, with their users."""


def page_refusal(bind: str, port: int, headers: Mapping[str, str]) -> str:
    """Return why a request is refused as that of a web page, "" if it is not.

    Browsers write the page's address into Origin; no page has the door's own. A page whose name
    leads to this computer (DNS rebinding) is known by the name in Host.

    Args:
        bind: Where the door listens, HOST:PORT.
        port: The port on which it listens.
        headers: Headers of the request.
    """
    own = [f"http://{name}:{port}" for name in ("127.0.0.1", "[::1]", "localhost")]
    if (origin := headers.get("Origin")) is not None and origin not in own:
        return (
            f"a web page of {origin or 'no address':.60} was refused; let a program connect, which "
            "sends no Origin"
        )
    host = headers.get("Host", "")
    if is_loopback(Address.parse(bind).host) and not is_loopback(_hostname(host)):
        return f"a request to {host or 'no host':.60} was refused; the door is at ws://{bind}"
    return ""


def user_refusal(bind: str, transport: asyncio.WriteTransport) -> str:
    """Return why a connection is refused as that of another user, "" if it is not.

    Nothing is refused on a door that listens to the network, nor without /proc. Root may connect:
    it can do all that the user of the door can.

    Args:
        bind: Where the door listens, HOST:PORT.
        transport: The connection.
    """
    rows: list[str] = []
    tables = 0
    for table in _TABLES if is_loopback(Address.parse(bind).host) else ():
        with suppress(OSError):
            rows += Path(table).read_text("ascii").splitlines()[1:]
            tables += 1
    if not tables:
        return ""
    peer, own = (transport.get_extra_info(name) for name in ("peername", "sockname"))
    uid = socket_user(rows, peer, own) if peer and own else None
    if uid in (os.getuid(), 0):
        return ""
    if uid is None:
        return "a connection was refused: it had closed before its user was known"
    return f"a program of user {uid} was refused; run it as the door's user, {os.getuid()}"


def socket_user(rows: Iterable[str], peer: tuple[Any, ...], own: tuple[Any, ...]) -> int | None:
    """Return the user of the peer's end of a connection, None if that is closed.

    Args:
        rows: Rows of Linux's tables of connections.
        peer: Address and port of that end.
        own: Address and port of the other end.
    """
    theirs, ours = _as_listed(peer), _as_listed(own)
    for row in rows:
        _, local, remote, _, _, _, _, uid, _, inode, *_ = row.split()
        # What a process has closed is listed until it has been sent, as root's and without inode.
        if local in theirs and remote in ours and inode != "0":
            return int(uid)
    return None


def _as_listed(end: tuple[Any, ...]) -> set[str]:
    """Return the forms in which the tables list an address: IPv4 may be that of an IPv6 socket."""
    address = ip_address(end[0].partition("%")[0])
    found: list[IPv4Address | IPv6Address] = [address]
    if isinstance(address, IPv6Address) and address.ipv4_mapped is not None:
        found = [address.ipv4_mapped]
    if isinstance(found[0], IPv4Address):
        found.append(IPv6Address(f"::ffff:{found[0]}"))
    return {f"{_as_hex(one.packed)}:{end[1]:04X}" for one in found}


def _as_hex(packed: bytes) -> str:
    words = [packed[at : at + 4] for at in range(0, len(packed), 4)]
    return "".join(f"{int.from_bytes(word, sys.byteorder):08X}" for word in words)


def _hostname(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""


class Neighbours:
    """The connections of a door: beyond ``MOST``, the newest takes the place of the idlest.

    Args:
        link: The head.
    """

    def __init__(self, link: DoorLink) -> None:
        self._link = link
        self._heard_s: dict[asyncio.WriteTransport, float] = {}

    def admit(self, transport: asyncio.WriteTransport) -> bool:
        """Add a connection; return whether there is a place for it."""
        if len(self._heard_s) >= MOST:
            idlest = min(self._heard_s, key=self._heard_s.__getitem__)
            if self._link.now_s() - self._heard_s[idlest] < IDLE_S:
                self._link.report(
                    f"more than {MOST} connections at once, none of them idle: the newest is refused"
                )
                return False
            self._link.report(f"more than {MOST} connections at once: the idlest is closed")
            self.leave(idlest)
            idlest.abort()
        self._heard_s[transport] = -inf
        return True

    def hear(self, transport: asyncio.WriteTransport) -> None:
        """Note a message of a connection."""
        if transport in self._heard_s:
            self._heard_s[transport] = self._link.now_s()

    def leave(self, transport: asyncio.WriteTransport) -> None:
        """Remove a connection."""
        self._heard_s.pop(transport, None)
