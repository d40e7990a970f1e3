"""Reader of a recorded run; that of a killed program is readable to its last complete part."""

import base64
import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from math import isfinite
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import msgspec
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.exceptions import McapError
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Header, Metadata

from gazerig.drivers.errors import DriverError, SetupError
from gazerig.drivers.files.file_input import MAGIC, open_mcap
from gazerig.gaze.types import Percept
from gazerig.robot.control.tick import Tick
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording.run_info import (
    FORMAT,
    PROFILE,
    RunEnd,
    RunInfo,
    read_run_end,
    read_run_info,
)
from gazerig.robot.recording.tick_record import TickRecord, from_json, percept_from_json

_CURE = "make one with gazerig run --record"
_CAMERA = "gazerig-camera-"
_RUN = PROFILE.rstrip("0123456789")
_HEAD = 9  # bytes of a record's header: kind and length
_LARGEST_CHUNK = 64 << 20
"""Limit of a compressed or decompressed chunk; the writer's chunks have about 1 MB."""
_LARGEST = _LARGEST_CHUNK + 1000  # bytes of a record; more is damage
_CRC_PIECE = 1 << 20
_LONGEST_GAP_S = 3600.0  # between two ticks; more is damage
_FIXED = 22  # bytes of a message before its data: channel, sequence, two times
_PERCEPTS_KEPT = 8  # a tick refers to the newest one or the one before it
_KINDS = frozenset(value for name, value in vars(Opcode).items() if name.isupper())
DAMAGE = (
    McapError, KeyError, TypeError, ValueError, IndexError, struct.error, zlib.error, zstandard.ZstdError,
    AttributeError, ArithmeticError, RecursionError, MemoryError,
)  # fmt: skip
"""Errors caused by a file with damaged or impossible contents."""


class BadChunk(McapError):
    """A chunk that does not match its header."""


def decompress_chunk(chunk: Chunk) -> bytes:
    """Decompress the records of a chunk.

    Raises:
        BadChunk: The chunk is too large, does not match its header or uses another compression.
        zstandard.ZstdError: The chunk is damaged.
    """
    size = chunk.uncompressed_size
    if size > _LARGEST_CHUNK:
        raise BadChunk(f"a chunk of {size / 1e6:.0f} MB")
    if chunk.compression == "zstd":
        # At most one byte more than the size: a few bytes can expand to gigabytes.
        decompressor = zstandard.ZstdDecompressor(max_window_size=_LARGEST_CHUNK)
        with decompressor.stream_reader(BytesIO(chunk.data), read_across_frames=True) as reader:
            found: bytes = reader.read(size + 1)
            data = found
    elif chunk.compression == "":
        data = chunk.data
    else:
        raise BadChunk("a chunk compressed by another program")
    if len(data) != size:
        raise BadChunk("a chunk whose size differs from its header")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise BadChunk("a chunk with a wrong checksum")
    return data


class BadRecording(SetupError):
    """A file that is not a recording of a run, or cannot be read further."""


class _ChunkIndex(NamedTuple):
    """Position of a chunk's content in the file, and the times of its messages."""

    offset: int
    length: int
    first_ns: int
    last_ns: int


