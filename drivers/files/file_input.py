"""Reading files named by a user: only regular files, and never more than a limit.

A named pipe would block, a device has no end, and opening a serial port toggles its control lines.
"""

import os
import stat
from collections.abc import Callable
from pathlib import Path
from typing import BinaryIO

_FLAGS = os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC


class NotRegularFile(OSError):
    """A path is a pipe, a device or a socket."""


class FileTooLarge(OSError):
    """A file is larger than its kind may be."""


_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def kind_of(found: os.stat_result) -> str:
    """Return the kind of a path that is neither a file nor a folder, e.g. "a named pipe"."""
    return _KINDS.get(stat.S_IFMT(found.st_mode), "no file")


def open_regular(path: Path | str) -> BinaryIO:
    """Open a regular file for reading; never waits for a writer.

    Raises:
        NotRegularFile: it is a pipe, a device or a socket.
        OSError: it is absent, a directory or not permitted.
    """
    try:
        _refuse_other_kinds(os.stat(path), path)
        descriptor = os.open(path, _FLAGS)
    except ValueError:  # a NUL byte
        raise FileNotFoundError(2, "no such file", str(path)) from None
    try:
        _refuse_other_kinds(os.fstat(descriptor), path)
    except OSError:
        os.close(descriptor)
        raise
    return os.fdopen(descriptor, "rb")


def read_limited(path: Path | str, largest: int) -> bytes:
    """Return the content of a regular file of at most ``largest`` bytes.

    Raises:
        FileTooLarge: it is larger.
        OSError: see ``open_regular``.
    """
    with open_regular(path) as file:
        # Files in /proc have size 0 and any content, so the size alone is not a limit.
        content = file.read(largest + 1) if os.fstat(file.fileno()).st_size <= largest else b""
        if len(content) > largest or os.fstat(file.fileno()).st_size > largest:
            what = f"is larger than the {largest / 1e6:g} MB that such a file may have"
            raise FileTooLarge(27, what, str(path))
    return content


def _refuse_other_kinds(found: os.stat_result, path: Path | str) -> None:
    if stat.S_ISREG(found.st_mode):
        return
    if stat.S_ISDIR(found.st_mode):
        raise IsADirectoryError(21, "is a directory", str(path))
    raise NotRegularFile(22, f"is {kind_of(found)}, not a regular file", str(path))


MAGIC = b"\x89MCAP0\r\n"
"""First and last bytes of every MCAP file."""


def open_mcap(path: Path, failed: Callable[[str], Exception], cure: str) -> BinaryIO:
    """Open an MCAP file, at the first byte after its magic bytes.

    Args:
        path: Path of the file.
        failed: Creates the error from its message.
        cure: Remedy if the file is not a recording.

    Raises:
        Exception: created by ``failed``: the file is absent, not a regular file, not readable or
            not a recording.
    """
    if not path.exists():
        raise failed(f"no recording at {path}: check the path")
    if not path.is_file():
        raise failed(f"{path} is not a file: name a recording in it")
    try:
        file = path.open("rb")
    except OSError as error:
        raise failed(f"cannot read {path} ({error.strerror}): check its permissions") from error
    if file.read(len(MAGIC)) != MAGIC:
        file.close()
        raise failed(f"{path} is not a recording: {cure}")
    return file
