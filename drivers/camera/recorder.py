"""Recording of a camera's frames while it is used; threads encode and write them."""

from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import suppress
from pathlib import Path
from threading import BoundedSemaphore

import msgspec
from mcap.writer import CompressionType, IndexType, Writer

from gazerig.drivers.camera.recording_format import (
    PROFILE,
    TYPES,
    encode_shot,
    nanoseconds,
    schema_of,
)
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError
from gazerig.drivers.files.file_output import refuse_existing


class RecordingWriter:
    """An MCAP file of frames.

    The file has no chunks, so after a kill it can be read up to the last complete frame.
    """

    def __init__(self, path: Path) -> None:
        """Create the file.

        Raises:
            CameraError: the file already exists or cannot be created.
        """
        refuse_existing(path, force=False)
        try:
            self._file = path.open("xb")
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
        for topic, (name, kind) in TYPES.items():
            text = msgspec.json.encode(schema_of(kind))
            number = self._writer.register_schema(name, "jsonschema", text)
            self._channels[topic] = self._writer.register_channel(topic, "json", number)
        self._file.flush()

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

    def close(self) -> None:
        """Write the end of the file; safe to call twice."""
        if not self._file.closed:
            try:
                self._writer.finish()  # type: ignore[no-untyped-call]
            finally:
                self._file.close()


_ENCODERS = 2  # PNG of colour and depth takes most of a frame's time; OpenCV frees the GIL
_MOST_WAITING = 30  # frames; if the disk is slower than the camera, frames are omitted


class CameraRecorder:
    """Recorder of a camera's frames, which its own threads encode and write.

    An error of the disk ends the recording and is reported; the camera continues.

    Args:
        path: Path of the file, which is created.

    Raises:
        CameraError: the file already exists or cannot be created.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._writer = path, RecordingWriter(path)
        self._encoders = ThreadPoolExecutor(_ENCODERS, "encoder")
        self._disk = ThreadPoolExecutor(1, "recorder")
        self._room = BoundedSemaphore(_MOST_WAITING)
        self._events: list[str] = []
        self._failed = self._is_slow = False

    def add(self, shot: Shot) -> None:
        """Record a frame; returns at once."""
        if self._room.acquire(blocking=False):
            self._disk.submit(self._write, shot, self._encoders.submit(encode_shot, shot))
        elif not self._is_slow:
            self._is_slow = True
            self._events.append(
                f"{self._path}: this machine is slower than the camera, frames are omitted from "
                "the recording"
            )

    def events(self) -> tuple[str, ...]:
        """Return new events of the recording, one line each."""
        events, self._events = tuple(self._events), []
        return events

    def finish(self) -> None:
        """Write queued frames and close the file; safe to call twice."""
        self._encoders.shutdown()
        self._disk.shutdown()
        with suppress(OSError):  # the disk is full, which was reported
            self._writer.close()

    def _write(self, shot: Shot, encoded: "Future[list[tuple[str, bytes]]]") -> None:
        try:
            if not self._failed:
                self._writer.add(shot.captured_s, shot.number, encoded.result())
        except Exception as error:  # the camera continues after any error
            self._failed = True
            words = getattr(error, "strerror", None) or " ".join(str(error).split())
            self._events.append(f"{self._path}: recording ended: {words}")
        finally:
            self._room.release()