class RunRecording:
    """A recording made by ``gazerig run --record``; each call reads from the beginning.

    Attributes:
        path: The file.
        info: Settings at the start of the run.
        end: Record of the end of the run.
        whole: Whether the file was closed properly; if not, its writer was killed.
        duration_s: Time from the first to the last message.
    """

    def __init__(self, path: Path | str) -> None:
        """Read the file's index; ticks are read by ``ticks`` and ``moments``.

        Raises:
            BadRecording: The file is missing, not a recording of a run, or of a newer format.
        """
        self.path = Path(path)
        self.whole = False
        self.end = RunEnd()
        self._chunks: list[_ChunkIndex] = []
        found: RunInfo | None = None
        with open_mcap(self.path, BadRecording, _CURE) as file:
            for kind, offset, length in self._records(file):
                if kind == Opcode.HEADER:
                    with _damage_errors(self.path):
                        profile = Header.read(_content(file, offset, length)).profile
                    self._check_profile(profile)
                elif kind == Opcode.CHUNK:
                    with _damage_errors(self.path):
                        first_ns, last_ns = struct.unpack("<QQ", _bytes(file, offset, 16))
                    self._chunks.append(_ChunkIndex(offset, length, first_ns, last_ns))
                elif kind == Opcode.METADATA:
                    with _damage_errors(self.path):
                        record = Metadata.read(_content(file, offset, length))
                    found = self._read_metadata(record) or found
                elif kind == Opcode.DATA_END:
                    self._check_sum(file, offset, length)
                elif kind == Opcode.FOOTER:
                    self.whole = True
        if found is None:
            raise BadRecording(f"{self.path} is empty: it contains nothing of a run")
        self.info = found
        chunks = self._chunks
        self.duration_s = (
            (max(c.last_ns for c in chunks) - min(c.first_ns for c in chunks)) / 1e9
            if chunks
            else 0.0
        )

    @property
    def note(self) -> str:
        """Return a description of the recording's defect, "" if it has none."""
        name, lost = self.path.name, self.end.lost
        if not self.whole:
            return f"{name} was not closed: it contains the data that its writer had written to the disk"
        if not self.end.stopped_by:
            return f"{name} ends at the time at which the program was killed"
        return f"{name} lacks {lost} ticks that could not be stored" if lost else ""

    def ticks(self) -> Iterator[Tick]:
        """Return the ticks, bit for bit, without detections and frames (``detections=None``).

        Raises:
            BadRecording: The file is damaged.
        """
        return (moment.tick for moment in self.moments())

    def moments(self) -> Iterator[TickRecord]:
        """Return the ticks with their further inputs.

        Raises:
            BadRecording: The file is damaged.
        """
        percepts: dict[int, Percept] = {}
        before_s: float | None = None
        for topic, data in self._messages({fmt.TICK, fmt.PERCEPT}):
            with _damage_errors(self.path):
                message = msgspec.json.decode(data)
                if topic == fmt.PERCEPT:
                    number, percept = percept_from_json(message)
                    percepts[number] = percept
                    if len(percepts) > _PERCEPTS_KEPT:
                        del percepts[next(iter(percepts))]
                    continue
                moment = from_json(message, percepts)
                t_s = moment.tick.t_s
                # Exports fill gaps with rows; a gap of years would give too many.
                if not isfinite(t_s) or (
                    before_s is not None and not 0.0 <= t_s - before_s < _LONGEST_GAP_S
                ):
                    raise ValueError(f"a tick at {t_s} s after {before_s} s")
                before_s = t_s
            yield moment

    def frames(self) -> Iterator[tuple[float, bytes]]:
        """Return the camera's frames: time of the exposure and JPEG.

        Raises:
            BadRecording: The file is damaged.
        """
        for _, data in self._messages({fmt.FRAME}):
            with _damage_errors(self.path):
                message = msgspec.json.decode(data)
                frame = float(message["captured_s"]), base64.b64decode(message["data"])
            yield frame

    def health(self) -> Iterator[dict[str, Any]]:
        """Return the bus counts and the servos' readings, recorded once per second.

        Raises:
            BadRecording: The file is damaged.
        """
        for _, data in self._messages({fmt.HEALTH}):
            with _damage_errors(self.path):
                message: dict[str, Any] = msgspec.json.decode(data)
            yield message

    def _messages(self, wanted: set[str]) -> Iterator[tuple[str, memoryview]]:
        """Return topic and data of the messages of some topics, in the order of the file."""
        topics: dict[int, str] = {}
        with open_mcap(self.path, BadRecording, _CURE) as file:
            for place in self._chunks:
                with _damage_errors(self.path):
                    chunk = Chunk.read(_content(file, place.offset, place.length))
                    records = memoryview(decompress_chunk(chunk))
                    found = list(_select_messages(records, topics, wanted))
                yield from found

    def _read_metadata(self, record: Metadata) -> RunInfo | None:
        """Read a metadata record; return the run's settings if it contains them."""
        with _damage_errors(self.path):
            if record.name == fmt.END:
                self.end = read_run_end(record.metadata)
            return read_run_info(record.metadata) if record.name == fmt.RUN else None

    def _check_profile(self, profile: str) -> None:
        """Reject a file that is not a recording of a run."""
        if profile == PROFILE:
            return
        if profile.startswith(_CAMERA):
            raise BadRecording(
                f"{self.path} is a recording of a camera, not of a run: play it with "
                "gazerig run --camera-recording"
            )
        if profile.startswith(_RUN):
            raise BadRecording(
                f"{self.path} is of format {profile.removeprefix(_RUN)}, this program reads up to "
                f"{FORMAT}: update gazerig"
            )
        raise BadRecording(
            f"{self.path} is not a recording of gazerig (its profile is {profile!r}): make one with "
            "gazerig run --record"
        )

    def _check_sum(self, file: BinaryIO, offset: int, length: int) -> None:
        """Reject a file whose bytes do not match its checksum."""
        with _damage_errors(self.path):
            wanted = DataEnd.read(_content(file, offset, length)).data_section_crc
        if not wanted:  # earlier versions wrote no checksum
            return
        file.seek(0)
        left, found = offset - _HEAD, 0
        while left > 0 and (piece := file.read(min(left, _CRC_PIECE))):
            found, left = zlib.crc32(piece, found), left - len(piece)
        if found != wanted:
            raise BadRecording(f"{self.path} is damaged (wrong checksum): copy it again")

    def _records(self, file: BinaryIO) -> Iterator[tuple[int, int, int]]:
        """Return kind, offset and length of each complete record."""
        end = file.seek(0, 2)
        # A file with this magic number at its end was written completely.
        closed = end > 2 * len(MAGIC) and _bytes(file, end - len(MAGIC), len(MAGIC)) == MAGIC
        offset = len(MAGIC)
        while offset + _HEAD <= end:
            head = _bytes(file, offset, _HEAD)
            kind, length = head[0], int.from_bytes(head[1:], "little")
            cut = offset + _HEAD + length > end
            if length > _LARGEST or kind not in _KINDS or (cut and closed):
                raise BadRecording(f"{self.path} is damaged after byte {offset}: copy it again")
            if cut:
                return
            yield kind, offset + _HEAD, length
            if kind == Opcode.FOOTER:
                return
            offset += _HEAD + length
        if closed:
            raise BadRecording(f"{self.path} is damaged after byte {offset}: copy it again")


