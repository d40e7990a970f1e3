"""Process that writes a recording; it receives messages on a socket and outlives its program.

gazerig.robot.recording.writer_client starts ``python -m gazerig.robot.recording.writer_process
SOCKET FILE`` with two open file descriptors. A message is the byte MORE or LAST and a piece of
kind and body; the first message contains the run's settings. Ticks are encoded by
``control.tick_stream``, images are passed in shared memory. This process makes the file's JSON
and JPEGs. When the client is gone for any reason, the file is closed properly.
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
"""Kinds of messages. Bodies are MessagePack; for TICKS see ``tick_stream.TickBatch``."""
FAILED, DONE = "failed", "done"
"""Kinds of replies: the reason why nothing more can be written; the size of the recording."""
PIECE_BYTES = 100_000
"""Longest message: a socket's default send buffer in Linux holds 212,992 bytes."""

_FLUSH_S = 0.4
_SYNC_S = 1.0
_WAIT_S = 0.1
_NICE = 5


class _Message(NamedTuple):
    """A received message and its file descriptor, or -1."""

    kind: bytes
    body: bytes
    fd: int


def main(socket_fd: int, file_fd: int) -> None:
    """Write until the client is gone or ends the recording."""
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
    """Write the messages; return the end of the run."""
    router = RecordRouter(writer)
    end = RunEnd()
    flushed_s = synced_s = clock.now_s()
    reported = False
    for one in messages:
        kind, body, fd = one if one is not None else (b"", b"", -1)
        if kind == END:
            end = RunEnd(**decode_plain(body))
        elif kind == WORLD:
            writer.world(decode_plain(body))
        elif kind == TICKS:
            router.ticks(body)
        elif kind == FRAME:
            captured_s, shape, dtype = decode_plain(body)
            router.frame(captured_s, taken(PassedImage(fd, tuple(shape), dtype)))
        elif kind == HEALTH:
            counts, lost = decode_plain(body)
            router.health(BusHealth(*counts), lost)
        now_s = clock.now_s()
        if now_s - flushed_s >= _FLUSH_S:
            flushed_s = now_s
            writer.flush()
        if now_s - synced_s >= _SYNC_S:
            synced_s = now_s
            writer.sync()
        if writer.failed and not reported:
            reported = True
            _answer(rig, FAILED, writer.failed)
    return end


def _messages(rig: socket.socket, parent: int) -> Iterator[_Message | None]:
    """Return the messages until the end, and None after each pause.

    Args:
        rig: Socket to the client.
        parent: Process of the program; its forks may keep the socket open after its death.
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
    """Send a reply, if the client still exists."""
    with contextlib.suppress(OSError):
        rig.send(pickle.dumps((kind, values)))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
