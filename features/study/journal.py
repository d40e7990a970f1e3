"""The journal of one participant and its records: every step is on disk before the next one.

A text file whose lines are never changed. A line is a JSON list of the records of one step, such
as all answers of a page: after a crash it is complete or missing. Conditions are named by their
keys in the design; browsers never receive records.
"""

import contextlib
import fcntl
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, fields
from math import nan
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import msgspec

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder

STEP_DEG = "largest_step_deg"
"""Largest step of any joint's goal between two ticks, in the switch to the condition."""
Outcome = Literal["complete", "head_lost", "interrupted", "withdrawn"]
AnswerValue = int | str | None
"""A rating 1..points, "first"/"second", free text, or None: not answered."""


@dataclass(frozen=True)
class ParticipationOpened:
    """A session began or was resumed.

    design_sha256: of the design's canonical text (gazerig.features.study.preregistration)
    order: condition keys of all trials in order, for pairs "a|b" as first and second
    program: version of the program; simulated: whether the participant is simulated
    """

    participant: str
    design_sha256: str
    order: tuple[str, ...]
    program: str
    utc: str
    simulated: bool = False


@dataclass(frozen=True)
class ConsentGiven:
    """Consent to each use, as requested on the consent page."""

    given: bool
    pictures: bool
    gaze: bool
    utc: str


@dataclass(frozen=True)
class TrialBegan:
    """A presentation began.

    trial: 0-based row of the order, practice trials below 0; attempt: from 0
    side: 0, or 1 for the second presentation of a pair
    """

    trial: int
    attempt: int
    condition: str
    utc: str
    side: int = 0


@dataclass(frozen=True)
class TrialEnded:
    """A presentation ended.

    recording: file next to the journal, "" without; reason: why it was not completed
    from_s, to_s: its start and end in the recording's time, nan without a recording
    """

    trial: int
    attempt: int
    outcome: Outcome
    seconds: float
    utc: str
    side: int = 0
    recording: str = ""
    reason: str = ""
    from_s: float = nan
    to_s: float = nan


@dataclass(frozen=True)
class ItemAnswered:
    """One item was answered.

    trial: None for questions at the end; condition: "a|b" for a pair
    ms: from the page's appearance to the answer, as measured by the browser
    """

    trial: int | None
    condition: str
    questionnaire: str
    item: str
    value: AnswerValue
    ms: float
    utc: str


@dataclass(frozen=True)
class TrialMeasured:
    """Measures of one presentation: name -> value, nan if unknown.

    values: the design's objective measures, and STEP_DEG
    """

    trial: int
    condition: str
    values: Mapping[str, float]
    side: int = 0
    attempt: int = 0


@dataclass(frozen=True)
class ParticipationClosed:
    """The session ended: finished, withdrawn, or the experimenter excluded the participant."""

    outcome: Literal["finished", "withdrawn", "excluded"]
    reason: str
    utc: str


Record = (
    ParticipationOpened
    | ConsentGiven
    | TrialBegan
    | TrialEnded
    | ItemAnswered
    | TrialMeasured
    | ParticipationClosed
)
"""``kind`` in JSON is the class's name."""


FILE = "journal.jsonl"
_LOCK = "lock"
_KINDS: Mapping[str, type[Record]] = {
    kind.__name__: kind
    for kind in (
        ParticipationOpened,
        ConsentGiven,
        TrialBegan,
        TrialEnded,
        ItemAnswered,
        TrialMeasured,
        ParticipationClosed,
    )
}


class WriteFailed(SetupError):
    """Records could not be written; the journal has not changed."""


