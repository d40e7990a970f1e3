"""A study's data folder, and the journal of one participant: each step is on disk before the next.

DATA/design.json                      the design at the first participant
DATA/films/                           the rendered films
DATA/participants/P007/journal.jsonl  the records of a participant
DATA/participants/P007/token          token of the participant's page

A line of a journal is a JSON list of the records of one step, such as all answers of a page: after
a crash it is complete or missing. Browsers never receive records.
"""

import contextlib
import fcntl
import os
from pathlib import Path
from typing import Literal

import msgspec

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.study.design import Questionnaire, Study, StudyDesign

AnswerValue = int | str
"""A rating 1..points, "first"/"second", or free text."""
_JOURNAL, _DESIGN = "journal.jsonl", "design.json"


class JournalRecord(msgspec.Struct, frozen=True, omit_defaults=True):
    """One record of a journal.

    kind: what happened; "opened" also at each resumption; "closed" is permanent
    note: "opened": the program's version; "ended": why a presentation was interrupted, "" if it
        was complete; "closed": "withdrew" if the participant declined or left
    trial: 0-based row of the order, practice trials below 0, None at the end of the session
    side: 0, or 1 for the second presentation of a pair
    condition: that of the presentation, or of the answered trial; "a|b" for a pair
    ms: from the page's appearance to the answer, as measured by the browser
    """

    kind: Literal["opened", "consented", "began", "ended", "answered", "closed"]
    utc: str
    note: str = ""
    simulated: bool = False
    trial: int | None = None
    side: int = 0
    condition: str = ""
    questionnaire: str = ""
    item: str = ""
    value: AnswerValue = ""
    ms: float = 0.0


class Journal:
    """The journal of a participant in a folder, which is created; open in one session only.

    Attributes:
        records: All records on disk.

    Raises:
        SetupError: another session has opened it, or it cannot be read.
    """

    def __init__(self, folder: Path) -> None:
        make_folder(folder)
        self._path = folder / _JOURNAL
        self._file = self._path.open("a+b", buffering=0)
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise SetupError(
                f"{folder.name} has a session in another program: end that one, or take another "
                "participant"
            ) from None
        self.records, self._size = _read(self._path)
        self._file.truncate(self._size)  # an incomplete last line was never confirmed
        for path in (folder, folder.parent, folder.parent.parent):
            names = os.open(path, os.O_RDONLY)
            os.fsync(names)  # the entries of new files
            os.close(names)

    def write(self, *records: JournalRecord) -> None:
        """Add the records of one step; on return they are on disk.

        Raises:
            SetupError: nothing was written; the call may be repeated.
        """
        line = msgspec.json.encode(records) + b"\n"
        try:
            if self._file.write(line) < len(line):
                raise OSError(0, "the disk is full")
            os.fsync(self._file)
        except OSError as error:
            with contextlib.suppress(OSError):
                self._file.truncate(self._size)
            raise SetupError(f"{self._path}: not written: {error.strerror}") from error
        self._size += len(line)
        self.records += records

    def close(self) -> None:
        """Close the file, and release its lock."""
        self._file.close()


def _read(path: Path) -> tuple[list[JournalRecord], int]:
    """Return the records of the complete lines of a journal, and the size of these lines."""
    data = path.read_bytes()
    size = data.rfind(b"\n") + 1
    records: list[JournalRecord] = []
    for number, line in enumerate(data[:size].splitlines(), start=1):
        try:
            records += msgspec.json.decode(line, type=list[JournalRecord])
        except (msgspec.MsgspecError, UnicodeDecodeError) as error:
            raise SetupError(f"{path}:{number}: changed or damaged ({error})") from error
    return records, size


class StoredDesign(msgspec.Struct):
    """The design in a data folder."""

    design: StudyDesign
    questionnaires: dict[str, Questionnaire]


class StudyFolder:
    """The folder of a study's data."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def claim(self, study: Study) -> None:
        """Assign the folder to a design.

        Raises:
            SetupError: it has data of another design, or cannot be written.
        """
        stored = StoredDesign(study.design, dict(study.questionnaires))
        encoded, path = msgspec.json.encode(stored), self.path / _DESIGN
        if self.journals() and path.read_bytes() != encoded:
            raise SetupError(
                f"{self.path} has data of another design: a design does not change after its first "
                "participant; restore it, or use --data NEW_FOLDER"
            )
        make_folder(self.path)
        write_file(path, encoded, force=True)

    def design(self) -> StoredDesign:
        """Return the design of the data.

        Raises:
            SetupError: the folder has no data of a study, or the file was changed.
        """
        try:
            return msgspec.json.decode((self.path / _DESIGN).read_bytes(), type=StoredDesign)
        except (OSError, msgspec.MsgspecError) as error:
            raise SetupError(f"{self.path} has no data of a study: {error}") from error

    def participant(self, number: int) -> Path:
        """Return the folder of a participant."""
        return self.path / "participants" / f"P{number:03d}"

    def journals(self) -> dict[str, list[JournalRecord]]:
        """Return the records of every participant by code.

        Raises:
            SetupError: a journal is damaged.
        """
        paths = sorted(self.path.glob(f"participants/P*/{_JOURNAL}"))
        return {path.parent.name: _read(path)[0] for path in paths if path.stat().st_size}
