"""Writing files named by a user, without loss of existing data after any error.

Writes are atomic: a file is written in the same folder and then renamed. An existing file is kept
unless the user forces it. Named pipes and devices are refused: opening a pipe without a reader
waits forever, and a full device accepts nothing.
"""

import contextlib
import os
import secrets
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO

from gazerig.drivers.errors import SetupError
from gazerig.drivers.files.file_input import kind_of

_OWN_OUTPUT = ("/dev/fd/", "/proc/self/fd/")


def refuse_existing(*paths: Path, force: bool = False) -> None:
    """Check before any work that files can be written in the end.

    The program's own output (``/dev/stdout``, ``/dev/fd/3``) and ``/dev/null`` are accepted, as
    they contain no data that could be lost.

    Raises:
        SetupError: a file exists and is not forced; or the path is a directory, a named pipe, a
            device or a socket, or its folder is not writable.
    """
    for path in paths:
        with _clear(path):
            if _is_own_output(path):
                continue
            if path.is_dir():
                raise SetupError(f"{path} is a directory: name a file in it")
            if path.exists() and not path.is_file():
                kind = kind_of(path.stat())
                raise SetupError(f"{path} is {kind}: name a file, or /dev/stdout")
            if not force and (path.exists() or path.is_symlink()):
                raise SetupError(_exists_message(path))
            folder = path.parent
            if folder.exists() and not folder.is_dir():
                raise SetupError(f"{folder} is not a folder: name another file than {path}")
            if folder.is_dir() and not os.access(folder, os.W_OK):
                raise SetupError(f"cannot write {path}: its folder is read-only; name another")


@contextlib.contextmanager
def output_file(path: Path, force: bool = False) -> Iterator[BinaryIO]:
    """Yield a file to write to, which replaces the path only once it is completely on the disk.

    Args:
        path: Path of the file; the program's own output is written to directly.
        force: Whether to replace an existing file; otherwise it is refused.

    Raises:
        SetupError: it already exists or cannot be written; an existing file is unchanged.
    """
    refuse_existing(path, force=force)
    with _clear(path):
        if _is_own_output(path):
            with path.open("wb") as stream:
                yield stream
            return
        target = Path(os.path.realpath(path))
        fresh = target.with_name(f".{target.name[:80]}-{secrets.token_hex(4)}")
        with fresh.open("xb") as file:
            try:
                yield file
                file.flush()
                os.fsync(file.fileno())
                if target.exists():
                    if not force:  # created meanwhile
                        raise SetupError(_exists_message(path))
                    shutil.copymode(target, fresh)
                os.replace(fresh, target)
            finally:
                fresh.unlink(missing_ok=True)


def write_file(path: Path, content: str | bytes, force: bool = False) -> None:
    """Write a whole file; see ``output_file``.

    Raises:
        SetupError: see ``output_file``.
    """
    with output_file(path, force) as file:
        file.write(content.encode() if isinstance(content, str) else content)


def make_folder(path: Path) -> None:
    """Create a folder and its parents if they do not exist.

    Raises:
        SetupError: it cannot be created.
    """
    with _clear(path):
        path.mkdir(parents=True, exist_ok=True)


def _exists_message(path: Path) -> str:
    return f"{path} already exists: name another file, or use --force"


def _is_own_output(path: Path) -> bool:
    """Return whether a path is an open pipe or terminal of this program, or the null device."""
    whole = os.path.abspath(path)
    own = whole in ("/dev/stdout", "/dev/stderr") or whole.startswith(_OWN_OUTPUT)
    return whole == os.devnull or (own and path.exists() and not (path.is_file() or path.is_dir()))


@contextlib.contextmanager
def _clear(path: Path) -> Iterator[None]:
    """Convert errors of the disk into a SetupError of one line."""
    try:
        yield
    except OSError as error:
        why = error.strerror or str(error)
        raise SetupError(f"cannot write {path} ({why}): name another file") from error
