"""Receiver of the rig's messages in the page's process."""

import json
from typing import NamedTuple

from gazerig.drivers.process.message_link import DONT_WAIT, MessageLink
from gazerig.drivers.process.passed_image import receive
from gazerig.drivers.types import ImageArray
from gazerig.robot.dashboard.feed.live_feed import LiveFeed, WorldNow
from gazerig.robot.dashboard.feed.page_process import (
    CHOICES,
    FRAME,
    MESSAGE,
    PARAMS,
    REPLAY,
    SNAPSHOT,
    VALUES,
    unpack,
)
from gazerig.robot.dashboard.requests.inbox import MESSAGE_BYTES
from gazerig.robot.description.build import RigShape
from gazerig.robot.model.types import Snapshot


class News(NamedTuple):
    """Messages that waited on the socket: all snapshots, the last frame, whether it has closed.

    jpeg: a recording's frame; image: a running rig's, with what was found in it, BGR
    world: the simulated world about the rig, if there is one
    shape: how the rig is built, if it is known
    others: what must not be lost or passed over, as (kind, what its JSON holds), oldest first
    """

    snapshots: tuple[Snapshot, ...]
    jpeg: bytes | None
    ended: bool
    others: tuple[tuple[bytes, object], ...] = ()
    image: ImageArray | None = None
    world: WorldNow | None = None
    shape: RigShape | None = None


def drain(feed: MessageLink, live: LiveFeed) -> News:
    """Return everything that waits, without waiting for more.

    live: takes what a running rig sends
    """
    snapshots: list[Snapshot] = []
    others: list[tuple[bytes, object]] = []
    jpeg, ended = None, False
    while not ended:
        try:
            message, fd = receive(feed, MESSAGE_BYTES, DONT_WAIT)
        except BlockingIOError:
            break
        except ConnectionResetError:
            message, fd = b"", -1
        ended = not message
        kind, body = message[:1], message[1:]
        if kind == SNAPSHOT:
            snapshots.append(unpack(message))
            live.shown_s = snapshots[-1].t_s
        elif kind == FRAME:
            jpeg = body
        elif kind in (CHOICES, PARAMS, VALUES, MESSAGE, REPLAY):
            others.append((kind, json.loads(body)))
        else:
            live.take(message, fd)
    if (newest := live.snapshot()) is not None:
        snapshots.append(newest)
    return News(
        tuple(snapshots), jpeg, ended, tuple(others), live.image(), live.world(), live.shape
    )
