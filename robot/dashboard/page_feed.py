"""What the rig sends to the page's process, taken off the socket."""

import json
import socket
from typing import NamedTuple

from gazerig.robot.dashboard.inbox import MESSAGE_BYTES
from gazerig.robot.dashboard.page_process import (
    CHOICES,
    FRAME,
    MESSAGE,
    PARAMS,
    REPLAY,
    SNAPSHOT,
    VALUES,
    unpack,
)
from gazerig.robot.model.types import Snapshot


class News(NamedTuple):
    """What was waiting on the socket: all snapshots, the last frame, whether it has closed.

    others: what must not be lost or passed over, as (kind, what its JSON holds), oldest first
    """

    snapshots: tuple[Snapshot, ...]
    jpeg: bytes | None
    ended: bool
    others: tuple[tuple[bytes, object], ...] = ()


def drain(feed: socket.socket) -> News:
    """Return everything that waits, without waiting for more."""
    snapshots: list[Snapshot] = []
    others: list[tuple[bytes, object]] = []
    jpeg, ended = None, False
    while not ended:
        try:
            message = feed.recv(MESSAGE_BYTES, socket.MSG_DONTWAIT)
        except BlockingIOError:
            break
        except ConnectionResetError:
            message = b""
        ended = not message
        kind, body = message[:1], message[1:]
        if kind == SNAPSHOT:
            snapshots.append(unpack(message))
        elif kind == FRAME:
            jpeg = body
        elif kind in (CHOICES, PARAMS, VALUES, MESSAGE, REPLAY):
            others.append((kind, json.loads(body)))
    return News(tuple(snapshots), jpeg, ended, tuple(others))
