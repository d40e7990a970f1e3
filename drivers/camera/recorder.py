"""Recording of a camera's frames while it is used; threads encode and write them."""

import json
import os
import queue
import threading
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import IO, NamedTuple

from mcap.writer import CompressionType, IndexType, Writer

from gazerig.drivers.camera.recording_format import PROFILE, SCHEMAS, encode_shot, nanoseconds
from gazerig.drivers.camera.source import FrameSource, Shot
from gazerig.drivers.errors import CameraError
from gazerig.drivers.files.file_output import refuse_existing

# Interval of syncs to the disk, as a loss of power loses the system's buffers.
_SYNC_NS = 1_000_000_000


class RecordingWriter:
    """An MCAP file of frames.

    The file has no chunks, so after a kill it can be read up to the last complete frame.

    written_frames: number of frames so far
    """

    def __init__(self, path: Path, about: dict[str, str], over: bool = False) -> None:
        """Create the file.

        about: metadata of the recording; over:
            whether to overwrite an existing file

        Raises:
            CameraError: the file already exists or cannot be created.
        """
        self._path = path
        refuse_existing(path, force=over)
        try:
            self._file: IO[bytes] = path.open("wb" if over else "xb")
        except OSError as error:
            raise CameraError(
                f"cannot write {path} ({error.strerror}): name another file"
            ) from error
        self._writer = Writer(
            self._file,
            compression=CompressionType.NONE,
            index_types=IndexType.METADATA,
            use_chunking=False,
        )
        self._writer.start(profile=PROFILE, library="gazerig")
        self._channels: dict[str, int] = {}
        for topic, (name, schema) in SCHEMAS.items():
            text = json.dumps(schema).encode("ascii")
            number = self._writer.register_schema(name, "jsonschema", text)
            self._channels[topic] = self._writer.register_channel(topic, "json", number)
        self._writer.add_metadata("gazerig", about)
        self._file.flush()
        self._synced_ns = 0
        self.written_frames = 0

    def write(self, shot: Shot) -> None:
        """Add a frame and its data.

        Raises:
            OSError: the disk is full or gone.
        """
        self.add(shot.captured_s, shot.number, encode_shot(shot))

    def add(self, captured_s: float, number: int, messages: list[tuple[str, bytes]]) -> None:
        """Add an encoded frame: topics and messages, the image last.

        Raises:
            OSError: the disk is full or gone.
        """
        stamp = nanoseconds(captured_s)
        for topic, data in messages:
            self._writer.add_message(self._channels[topic], stamp, data, stamp, number)
        self._file.flush()
        self.written_frames += 1
        if abs(stamp - self._synced_ns) >= _SYNC_NS:
            self._synced_ns = stamp
            os.fsync(self._file.fileno())

    def close(self) -> None:
        """Write the end of the file; safe to call twice."""
        if not self._file.closed:
            try:
                self._writer.finish()  # type: ignore[no-untyped-call]
            finally:
                self._file.close()


_ENCODERS = 2  # PNG of colour and depth takes most of a frame's time; OpenCV frees the GIL
_MOST_WAITING = 30  # frames; if the disk is slower than the camera, frames are omitted


class _QueuedFrame(NamedTuple):
    """A frame that is queued for the file."""

    captured_s: float
    number: int
    messages: Future[list[tuple[str, bytes]]]


class CameraRecorder:
    """A source of frames that are also written to a file and returned unchanged.

    An error of the disk ends the recording and is reported; the camera continues. The file stays
    open while the source is reopened; ``finish`` closes it.

    Args:
        source: Source of frames.
        path: Path of the file.
        about: Metadata of the recording.
        over: Whether to overwrite an existing file.

    failure: reason why the recording ended early, or ""
    dropped_frames: number of frames omitted because of a slow disk
    """

    def __init__(
        self,
        source: FrameSource,
        path: Path,
        about: dict[str, str] | None = None,
        over: bool = False,
    ) -> None:
        self._source = source
        self._path = path
        self._about = about or {}
        self._over = over
        self._writer: RecordingWriter | None = None
        self._thread: threading.Thread | None = None
        self._encoders: ThreadPoolExecutor | None = None
        self._waiting: queue.Queue[_QueuedFrame | None] = queue.Queue(_MOST_WAITING)
        self._events: list[str] = []
        self.failure = ""
        self.dropped_frames = 0

    @property
    def written_frames(self) -> int:
        """Return the number of frames in the file."""
        return 0 if self._writer is None else self._writer.written_frames

    def open(self) -> None:
        """Open the source and, the first time, create the file.

        Raises:
            CameraError: the source cannot be opened, or the file cannot be created.
        """
        self._source.open()
        if self._writer is None:
            try:
                self._writer = RecordingWriter(self._path, self._about, self._over)
            except BaseException:
                self._source.close()
                raise
            self._encoders = ThreadPoolExecutor(_ENCODERS, "encoder")
            self._thread = threading.Thread(target=self._write, name="recorder", daemon=True)
            self._thread.start()

    def take(self, now_s: Callable[[], float], stop: threading.Event) -> Shot | None:
        """Wait for the next frame, and pass it to the recording.

        Raises:
            CameraError: there will be no more frames.
        """
        shot = self._source.take(now_s, stop)
        if shot is not None and not self.failure:
            if self._waiting.full():
                if self.dropped_frames == 0:
                    self._events.append(
                        f"{self._path}: this machine is slower than the camera, frames are omitted "
                        "from the recording"
                    )
                self.dropped_frames += 1
            elif self._encoders is not None:
                messages = self._encoders.submit(encode_shot, shot)
                self._waiting.put(_QueuedFrame(shot.captured_s, shot.number, messages))
        return shot

    def events(self) -> tuple[str, ...]:
        """Return new events of the source and of the recording, one line each."""
        reported, self._events = tuple(self._events), []
        return (*self._source.events(), *reported)

    def close(self) -> None:
        """Free the source; the file stays open in case it is reopened."""
        self._source.close()

    def finish(self) -> None:
        """Write queued frames and close the file; safe to call twice."""
        if self._thread is not None:
            self._waiting.put(None)
            self._thread.join()
            self._thread = None
        if self._encoders is not None:
            self._encoders.shutdown()
            self._encoders = None

    def _write(self) -> None:
        """Write frames until the end of the recording; after a fault only discard them."""
        writer = self._writer
        assert writer is not None
        while (one := self._waiting.get()) is not None:
            if not self.failure:
                self._call_guarded(partial(_write_encoded, writer, one))
        self._call_guarded(writer.close)

    def _call_guarded(self, write: Callable[[], None]) -> None:
        """Call ``write``, or record why it failed: the camera continues after any error."""
        try:
            write()
        except Exception as error:
            if not self.failure:
                words = getattr(error, "strerror", None) or " ".join(str(error).split())
                self.failure = f"{self._path}: recording ended: {words}"
                self._events.append(self.failure)


def _write_encoded(writer: RecordingWriter, one: _QueuedFrame) -> None:
    """Wait until a frame is encoded, and write it."""
    writer.add(one.captured_s, one.number, one.messages.result())
