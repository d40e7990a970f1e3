"""Writer of a camera recording: every frame is in the file when ``write`` returns.

The file has no chunks, so after a kill it can be read up to the last complete frame.
"""

import json
import os
from pathlib import Path
from typing import IO

from mcap.writer import CompressionType, IndexType, Writer

from gazerig.drivers.camera.recording_format import PROFILE, SCHEMAS, encode_shot, nanoseconds
from gazerig.drivers.camera.source import Shot
from gazerig.drivers.errors import CameraError
from gazerig.drivers.files.file_output import refuse_existing

# Interval of syncs to the disk, as a loss of power loses the system's buffers.
_SYNC_NS = 1_000_000_000


class RecordingWriter:
    """An MCAP file of frames.

    written: number of frames so far
    """

    def __init__(
        self, path: Path, about: dict[str, str], jpeg_quality: int | None = None, over: bool = False
    ) -> None:
        """Create the file.

        about: metadata of the recording; jpeg_quality: 1..100, None keeps frames exactly; over:
            whether to overwrite an existing file

        Raises:
            CameraError: the file already exists or cannot be created.
        """
        self._path = path
        self._jpeg_quality = jpeg_quality
        self._file = _create(path, over)
        self._writer = Writer(
            self._file,
            compression=CompressionType.NONE,
            index_types=IndexType.METADATA,
            use_chunking=False,
        )
        self._writer.start(profile=PROFILE, library="gazerig")
        self._channels = {
            topic: self._writer.register_channel(topic, "json", self._schema(topic))
            for topic in SCHEMAS
        }
        self._writer.add_metadata("gazerig", about)
        self._file.flush()
        self._synced_ns = 0
        self.written = 0

    def write(self, shot: Shot) -> None:
        """Add a frame and its data.

        Raises:
            OSError: the disk is full or gone.
        """
        self.add(shot.captured_s, shot.number, encode_shot(shot, self._jpeg_quality))

    def add(self, captured_s: float, number: int, messages: list[tuple[str, bytes]]) -> None:
        """Add an encoded frame: topics and messages, the image last.

        Raises:
            OSError: the disk is full or gone.
        """
        stamp = nanoseconds(captured_s)
        for topic, data in messages:
            self._writer.add_message(self._channels[topic], stamp, data, stamp, number)
        self._file.flush()
        self.written += 1
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

    def _schema(self, topic: str) -> int:
        """Declare the schema of a topic."""
        name, schema = SCHEMAS[topic]
        text = json.dumps(schema).encode("ascii")
        return int(self._writer.register_schema(name, "jsonschema", text))


def _create(path: Path, over: bool) -> IO[bytes]:
    """Create the file."""
    refuse_existing(path, force=over)
    try:
        return path.open("wb" if over else "xb")
    except OSError as error:
        raise CameraError(f"cannot write {path} ({error.strerror}): name another file") from error
