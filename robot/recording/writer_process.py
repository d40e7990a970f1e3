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

from gazerig.drivers.process.passed_image import PassedImage, receive, take_image
from gazerig.drivers.process.priority import lower_priority
from gazerig.drivers.types import BusHealth, ImageArray
from gazerig.gaze.types import GazeCommand, GazeState, Vec3
from gazerig.robot.control.tick_stream import TickRow, all_finite, decode_plain
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.model.types import GuardResult, JointState
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording import viewer_messages as viewers
from gazerig.robot.recording.run_info import RunEnd
from gazerig.robot.recording.run_writer import RunWriter
from gazerig.robot.recording.tick_record import as_json, percept_as_json

_PERCEPT, _JOINTS = TickRow._fields.index("percept"), TickRow._fields.index("joints")
_VIEWED_EVERY_S = 0.0399  # slightly below 40 ms, so that rounding does not make it 45


class RecordRouter:
    """Writer of one run's messages, in the order of the calls."""

    def __init__(self, writer: RunWriter) -> None:
        self._writer = writer
        self._first_s: float | None = None
        self._at_s = 0.0
        self._viewed_s = -1.0
        self._newest: list[Any] | None = None
        self._faces: list[Vec3] = []
        self._percepts: dict[int, list[Any]] = {}
        self._written = 0
        self._finite = False

    def write_ticks(self, data: bytes) -> None:
        """Write the ticks of a ``tick_stream.TickBatch``, each percept before the first with it."""
        percepts, rows = decode_plain(data)
        self._finite = all_finite(data)
        self._percepts.update({one[0]: one for one in percepts})
        for row in rows:
            number = row[_PERCEPT]
            if number is not None and number > self._written:
                self._written = number
                percept = percept_as_json(self._percepts[number], self._finite)
                self._faces = [face["p_world_m"] for face in percept["faces"]]
                self._add(fmt.PERCEPT, percept)
                self._percepts = {n: one for n, one in self._percepts.items() if n > number}
            self._tick(row)

    def _tick(self, row: list[Any]) -> None:
        """Write a tick, and about every 40 ms the messages for viewers."""
        data = as_json(row, self._finite)
        if self._first_s is None:
            self._first_s = data["t_s"]
        self._at_s = data["t_s"] - self._first_s
        self._add(fmt.TICK, data)
        for event in data["events"]:
            self._add(fmt.LOG, viewers.log_message(event, self._now_ns))
        for order in data["commands"]:
            self._add(fmt.ORDER, order)
        self._newest = row
        if self._at_s - self._viewed_s >= _VIEWED_EVERY_S or self._viewed_s < 0.0:
            self._viewed_s = self._at_s
            viewed, now_ns = TickRow(*row), self._now_ns
            joints, names = JointState(*viewed.joints), GuardResult(*viewed.guard_result).joints
            pose, gaze = GazeState(*viewed.pose), GazeCommand(*viewed.gaze)
            self._add(fmt.JOINT_STATES, viewers.joint_states(names, joints, now_ns))
            self._add(fmt.TRANSFORMS, viewers.transforms(pose, now_ns))
            self._add(
                fmt.SCENE, viewers.scene_message(pose, gaze.gaze_point_world_m, self._faces, now_ns)
            )

    def write_frame(self, captured_s: float, image: ImageArray) -> None:
        """Write a camera image as JPEG."""
        from gazerig.robot.dashboard.feed.camera_overlay import encode  # loads OpenCV

        first_s = self._first_s if self._first_s is not None else captured_s
        exposed_ns = self._writer.time_ns(captured_s - first_s)
        self._add(fmt.FRAME, viewers.image_message(encode(image), captured_s, exposed_ns))

    def write_health(self, bus: BusHealth, lost: int) -> None:
        """Write the bus counts and the servos' readings of the newest tick."""
        servos = {}
        if self._newest is not None:
            joints = JointState(*self._newest[_JOINTS])
            fields = ("temperature_c", "voltage_v", "load", "fault")
            servos = {name: getattr(joints, name) for name in fields}
        counts = {"tx_bytes": bus.tx_bytes, "rx_bytes": bus.rx_bytes, "errors": dict(bus.errors)}
        self._add(fmt.HEALTH, {**counts, **servos, "lost_ticks": lost})

    @property
    def _now_ns(self) -> int:
        return self._writer.time_ns(self._at_s)

    def _add(self, topic: str, data: dict[str, Any]) -> None:
        self._writer.add(fmt.Message(topic, self._at_s, data))


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
        about, started_ns, urdf = decode_plain(first.body)
        writer = RunWriter(file_fd, about, started_ns)
        if urdf:
            writer.add(fmt.Message(fmt.DESCRIPTION, 0.0, {"data": urdf}))
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
            end = RunEnd(**decode_plain(body))
        elif kind == TICKS:
            router.write_ticks(body)
        elif kind == FRAME:
            captured_s, shape, dtype = decode_plain(body)
            router.write_frame(captured_s, take_image(PassedImage(fd, tuple(shape), dtype)))
        elif kind == HEALTH:
            counts, lost = decode_plain(body)
            router.write_health(BusHealth(*counts), lost)
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
