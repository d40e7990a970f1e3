"""A study's data folder: the design, and a folder for each participant.

DATA/design.json                    the design at the first participant, with its hash
DATA/secret                         key for unguessable names of pages and films
DATA/films/                         one film for each condition
DATA/participants/P007/journal.jsonl  the records (gazerig.features.study.journal)
DATA/participants/P007/run-01.mcap    recordings of the head
DATA/deleted.txt                    codes of participants whose data were deleted
DATA/interim-looks.jsonl            analyses before the planned sample was complete
"""

import json
import os
import re
import secrets
import shutil
from pathlib import Path
from typing import NamedTuple

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import read_limited
from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.study.journal import FILE, session_lock
from gazerig.features.study.preregistration import design_sha256

_DESIGN, _SECRET, _DELETED = "design.json", "secret", "deleted.txt"
_LOOKS = "interim-looks.jsonl"
_CODE = re.compile(r"P(\d{3,6})")
_LARGEST = 10_000_000
_SECRET_BYTES = 32


class InterimLook(NamedTuple):
    """An analysis before the planned sample was complete.

    utc: time of the analysis; came, counted: participants at that time; planned: planned number
    """

    utc: str
    came: int
    counted: int
    planned: int


class StudyData:
    """The folder of a study's data."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    @property
    def films(self) -> Path:
        """Return the folder of the films."""
        return self.folder / "films"

    def claim(self, name: str, canonical: bytes) -> str:
        """Assign the folder to a design; return the design's hash.

        Raises:
            SetupError: it belongs to another design, or cannot be written.
        """
        sha256, path = self.check(canonical), self.folder / _DESIGN
        if path.exists():
            return sha256
        make_folder(self.folder)
        stated = {"name": name, "sha256": sha256, "design": json.loads(canonical)}
        write_file(path, json.dumps(stated, indent=1, ensure_ascii=False) + "\n")
        return sha256

    def check(self, canonical: bytes) -> str:
        """Return a design's hash if the folder can contain its data; nothing is written.

        Raises:
            SetupError: it belongs to another design.
        """
        sha256 = design_sha256(canonical)
        there = self.sha256() if (self.folder / _DESIGN).exists() else sha256
        if there != sha256:
            raise SetupError(
                f"{self.folder} has data of another design ({there[:12]}; this one is "
                f"{sha256[:12]}): a design does not change after its first participant; put "
                "it back as it was, or begin a new study with --data NEW_FOLDER"
            )
        return sha256

    def sha256(self) -> str:
        """Return the hash of the data's design.

        Raises:
            SetupError: the folder has no data, or the file of the design was changed.
        """
        path = self.folder / _DESIGN
        if not path.exists():
            raise SetupError(f"{self.folder} has no data of a study: there is no {_DESIGN}")
        try:
            stated = json.loads(read_limited(path, _LARGEST))
            said, design, _ = str(stated["sha256"]), stated["design"], stated["name"]
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise SetupError(f"{path} cannot be read ({error}): put a copy in its place") from error
        text = json.dumps(design, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
        if design_sha256(text.encode()) != said:
            raise SetupError(f"{path} was changed: its design does not have the hash {said[:12]}")
        return said

    def secret(self) -> bytes:
        """Return the study's secret key; the first call creates it.

        Raises:
            SetupError: it cannot be read or written.
        """
        path = self.folder / _SECRET
        if not path.exists():
            make_folder(self.folder)
            write_file(path, secrets.token_hex(_SECRET_BYTES) + "\n")
            os.chmod(path, 0o600)
        try:
            return bytes.fromhex(read_limited(path, _LARGEST).decode().strip())
        except (OSError, ValueError) as error:
            raise SetupError(f"{path} cannot be read ({error}): put a copy in its place") from error

    def participant(self, number: int) -> Path:
        """Return the folder of a participant."""
        return self.folder / "participants" / participant_code(number)

    def numbers(self) -> tuple[int, ...]:
        """Return the numbers of the participants with data, in order."""
        folder = self.folder / "participants"
        if not folder.is_dir():
            return ()
        found = (_CODE.fullmatch(one.name) for one in folder.iterdir() if (one / FILE).exists())
        return tuple(sorted(int(one[1]) for one in found if one))

    def deleted(self) -> tuple[str, ...]:
        """Return the codes of participants whose data were deleted."""
        path = self.folder / _DELETED
        return tuple(path.read_text(encoding="utf-8").split()) if path.exists() else ()

    def looks(self) -> tuple[InterimLook, ...]:
        """Return the analyses before the planned sample was complete.

        Raises:
            SetupError: their file is damaged.
        """
        path = self.folder / _LOOKS
        if not path.exists():
            return ()
        try:
            return tuple(
                InterimLook(**json.loads(line))
                for line in read_limited(path, _LARGEST).splitlines()
            )
        except (OSError, ValueError, TypeError) as error:
            raise SetupError(f"{path} cannot be read ({error}): put a copy in its place") from error

    def add_look(self, look: InterimLook) -> None:
        """Record an analysis, unless the last one had the same participants.

        Raises:
            SetupError: it cannot be written.
        """
        known = self.looks()
        if not known or known[-1][1:] != look[1:]:
            lines = [json.dumps(one._asdict()) + "\n" for one in (*known, look)]
            write_file(self.folder / _LOOKS, "".join(lines), force=True)

    def delete(self, number: int) -> int:
        """Delete all data of a participant; return the number of files.

        Results from all participants' data, such as reports, are deleted, too.

        Raises:
            SetupError: the participant has no data, or a session is open.
        """
        folder = self.participant(number)
        if not folder.is_dir():
            there = ", ".join(map(participant_code, self.numbers())) or "nobody"
            raise SetupError(
                f"{self.folder} has nothing of {participant_code(number)}; there is {there}"
            )
        with session_lock(folder):
            pass  # a damaged journal can be deleted, too
        made = [self.folder / name for name in ("report", "bids")]
        gone = [one for place in (folder, *made) for one in place.rglob("*") if one.is_file()]
        try:
            for place in (folder, *made):
                if place.exists():
                    shutil.rmtree(place)
            codes = sorted({*self.deleted(), participant_code(number)})
            write_file(self.folder / _DELETED, "\n".join(codes) + "\n", force=True)
        except OSError as error:
            raise SetupError(f"{folder}: {error.strerror}: not all was deleted") from error
        return len(gone)


def participant_code(number: int) -> str:
    """Return the code of a participant, e.g. P007.

    Raises:
        SetupError: the number is not from 1 to 999999.
    """
    if not 1 <= number <= 999_999:
        raise SetupError(f"participant {number}: a whole number from 1 to 999999; no names")
    return f"P{number:03d}"