class Journal:
    """The journal of a participant, open in one session only.

    Attributes:
        records: All records on disk.
        torn: Path of an incomplete last line after a crash, None without one.

    Args:
        folder: folder of the participant; it is created.

    Raises:
        SetupError: another session has opened it, or it cannot be read or written.
    """

    def __init__(self, folder: Path) -> None:
        make_folder(folder)
        self._folder = folder
        self._lock = _acquire_lock(folder)
        try:
            path = folder / FILE
            data = path.read_bytes() if path.exists() else b""
            whole = data.rfind(b"\n") + 1
            self.records = decode_records(data[:whole], path)
            self.torn: Path | None = None
            if whole < len(data):  # an incomplete last line is moved to its own file
                number = 1
                while (torn := folder / f"journal-torn-{number}.txt").exists():
                    number += 1
                torn.write_bytes(data[whole:])
                self.torn = torn
            self._fd = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
            os.ftruncate(self._fd, whole)
            self._size = os.lseek(self._fd, whole, os.SEEK_SET)
            os.fsync(self._fd)
            # Write the folder's entries of new files to disk, too.
            names = os.open(folder, os.O_RDONLY)
            try:
                os.fsync(names)
            finally:
                os.close(names)
        except OSError as error:
            os.close(self._lock)
            raise SetupError(f"{folder}: {error.strerror}") from error
        except BaseException:
            os.close(self._lock)
            raise

    def __enter__(self) -> "Journal":
        """Return the journal itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Close the journal."""
        self.close()

    def write(self, records: Sequence[Record]) -> None:
        """Add the records of one step; on return they are on disk.

        Raises:
            WriteFailed: nothing was written; the call may be repeated.
        """
        if not records:
            return
        line = encode_records(records)
        try:
            written = 0
            while written < len(line):
                written += os.write(self._fd, line[written:])
            os.fsync(self._fd)
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._fd, self._size)
                os.lseek(self._fd, self._size, os.SEEK_SET)
            raise WriteFailed(f"{self._folder / FILE}: not kept: {error.strerror}") from error
        self._size += len(line)
        self.records = (*self.records, *records)

    def close(self) -> None:
        """Close it, and release its lock."""
        os.close(self._fd)
        os.close(self._lock)


def read(folder: Path) -> tuple[Record, ...]:
    """Return all records of a participant, without an incomplete last line.

    Raises:
        SetupError: the journal is missing or damaged.
    """
    path = folder / FILE
    try:
        data = path.read_bytes()
    except OSError as error:
        raise SetupError(f"{path}: {error.strerror}") from error
    return decode_records(data[: data.rfind(b"\n") + 1], path)


def encode_records(records: Sequence[Record]) -> bytes:
    """Return records as one line; a value that is not a number is null."""
    said = [{"kind": type(one).__name__, **asdict(one)} for one in records]
    return msgspec.json.encode(said) + b"\n"


def decode_records(data: bytes, path: Path) -> tuple[Record, ...]:
    """Return the records of complete lines.

    Raises:
        SetupError: a line is invalid; the message has file, line and reason.
    """
    records: list[Record] = []
    for number, line in enumerate(data.splitlines(), start=1):
        try:
            for said in msgspec.json.decode(line, type=list[dict[str, Any]]):
                kind = _KINDS[said.pop("kind")]
                numbers = {field.name for field in fields(kind) if field.type is float}
                for name in numbers & said.keys():
                    said[name] = nan if said[name] is None else said[name]
                if kind is TrialMeasured:
                    values = said["values"].items()
                    said["values"] = {key: nan if one is None else one for key, one in values}
                records.append(msgspec.convert(said, kind))
        except (msgspec.MsgspecError, LookupError, TypeError, AttributeError, ValueError,
                RecursionError) as error:  # fmt: skip
            raise SetupError(
                f"{path}:{number}: no records of a session ({error}): the file was changed or "
                "damaged; put a copy of it in its place"
            ) from error
    return tuple(records)


@contextlib.contextmanager
def session_lock(folder: Path) -> Iterator[None]:
    """Hold the lock of a participant's folder.

    Raises:
        SetupError: a session holds it.
    """
    lock = _acquire_lock(folder)
    try:
        yield
    finally:
        os.close(lock)


def _acquire_lock(folder: Path) -> int:
    """Return the open lock of a folder; it is held until it is closed or the process ends.

    Raises:
        SetupError: another process holds it.
    """
    lock = os.open(folder / _LOCK, os.O_RDWR | os.O_CREAT, 0o600)
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError:
        os.close(lock)
        raise SetupError(
            f"{folder.name} has a session already, in another program: end that one, or take "
            "another participant"
        ) from None
    return lock
