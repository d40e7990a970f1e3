"""Process that writes a recording, so that files, JSON and JPEGs never delay the control loop.

gazerig.robot.recording.recorder starts ``python -m gazerig.robot.recording.writer FILE`` with an
open file descriptor and sends messages to its standard input: kind, length and body. Ticks are
encoded by ``loop.tick_stream``. The process outlives its program until the file is closed; data
that it has flushed survives its own death. It reports failures and the end on standard output.
"""

import contextlib
import os
import select
import struct
import sys
from collections.abc import Callable, Iterator
from math import inf
from typing import NamedTuple

import cv2
import msgspec
import numpy as np
from mcap.writer import CompressionType, Writer
from msgspec.structs import replace

from gazerig.drivers.process.priority import lower_priority
from gazerig.robot.loop.tick import TickRecord
from gazerig.robot.loop.tick_stream import all_finite, decode, encode, to_plain
from gazerig.robot.model.clock import Clock, RealClock
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording.run_info import PROFILE, RunEnd, RunInfo, as_text, started_ns

BEGIN, TICKS, FRAME, END = b"b", b"t", b"f", b"e"
"""Kinds of messages. Bodies are MessagePack; for TICKS see ``tick_stream.TickBatch``."""
PREFIX = struct.Struct("<cII")
"""Kind, length of the body and length of a frame's pixels, before both."""

_CHUNK_BYTES = 1 << 20
_POSES_EVERY_S = 0.0399  # slightly below 40 ms, so that rounding does not make it 45
_FLUSH_S = 0.4
_WAIT_S = 0.1
_NICE = 5
_QUALITY = 80
_WHOLE_NS = 1_000_000_000
_encoder = msgspec.json.Encoder(enc_hook=to_plain)


class Frame(NamedTuple):
    """Description of a camera frame whose pixels follow."""

    captured_s: float
    shape: tuple[int, ...]


class Message(NamedTuple):
    """A received message."""

    kind: bytes
    body: bytes
    pixels: bytes = b""


class Report(msgspec.Struct):
    """A report of the writer: why it failed, or "" and the content of the closed file."""

    failed: str = ""
    ticks: int = 0
    frames: int = 0


class RunWriter:
    """An MCAP file of one run.

    Attributes:
        failed: Reason why nothing more can be written, or "".
    """

    def __init__(self, fd: int, info: RunInfo) -> None:
        """Write the beginning of the file.

        Args:
            fd: Descriptor of an empty file, open for writing; ``close`` closes it.
            info: Settings of the run.
        """
        self._file = open(fd, "wb")  # noqa: SIM115 - closed by close
        self._started_ns = started_ns(info)
        self._writer = Writer(
            self._file,
            chunk_size=_CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_data_crcs=True,
        )
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self._first_s: float | None = None
        self._at_s, self._posed_s = 0.0, -inf
        self.failed = ""
        self._attempt(lambda: self._writer.start(PROFILE, "gazerig"))
        self._attempt(lambda: self._writer.add_metadata(fmt.RUN, as_text(info)))

    def write_ticks(self, data: bytes) -> None:
        """Write the ticks of a ``tick_stream.TickBatch``, and what viewers draw of them."""
        finite = all_finite(data)
        for record in decode(data, list[TickRecord]):
            exact = b"" if finite else encode(record)
            if not all_finite(exact):
                record = replace(record, exact=exact)
            tick = record.tick
            if self._first_s is None:
                self._first_s = tick.t_s
            self._at_s = tick.t_s - self._first_s
            self.add(fmt.TICK, self._at_s, record)
            now = self._time(self._at_s)
            for event in tick.events:
                self.add(fmt.LOG, self._at_s, fmt.Log(now, event))
            if self._at_s - self._posed_s >= _POSES_EVERY_S:
                self._posed_s = self._at_s
                names = tick.guard_result.joints
                self.add(fmt.JOINT_STATES, self._at_s, fmt.joint_states(names, tick.joints, now))

    def write_frame(self, frame: Frame, pixels: bytes) -> None:
        """Write a camera image as JPEG."""
        image = np.frombuffer(pixels, np.uint8).reshape(frame.shape)
        _, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, _QUALITY])
        first_s = self._first_s if self._first_s is not None else frame.captured_s
        exposed = self._time(frame.captured_s - first_s)
        picture = fmt.CompressedImage(exposed, frame.captured_s, jpeg.tobytes())
        self.add(fmt.FRAME, self._at_s, picture)

    def add(self, topic: str, at_s: float, message: object) -> None:
        """Append a message to the present chunk; do nothing after a failure.

        Args:
            topic: Its topic, which determines its type.
            at_s: Time since the first tick.
            message: The message.
        """
        self._counts[topic] = self._counts.get(topic, 0) + 1
        self._attempt(lambda: self._append(topic, self._time_ns(at_s), message))

    def _append(self, topic: str, at_ns: int, message: object) -> None:
        if topic not in self._channels:
            name, kind = fmt.TYPES[topic]
            schema = msgspec.json.encode(fmt.json_schema(kind))
            about = self._writer.register_schema(name, "jsonschema", schema)
            self._channels[topic] = self._writer.register_channel(topic, "json", about)
        data = _encoder.encode(message)
        number = self._counts[topic]
        self._writer.add_message(self._channels[topic], at_ns, data, at_ns, number)

    def flush(self) -> None:
        """Write the present chunk to the disk."""
        self._attempt(self._writer.flush)
        self._attempt(lambda: os.fdatasync(self._file.fileno()))

    def close(self, end: RunEnd) -> Report:
        """Write the end of the run and the index, unless writing failed; close the file."""
        self.flush()
        self._attempt(lambda: self._writer.add_metadata(fmt.END, as_text(end)))
        self._attempt(self._writer.finish)
        self._attempt(self._file.flush)
        self._attempt(lambda: os.fdatasync(self._file.fileno()))
        with contextlib.suppress(OSError):  # after a failure it tries to write the rest
            self._file.close()
        count = self._counts.get
        return Report(self.failed, count(fmt.TICK, 0), count(fmt.FRAME, 0))

    def _time_ns(self, at_s: float) -> int:
        """Return the wall clock at a time since the first tick."""
        return self._started_ns + round(at_s * _WHOLE_NS)

    def _time(self, at_s: float) -> fmt.Time:
        return fmt.Time(*divmod(self._time_ns(at_s), _WHOLE_NS))

    def _attempt(self, work: Callable[[], object]) -> None:
        """Call a function unless writing has failed; store the reason of its failure."""
        if self.failed:
            return
        try:
            work()
        except OSError as error:
            self.failed = error.strerror or str(error)
        except (TypeError, ValueError) as error:
            self.failed = f"it cannot be encoded: {error}"


