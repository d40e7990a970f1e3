"""Who may connect to a door: programs of the same user, no web pages, and so many at once."""

import asyncio
import os
from collections.abc import Mapping
from pathlib import Path
from urllib.parse import urlsplit

from gazerig.doors.door import Address, is_loopback

MOST = 8
"""Connections of a door at once."""
_CONNECTIONS = Path("/proc/net")
"""Folder of Linux's tables of connections, with their ports and users."""


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

    Nothing is refused on a door that listens to the network. Root may connect: it can do all that
    the user of the door can.

    Args:
        bind: Where the door listens, HOST:PORT.
        transport: The connection.
    """
    if not is_loopback(Address.parse(bind).host):
        return ""
    peer, own = (transport.get_extra_info(name) for name in ("peername", "sockname"))
    users = connection_users(_CONNECTIONS, peer[1], own[1]) if peer and own else set()
    if not users:
        return "a connection was refused: it had closed before its user was known"
    if others := users - {os.getuid(), 0}:
        return (
            f"a program of user {min(others)} was refused; run it as the door's user, {os.getuid()}"
        )
    return ""


def connection_users(tables: Path, port: int, door_port: int) -> set[int]:
    """Return the users who have a connection from one port to another, at any address.

    What a process has closed is listed until it has been sent, as root's and without inode.

    Args:
        tables: Folder with the tables tcp and tcp6.
        port: The port from which the connection comes.
        door_port: The port to which it goes.
    """
    ends = f"{port:04X}", f"{door_port:04X}"
    rows = [line.split() for path in tables.glob("tcp*") for line in path.read_text().splitlines()]
    return {int(row[7]) for row in rows if (row[1][-4:], row[2][-4:]) == ends and row[9] != "0"}


def _hostname(host: str) -> str:
    try:
        return urlsplit(f"//{host}").hostname or ""
    except ValueError:
        return ""
