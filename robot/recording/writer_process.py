"""The process that writes a recording: fed through a socket, it outlives the program it serves.

Run as ``python -m gazerig.robot.recording.writer_process SOCKET FILE``, two open file descriptors,
by gazerig.robot.recording.writer_client. A message is a letter, MORE or LAST, and a piece of some
kind and body; the first of all is the run's beginning. Ticks come as ``control.tick_stream`` has
encoded them, images in memory of their own; the JSON of the file and its JPEGs are made here.
When the other side is gone, however it ended, the file is closed as it should be.
"""

import contextlib
import os
import pickle
import select
import socket
import sys
from collections.abc import Iterator
from typing import Any, NamedTuple

from gazerig.drivers.process.passed_image import PassedImage, receive, taken
from gazerig.drivers.types import BusHealth
from gazerig.robot.control.tick_stream import decode_plain
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.recording.record_router import RecordRouter
from gazerig.robot.recording.run_info import RunEnd
from gazerig.robot.recording.run_writer import RunWriter

MORE, LAST = b"+", b"."
BEGIN, WORLD, TICKS, FRAME, HEALTH, END = b"b", b"w", b"t", b"f", b"h", b"e"
"""What may be handed over. Bodies are MessagePack; of TICKS, see ``tick_stream.TickBatch``."""
FAILED, DONE = "failed", "done"
"""What is answered: why nothing more can be written; what was written."""
PIECE_BYTES = 100_000
"""No message is longer: a socket's default send buffer in Linux holds 212,992 bytes."""

_FLUSH_S = 0.4
_SYNC_S = 1.0
_WAIT_S = 0.1
_NICE = 5


class _Message(NamedTuple):
    """What was handed over, and the file descriptor beside it, or -1."""

    kind: bytes
    body: bytes
    fd: int


def main(socket_fd: int, file_fd: int) -> None:
    """Write until the other side is gone or says that the run is over."""
    os.nice(_NICE)
    with socket.socket(fileno=socket_fd) as rig:
        messages = _messages(rig, os.getppid())
        first = next((one for one in messages if one is not None), None)
        if first is None:
            return
        about, started_ns = decode_plain(first.body)
        writer = RunWriter(file_fd, about, started_ns)
        end = _write(messages, writer, rig, RealClock())
        writer.close(end)
        _answer(rig, FAILED if writer.failed else DONE, writer.failed or tuple(writer.written))


def _write(
    messages: Iterator[_Message | None], writer: RunWriter, rig: socket.socket, clock: Clock
) -> RunEnd:
    """Write the messages; return how the run ended."""
    router = RecordRouter(writer)
    end = RunEnd()
    flushed_s = synced_s = clock.now_s()
    said = False
    for one in messages:
        if one is not None:
            if one.kind == END:
                end = RunEnd(**decode_plain(one.body))
            elif one.kind == WORLD:
                writer.world(decode_plain(one.body))
            else:
                _take(router, one)
        now_s = clock.now_s()
        if now_s - flushed_s >= _FLUSH_S:
            flushed_s = now_s
            writer.flush()
        if now_s - synced_s >= _SYNC_S:
            synced_s = now_s
            writer.sync()
        if writer.failed and not said:
            said = True
            _answer(rig, FAILED, writer.failed)
    return end


def _take(router: RecordRouter, one: _Message) -> None:
    """Write one thing that was handed over."""
    if one.kind == TICKS:
        router.ticks(one.body)
    elif one.kind == FRAME:
        captured_s, shape, dtype = decode_plain(one.body)
        router.frame(captured_s, taken(PassedImage(one.fd, tuple(shape), dtype)))
    elif one.kind == HEALTH:
        counts, lost = decode_plain(one.body)
        router.health(BusHealth(*counts), lost)


def _messages(rig: socket.socket, parent: int) -> Iterator[_Message | None]:
    """Return what is handed over, None where nothing comes for a while, until the end.

    parent: the program's process; one that it forked may hold the socket open after its death
    """
    pieces: list[bytes] = []
    while True:
        if not select.select([rig], [], [], _WAIT_S)[0]:
            if os.getppid() != parent:
                return
            yield None
            continue
        try:
            message, fd = receive(rig, PIECE_BYTES + 1)
        except OSError:
            return
        if not message:
            return
        pieces.append(message[1:])
        if message[:1] == LAST:
            body = b"".join(pieces)
            pieces.clear()
            yield _Message(body[:1], body[1:], fd)


def _answer(rig: socket.socket, kind: str, values: Any) -> None:
    """Send a reply, if the other side still exists."""
    with contextlib.suppress(OSError):
        rig.send(pickle.dumps((kind, values)))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
