"""Writer of a run's recording: MCAP in zstd chunks, without buffers in this program.

Data that ``flush`` has written survives the program's death. After an error the file is
truncated to its last complete chunk, so that it can be read.
"""

import contextlib
import os
from collections.abc import Iterator
from typing import NamedTuple

import msgspec
from mcap.writer import CompressionType, Writer

from gazerig.robot.loop.tick_stream import to_plain
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording.run_info import PROFILE, RunEnd, RunInfo, as_text, started_ns

_encoder = msgspec.json.Encoder(enc_hook=to_plain)
_CHUNK_BYTES = 1 << 20
_WHOLE_NS = 1_000_000_000


class WrittenFile(NamedTuple):
    """The size of a recording: number of ticks, number of frames, bytes."""

    ticks: int
    frames: int
    size: int


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
        self._file = _UnbufferedFile(fd)
        self._started_ns = started_ns(info)
        self._writer = Writer(
            self._file,  # type: ignore[arg-type]  # of a file, it uses write, tell and flush
            chunk_size=_CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_data_crcs=True,
        )
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self.failed = ""
        with self._error_handling():
            self._writer.start(PROFILE, "gazerig")
            self._writer.add_metadata(fmt.RUN, as_text(info))
            self._file.keep()

    @property
    def written_file(self) -> WrittenFile:
        """Return the numbers of ticks, frames and bytes in the file."""
        count = self._counts.get
        return WrittenFile(count(fmt.TICK, 0), count(fmt.FRAME, 0), self._file.tell())

    def time_ns(self, at_s: float) -> int:
        """Return the wall clock at a time since the first tick."""
        return self._started_ns + round(at_s * _WHOLE_NS)

    def add(self, topic: str, at_s: float, message: object) -> None:
        """Append a message to the present chunk; do nothing after a failure.

        Args:
            topic: Its topic, which determines its type.
            at_s: Time since the first tick.
            message: The message.
        """
        if self.failed:
            return
        self._counts[topic] = self._counts.get(topic, 0) + 1
        with self._error_handling():
            channel = self._channels.get(topic)
            if channel is None:
                name, kind = fmt.TYPES[topic]
                schema = msgspec.json.encode(fmt.json_schema(kind))
                about = self._writer.register_schema(name, "jsonschema", schema)
                channel = int(self._writer.register_channel(topic, "json", about))
                self._channels[topic] = channel
            at_ns, data = self.time_ns(at_s), _encoder.encode(message)
            self._writer.add_message(channel, at_ns, data, at_ns, self._counts[topic])

    def flush(self) -> None:
        """Write the present chunk to the operating system."""
        if not self.failed:
            with self._error_handling():
                self._flush()

    def sync(self) -> None:
        """Make the operating system write everything to the disk."""
        if not self.failed:
            with self._error_handling():
                self._file.sync()

    def close(self, end: RunEnd) -> None:
        """Write the end of the run and the index, unless writing failed; close the file."""
        if not self.failed:
            with self._error_handling():
                self._writer.flush()  # type: ignore[no-untyped-call]
                self._writer.add_metadata(fmt.END, as_text(end))
                self._writer.finish()  # type: ignore[no-untyped-call]
                self._file.keep()
                self._file.sync()
        self._file.close()

    def _flush(self) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._file.keep()

    @contextlib.contextmanager
    def _error_handling(self) -> Iterator[None]:
        """On an error in the block, truncate the file and store the reason."""
        try:
            yield
        except OSError as error:
            self.failed = error.strerror or str(error)
            self._file.cut()
        except (TypeError, ValueError) as error:
            self.failed = f"it cannot be encoded: {error}"
            self._file.cut()


class _UnbufferedFile:
    """A file without a buffer, whose writes are complete or raise an error."""

    def __init__(self, fd: int) -> None:
        self._fd = fd
        self._at = self._kept = 0

    def write(self, data: bytes) -> int:
        rest = memoryview(data)
        while rest:
            done = os.write(self._fd, rest)
            rest = rest[done:]
            self._at += done
        return len(data)

    def tell(self) -> int:
        return self._at

    def flush(self) -> None:
        """Do nothing: there is no buffer."""

    def keep(self) -> None:
        """Mark the file as complete."""
        self._kept = self._at

    def cut(self) -> None:
        """Truncate the file to its last complete state."""
        with contextlib.suppress(OSError):  # also fails if the disk is gone
            os.ftruncate(self._fd, self._kept)
        self._at = self._kept

    def sync(self) -> None:
        os.fdatasync(self._fd)

    def close(self) -> None:
        os.close(self._fd)
