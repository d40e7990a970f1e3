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
from math import inf
from typing import Any, NamedTuple

from msgspec import UNSET
from msgspec.structs import replace

from gazerig.drivers.process.passed_image import PassedImage, receive, take_image
from gazerig.drivers.process.priority import lower_priority
from gazerig.drivers.types import ImageArray
from gazerig.gaze.types import Percept
from gazerig.robot.loop.tick import Tick, TickRecord
from gazerig.robot.loop.tick_stream import all_finite, decode, encode
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording import viewer_messages as viewers
from gazerig.robot.recording.run_info import RunEnd, RunInfo
from gazerig.robot.recording.run_writer import RunWriter

_VIEWED_EVERY_S = 0.0399  # slightly below 40 ms, so that rounding does not make it 45


class RecordRouter:
    """Writer of one run's messages, in the order of the calls."""

    def __init__(self, writer: RunWriter) -> None:
        self._writer = writer
        self._first_s: float | None = None
        self._at_s = 0.0
        self._viewed_s = -inf
        self._percept: Percept | None = None

    def write_ticks(self, data: bytes) -> None:
        """Write the ticks of a ``tick_stream.TickBatch``."""
        finite = all_finite(data)
        for record in decode(data, list[TickRecord]):
            exact = b"" if finite else encode(record)
            if not all_finite(exact):
                record = replace(record, exact=exact)
            if record.percept is not UNSET:
                self._percept = record.percept
            if self._first_s is None:
                self._first_s = record.tick.t_s
            self._at_s = record.tick.t_s - self._first_s
            self._add(fmt.TICK, record)
            for event in record.tick.events:
                self._add(fmt.LOG, viewers.Log(self._now, event))
            if self._at_s - self._viewed_s >= _VIEWED_EVERY_S:
                self._viewed_s = self._at_s
                self._write_views(record.tick)

    def _write_views(self, tick: Tick) -> None:
        """Write the messages for viewers."""
        pose, now = tick.pose, self._now
        faces = self._percept.faces if self._percept is not None else ()
        self._add(
            fmt.JOINT_STATES, viewers.joint_states(tick.guard_result.joints, tick.joints, now)
        )
        self._add(fmt.TRANSFORMS, viewers.transforms(pose, now))
        points_m = [face.p_world_m for face in faces]
        point_m = tick.gaze.gaze_point_world_m
        self._add(fmt.SCENE, viewers.scene_message(pose, point_m, points_m, now))

    def write_frame(self, captured_s: float, image: ImageArray) -> None:
        """Write a camera image as JPEG."""
        # Loads OpenCV.
        from gazerig.robot.dashboard.feed.camera_picture import encode as encode_jpeg

        first_s = self._first_s if self._first_s is not None else captured_s
        exposed = viewers.time_stamp(self._writer.time_ns(captured_s - first_s))
        self._add(fmt.FRAME, viewers.CompressedImage(exposed, captured_s, encode_jpeg(image)))

    def write_health(self, health: fmt.Health) -> None:
        """Write the bus counts."""
        self._add(fmt.HEALTH, health)

    @property
    def _now(self) -> viewers.Time:
        return viewers.time_stamp(self._writer.time_ns(self._at_s))

    def _add(self, topic: str, message: object) -> None:
        self._writer.add(topic, self._at_s, message)


MORE, LAST = b"+", b"."
BEGIN, TICKS, FRAME, HEALTH, END = b"b", b"t", b"f", b"h", b"e"
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
    lower_priority(_NICE)
    with socket.socket(fileno=socket_fd) as rig:
        messages = _messages(rig, os.getppid())
        first = next((one for one in messages if one is not None), None)
        if first is None:
            return
        info, urdf = decode(first.body, tuple[RunInfo, str])
        writer = RunWriter(file_fd, info)
        if urdf:
            writer.add(fmt.DESCRIPTION, 0.0, viewers.Text(urdf))
        end = _write(messages, writer, rig, RealClock())
        writer.close(end)
        _send_reply(
            rig, FAILED if writer.failed else DONE, writer.failed or tuple(writer.written_file)
        )


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
            end = decode(body, RunEnd)
        elif kind == TICKS:
            router.write_ticks(body)
        elif kind == FRAME:
            captured_s, shape, dtype = decode(body, tuple[float, tuple[int, ...], str])
            router.write_frame(captured_s, take_image(PassedImage(fd, shape, dtype)))
        elif kind == HEALTH:
            router.write_health(decode(body, fmt.Health))
        now_s = clock.now_s()
        if now_s - flushed_s >= _FLUSH_S:
            flushed_s = now_s
            writer.flush()
        if now_s - synced_s >= _SYNC_S:
            synced_s = now_s
            writer.sync()
        if writer.failed and not reported:
            reported = True
            _send_reply(rig, FAILED, writer.failed)
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


def _send_reply(rig: socket.socket, kind: str, values: Any) -> None:
    """Send a reply, if the client still exists."""
    with contextlib.suppress(OSError):
        rig.send(pickle.dumps((kind, values)))


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))
