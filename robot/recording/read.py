"""Reader of a recorded run; that of a killed program is readable to its last complete part."""

import struct
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from math import isfinite
from pathlib import Path

import msgspec
import zstandard
from mcap.exceptions import EndOfFile, McapError
from mcap.records import Channel, Chunk, Footer, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader
from msgspec import UNSET, structs

from gazerig.drivers.errors import DriverError, SetupError
from gazerig.drivers.files.file_input import MAGIC, open_mcap
from gazerig.gaze.types import Percept
from gazerig.robot.loop.tick import Tick, TickRecord
from gazerig.robot.loop.tick_stream import decode, to_array
from gazerig.robot.model.commands import check_command
from gazerig.robot.recording import run_format as fmt
from gazerig.robot.recording.run_info import FORMAT, PROFILE, RunEnd, RunInfo, read_text

_CURE = "make one with gazerig run --record"
_RUN = PROFILE.rstrip("0123456789")
_LARGEST = 64 << 20  # bytes of a record; the writer's have about 1 MB, more is damage
_LONGEST_GAP_S = 3600.0  # between two ticks; more is damage
DAMAGE = (
    McapError, KeyError, TypeError, ValueError, IndexError, struct.error, zlib.error, zstandard.ZstdError,
    AttributeError, ArithmeticError, RecursionError, MemoryError,
)  # fmt: skip
"""Errors caused by a file with damaged or impossible contents."""


class _Exact(msgspec.Struct):
    """The part of a ``TickRecord`` that replaces the others."""

    exact: bytes = b""


_ticks = msgspec.json.Decoder(TickRecord, dec_hook=to_array)
_exact = msgspec.json.Decoder(_Exact)


class BadRecording(SetupError):
    """A file that is not a recording of a run, or cannot be read further."""


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
        info: RunInfo | None = None
        times_ns: list[int] = []
        for record in self._records(emit_chunks=True):
            match record:
                case Header():
                    self._check_profile(record.profile)
                case Chunk():
                    times_ns += (record.message_start_time, record.message_end_time)
                case Metadata(name=fmt.RUN):
                    with report_bad_contents(self.path):
                        info = read_text(record.metadata, RunInfo)
                case Metadata(name=fmt.END):
                    with report_bad_contents(self.path):
                        self.end = read_text(record.metadata, RunEnd)
                case Footer():
                    self.whole = True
        if info is None:
            raise BadRecording(f"{self.path} is empty: it contains nothing of a run")
        self.info = info
        self.duration_s = (max(times_ns) - min(times_ns)) / 1e9 if times_ns else 0.0

    @property
    def note(self) -> str:
        """Return the recording's defect, or the fault that ended the run; "" without either."""
        name, lost = self.path.name, self.end.lost
        if not self.whole:
            return f"{name} was not closed: it contains the data that its writer had written to the disk"
        if not self.end.stopped_by:
            return f"{name} ends at the time at which the program was killed"
        if self.end.stopped_by.startswith("fault"):
            return f"{name} ends with a {self.end.stopped_by}"
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
        percept: Percept | None = None
        before_s: float | None = None
        for data in self._tick_messages():
            with report_bad_contents(self.path):
                exact = _exact.decode(data).exact
                record = decode(exact, TickRecord) if exact else _ticks.decode(data)
                if record.percept is not UNSET:
                    percept = record.percept
                commands = tuple([check_command(one) for one in record.tick.commands])
                tick = structs.replace(record.tick, percept=percept, commands=commands)
                # Exports fill gaps with rows; a gap of years would give too many.
                if not isfinite(tick.t_s) or (
                    before_s is not None and not 0.0 <= tick.t_s - before_s < _LONGEST_GAP_S
                ):
                    raise ValueError(f"a tick at {tick.t_s} s after {before_s} s")
                before_s = tick.t_s
            yield structs.replace(record, tick=tick, percept=percept)

    def _tick_messages(self) -> Iterator[bytes]:
        """Return the ticks in the order of the file."""
        ticks: set[int] = set()
        for record in self._records(emit_chunks=False):
            if isinstance(record, Channel) and record.topic == fmt.TICK:
                ticks.add(record.id)
            elif isinstance(record, Message) and record.channel_id in ticks:
                yield record.data

    def _records(self, emit_chunks: bool) -> Iterator[McapRecord]:
        """Return the complete records; in a file that was not closed, those before its end.

        Args:
            emit_chunks: Return chunks as they are, without their records.
        """
        with open_mcap(self.path, BadRecording, _CURE) as file, report_bad_contents(self.path):
            file.seek(-len(MAGIC), 2)
            closed = file.read() == MAGIC and file.tell() > len(MAGIC)
            file.seek(0)
            reader = StreamReader(
                file, emit_chunks=emit_chunks, validate_crcs=True, record_size_limit=_LARGEST
            )
            try:
                yield from reader.records
            except (EndOfFile, struct.error):
                if closed:
                    raise

    def _check_profile(self, profile: str) -> None:
        """Reject a file that is not a recording of a run."""
        if profile == PROFILE:
            return
        if profile.startswith(_RUN):
            raise BadRecording(
                f"{self.path} is of format {profile.removeprefix(_RUN)}, this program reads "
                f"{FORMAT}: use the version of gazerig that recorded it"
            )
        raise BadRecording(
            f"{self.path} is not a recording of a run (its profile is {profile!r}): {_CURE}"
        )


@contextmanager
def report_bad_contents(path: Path) -> Iterator[None]:
    """Convert errors caused by damaged or impossible contents of a recording to one line.

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
        what = " ".join(str(error).split())[:80] or type(error).__name__
        raise BadRecording(f"{path} is damaged ({what}): copy it again, or record again") from error
