"""The folder of a sweep: its arguments, and every finished run immediately after its end.

``arguments.json`` contains everything that affects the runs, ``runs.jsonl`` one line for each run.
A second sweep with the same arguments continues an interrupted one.
"""

import contextlib
import fcntl
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import BinaryIO

from gazerig.config.export import abbreviated
from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_output import make_folder, write_file
from gazerig.features.lab.sweep.axes import Point
from gazerig.features.lab.sweep.outcome import Outcome

ARGUMENTS, RUNS = "arguments.json", "runs.jsonl"
_SHOWN = 4

Arguments = Mapping[str, object]
"""Name -> JSON value; nested mappings are compared key by key."""


class RunStore:
    """Finished runs on the disk, by point and seed.

    Args:
        folder: the folder of the sweep.
        file: ``RUNS`` in it, open for appending and locked.
    """

    def __init__(self, folder: Path, file: BinaryIO) -> None:
        self.folder, self._file = folder, file
        self._found = dict[str, Outcome]()
        self._read()

    def _read(self) -> None:
        """Read finished runs; remove an incomplete last line of an interrupted write."""
        self._file.seek(0)
        whole = 0
        for line in self._file:
            try:
                point, seed, figures, failed = json.loads(line)
            except ValueError:
                break
            whole += len(line)
            self._found[_key(point, seed)] = Outcome(point, seed, figures, failed)
        self._file.truncate(whole)

    def __len__(self) -> int:
        return len(self._found)

    def get(self, point: Point, seed: int) -> Outcome | None:
        """Return a finished run, None if there is none."""
        return self._found.get(_key(point, seed))

    def add(self, outcome: Outcome) -> None:
        """Write a finished run."""
        self._found[_key(outcome.point, outcome.seed)] = outcome
        # No fsync for each run: a power loss may lose runs, an end of the program does not.
        self._file.write(json.dumps(list(outcome[:4])).encode() + b"\n")
        self._file.flush()


@contextlib.contextmanager
def run_store(folder: Path, arguments: Arguments) -> Iterator[RunStore]:
    """Open the folder of a sweep, a new one or one with the same arguments.

    Raises:
        SetupError: the folder contains a sweep with other arguments or other files, another program
            writes in it, or it cannot be written.
    """
    make_folder(folder)
    path = folder / ARGUMENTS
    text = json.dumps(arguments, indent=1) + "\n"
    if path.exists():
        _refuse_others(folder, _arguments_in(path), json.loads(text))
    elif any(folder.iterdir()):
        raise SetupError(f"{folder} holds other files: give an empty folder with --out")
    try:
        file = (folder / RUNS).open("a+b")
    except OSError as error:
        raise SetupError(f"cannot write {folder / RUNS} ({error.strerror})") from error
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise SetupError(
                f"another gazerig sweep writes in {folder}: give another --out"
            ) from None
        if not path.exists():
            write_file(path, text)
        yield RunStore(folder, file)


def _arguments_in(path: Path) -> dict[str, object]:
    """Return the arguments of the sweep in a folder."""
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise SetupError(f"{path} is not readable ({error}): give another --out") from None
    if not isinstance(found, dict):
        raise SetupError(f"{path} is no sweep's: give another --out")
    return found


def _refuse_others(folder: Path, then: Mapping[str, object], now: Mapping[str, object]) -> None:
    """Refuse to continue with other arguments, and list them.

    Raises:
        SetupError: they differ.
    """
    found = list(_differences(then, now))
    if not found:
        return
    more = f"; {len(found) - _SHOWN} more" if len(found) > _SHOWN else ""
    raise SetupError(
        f"{folder} holds a sweep with other arguments: {'; '.join(found[:_SHOWN])}{more}; "
        "repeat those, or give another folder with --out"
    )


def _differences(then: object, now: object, key: str = "") -> Iterator[str]:
    """Yield the differences of two JSON values, as text."""
    if isinstance(then, dict) and isinstance(now, dict):
        for name in {**then, **now}:
            below = f"{key}.{name}" if key else str(name)
            yield from _differences(then.get(name), now.get(name), below)
    elif then != now:
        yield f"{key} was {abbreviated(then)}, is now {abbreviated(now)}"


def _key(point: Point, seed: int) -> str:
    return json.dumps([point, seed])
