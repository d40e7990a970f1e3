"""A recording of a run being written: MCAP in zstd chunks, every byte given to the system.

Nothing waits inside this program: what ``flush`` has written survives its death. After
an error the file is cut back to its last whole chunk, so that it can be read.
"""

import contextlib
import os
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import orjson
from mcap.writer import CompressionType, Writer

from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording.run_info import PROFILE, RunEnd, as_text

_CHUNK_BYTES = 1 << 20
_WHOLE_NS = 1_000_000_000


class WrittenFile(NamedTuple):
    """What is in a recording: ticks, frames, bytes."""

    ticks: int
    frames: int
    size: int


class RunWriter:
    """An MCAP file of one run.

    written: what is in it; failed: why nothing more can be written, or ""
    """

    def __init__(self, fd: int, about: Mapping[str, str], started_ns: int) -> None:
        """Begin the file.

        fd: an empty file, open for writing; it is closed with the recording
        about: the run's beginning as ``run_info.as_text`` gives it
        started_ns: wall clock that stands for the first tick's time
        """
        self._file = _Straight(fd)
        self._started_ns = started_ns
        self._writer = Writer(
            self._file,  # type: ignore[arg-type]  # of a file, it uses write, tell and flush
            chunk_size=_CHUNK_BYTES,
            compression=CompressionType.ZSTD,
            enable_data_crcs=True,
        )
        self._channels: dict[str, int] = {}
        self._counts: dict[str, int] = {}
        self.failed = ""
        self._safely(self._begin, about)

    @property
    def written(self) -> WrittenFile:
        """Count what is in the file."""
        count = self._counts.get
        return WrittenFile(count(fmt.TICK, 0), count(fmt.FRAME, 0), self._file.tell())

    def time_ns(self, at_s: float) -> int:
        """Return the wall clock at a time since the first tick."""
        return self._started_ns + round(at_s * _WHOLE_NS)

    def add(self, message: fmt.Message) -> None:
        """Append a message to the present chunk; without effect after a failure."""
        if self.failed:
            return
        self._counts[message.topic] = self._counts.get(message.topic, 0) + 1
        self._safely(self._add, message)

    def world(self, about: Mapping[str, str]) -> None:
        """Write the world that the run is in, as ``run_info.as_text`` gives it."""
        if not self.failed:
            self._safely(self._add_world, about)

    def flush(self) -> None:
        """Write the chunk in progress and hand it to the system."""
        if not self.failed:
            self._safely(self._flush)

    def sync(self) -> None:
        """Have the system put everything on the disk."""
        if not self.failed:
            self._safely(self._file.sync)

    def close(self, end: RunEnd) -> None:
        """Write how the run ended, and the index; after a failure the file ends as it is."""
        if not self.failed:
            self._safely(self._finish, end)
        self._file.close()

    def _begin(self, about: Mapping[str, str]) -> None:
        self._writer.start(PROFILE, "gazerig")
        self._writer.add_metadata(fmt.RUN, dict(about))
        self._file.keep()

    def _add_world(self, about: Mapping[str, str]) -> None:
        self._flush()
        self._writer.add_metadata(fmt.WORLD, dict(about))
        self._file.keep()

    def _add(self, message: fmt.Message) -> None:
        channel = self._channels.get(message.topic)
        if channel is None:
            channel = self._channels[message.topic] = self._register(message.topic)
        at_ns = self.time_ns(message.at_s)
        data = orjson.dumps(message.data)
        self._writer.add_message(channel, at_ns, data, at_ns, self._counts[message.topic])

    def _register(self, topic: str) -> int:
        name, schema = fmt.SCHEMAS[topic]
        about = self._writer.register_schema(name, "jsonschema", orjson.dumps(schema))
        return int(self._writer.register_channel(topic, "json", about))

    def _flush(self) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._file.keep()

    def _finish(self, end: RunEnd) -> None:
        self._writer.flush()  # type: ignore[no-untyped-call]
        self._writer.add_metadata(fmt.END, as_text(end))
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.keep()
        self._file.sync()

    def _safely(self, act: Callable[..., None], *arguments: Any) -> None:
        """Do it; where the disk refuses, cut the file back and say why."""
        try:
            act(*arguments)
        except OSError as error:
            self.failed = error.strerror or str(error)
            self._file.cut()
        except (TypeError, ValueError) as error:
            self.failed = f"it cannot be written down: {error}"
            self._file.cut()


class _Straight:
    """A file whose every write is a write of the system, whole or an error."""

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
        """Nothing waits here."""

    def keep(self) -> None:
        """Mark the file as complete."""
        self._kept = self._at

    def cut(self) -> None:
        """Go back to where the file was good."""
        with contextlib.suppress(OSError):  # a disk that is gone cannot do that either
            os.ftruncate(self._fd, self._kept)
        self._at = self._kept

    def sync(self) -> None:
        os.fdatasync(self._fd)

    def close(self) -> None:
        os.close(self._fd)