def _select_messages(
    records: memoryview, topics: dict[int, str], wanted: set[str]
) -> Iterator[tuple[str, memoryview]]:
    """Return topic and data of a chunk's wanted messages; add its channels to ``topics``."""
    at = 0
    while at < len(records):
        kind, length = records[at], int.from_bytes(records[at + 1 : at + _HEAD], "little")
        at += _HEAD
        if kind == Opcode.MESSAGE:
            topic = topics[int.from_bytes(records[at : at + 2], "little")]
            if topic in wanted:
                yield topic, records[at + _FIXED : at + length]
        elif kind == Opcode.CHANNEL:
            channel = Channel.read(ReadDataStream(BytesIO(records[at : at + length])))
            topics[channel.id] = channel.topic
        at += length


@contextmanager
def report_bad_contents(path: Path) -> Iterator[None]:
    """Convert errors caused by impossible contents of a recording to one line.

    Use it around code that processes a recording: a well-formed file may contain impossible
    values.

    Raises:
        BadRecording: The contents are damaged or were edited by hand.
    """
    try:
        yield
    except DriverError:
        raise
    except DAMAGE as error:
        what = f"{type(error).__name__}: {' '.join(str(error).split())[:80]}"
        raise BadRecording(f"{path} contains impossible values ({what}): record again") from error


@contextmanager
def _damage_errors(path: Path) -> Iterator[None]:
    """Convert errors of a damaged file to one line."""
    try:
        yield
    except BadRecording:
        raise
    except DAMAGE as error:
        what = " ".join(str(error).split())[:80]
        raise BadRecording(f"{path} is damaged ({what}): copy it again") from None


def _bytes(file: BinaryIO, offset: int, length: int) -> bytes:
    file.seek(offset)
    return file.read(length)


def _content(file: BinaryIO, offset: int, length: int) -> ReadDataStream:
    """Return a stream of a record's content."""
    return ReadDataStream(BytesIO(_bytes(file, offset, length)))