def main(file_fd: int) -> None:
    """Write until the program is gone or ends the recording."""
    lower_priority(_NICE)
    messages = receive(0, os.getppid())
    first = next((one for one in messages if one is not None), None)
    if first is None:
        return
    info, urdf = decode(first.body, tuple[RunInfo, str])
    writer = RunWriter(file_fd, info)
    if urdf:
        writer.add(fmt.DESCRIPTION, 0.0, fmt.Text(urdf))
    report(writer.close(write(messages, writer, RealClock())))


def write(messages: Iterator[Message | None], writer: RunWriter, clock: Clock) -> RunEnd:
    """Write the messages; return the end of the run."""
    end = RunEnd()
    flushed_s = clock.now_s()
    reported = False
    for kind, body, pixels in (message or Message(b"", b"") for message in messages):
        if kind == END:
            end = decode(body, RunEnd)
        elif kind == TICKS:
            writer.write_ticks(body)
        elif kind == FRAME:
            writer.write_frame(decode(body, Frame), pixels)
        now_s = clock.now_s()
        if now_s - flushed_s >= _FLUSH_S:
            flushed_s = now_s
            writer.flush()
        if writer.failed and not reported:
            reported = True
            report(Report(writer.failed))
    return end


def receive(fd: int, parent: int) -> Iterator[Message | None]:
    """Return the messages until the end, and None after each pause.

    Args:
        fd: Pipe from the program.
        parent: Process of the program; its forks may keep the pipe open after its death.
    """
    while True:
        if not select.select([fd], [], [], _WAIT_S)[0]:
            if os.getppid() != parent:
                return
            yield None
            continue
        prefix = _read(fd, PREFIX.size)
        if len(prefix) < PREFIX.size:
            return
        kind, size, pixel_bytes = PREFIX.unpack(prefix)
        body = _read(fd, size + pixel_bytes)
        if len(body) < size + pixel_bytes:
            return
        yield Message(kind, body[:size], body[size:])


def _read(fd: int, size: int) -> bytes:
    """Read so many bytes, fewer at the end."""
    data = bytearray()
    while len(data) < size and (part := os.read(fd, size - len(data))):
        data += part
    return bytes(data)


def report(line: Report) -> None:
    """Send a report, if the program still exists."""
    with contextlib.suppress(OSError):
        os.write(1, msgspec.json.encode(line) + b"\n")


if __name__ == "__main__":
    main(int(sys.argv[1]))
